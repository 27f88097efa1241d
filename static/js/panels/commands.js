// Commands: the sequence as an editable table, export, and sending through the command gate, whole or step by step.

import { ROOT, once, post, request } from "../api.js";
import { choices } from "../choices.js";
import { act } from "../acts.js";
import { $, age, attempt, element, fixed } from "../dom.js";
import { edit, redo, toldChoice, undo } from "../edits.js";
import { answered, awaited } from "../planning.js";
import { ruleTold } from "../rules.js";
import { alive, changed, known, silent, subscribe } from "../store.js";
import { kept, unsure } from "./conn.js";
import { sagSettings, titleOf } from "./execution.js";
import { choose, chosenRow, onChoice } from "./row.js";
import { rowStates } from "./run.js";

let armed = null; // {token, digest, until}
let drawn = "";

export function start() {
  act({ text: "Insert a wait before the first row", button: "insert-wait", run: () => edit({ kind: "insert", row: 0, command: { name: "WAIT", duration: 1.0 } }), refusal: () => (known.sequence ? "" : "There is no sequence yet.") });
  act({ text: "Arm the commands", button: "arm", run: arm, refusal: notArmable });
  act({ text: "Send to rover", button: "send", run: send, refusal: () => (armedFor() ? unsure() : "Arm the commands first.") });
  act({ key: "S", text: "Make the command sequence", button: "make-sequence", run: make, refusal: () => (awaited() || known.summary?.to_command ? "" : notPlanned()) });
  act({ key: "E", text: "Export the sequence", button: "export", run: exportSequence, refusal: () => (!known.sequence ? "There is no sequence yet." : known.sequence.valid ? "" : "A rule does not hold: see the list.") });
  act({ text: "Import commands from a file", button: "import", run: () => $("import-file").click(), refusal: notImportable });
  $("import-file").addEventListener("change", importFile);
  act({ key: "Ctrl+Z", text: "Undo the last choice or edit", button: "undo", run: undo, refusal: () => (known.summary?.undo || known.summary?.hand?.moved ? "" : "There is nothing to undo.") });
  act({ key: "Ctrl+Y", text: "Redo what was undone last", button: "redo", run: redo, refusal: () => (known.summary?.redo ? "" : "There is nothing undone to make again.") });
  attempt(offerFormats);
  onChoice(() => draw(known));
  for (const id of ["as-commanded", "execution-mode"]) $(id).addEventListener("change", changed);
  subscribe(draw);
}

async function offerFormats() {
  const { export_formats: formats } = await choices();
  $("export-format").replaceChildren(...formats.map(({ format, title }) => element("option", { value: format, textContent: title })));
}

// What commands are made of is told by the server, and named on the button: nothing else is made.
const make = () => attempt(async () => {
  const fresh = awaited();
  await answered();
  const { to_command: meant, plan } = known.summary;
  if (fresh && plan.status !== "found") throw new Error(`Nothing was made: no plan was found. ${plan.reason}`);
  if (!meant) throw new Error(`Nothing was made: ${notPlanned()}`);
  await post("/sessions/current/sequences", { plan: meant.plan, ...(meant.step ? wayOfStep() : wayOfMove()) }, once());
});

const commandedAs = (mode) => ($("as-commanded").checked ? { as_commanded: true } : { settings: sagSettings(mode) });

const wayOfStep = () => commandedAs(null);

// How a move of the chassis is commanded: with the pose held where sag is known, unless an expert takes it as commanded.
export const wayOfMove = () => commandedAs("pose_held");

const notPlanned = () => (known.summary?.plan.status === "found"
  ? "What was planned was carried out: plan the next step or move."
  : "There is no plan to make commands of: plan the step first.");
const exportSequence = () => attempt(async () => {
  const format = $("export-format").value;
  const path = `${ROOT}/sequences/${known.sequence.digest}/export?format=${format}`;
  await post(path); // recorded; a refusal is told here, before the browser saves anything
  const { response } = await request("GET", path);
  const name = /filename="([^"]+)"/.exec(response.headers.get("Content-Disposition") ?? "")?.[1] ?? `sequence.${format}`;
  const link = element("a", { href: path, download: name });
  document.body.append(link);
  link.click();
  link.remove();
});

function notImportable() {
  if (!known.summary?.dem) return "There is no terrain to check commands on: build or load it first.";
  return known.summary.state ? "" : "It is not known how the rover stands yet.";
}

const importFile = () => attempt(async () => {
  const file = $("import-file").files[0];
  if (!file) return;
  const form = new FormData();
  form.append("file", file);
  try {
    await post("/sessions/current/sequences/import", form, once());
  } finally {
    $("import-file").value = ""; // the same file, mended, is a change again
  }
});

const arm = () => attempt(async () => {
  const asked = performance.now(); // the server counts from before its answer arrives
  const answer = await post(`/sequences/${known.sequence.digest}/arm`, {});
  armed = { token: answer.token, digest: answer.sequence, until: asked + answer.expires_in * 1000 };
  changed();
});

const send = () => attempt(async () => {
  if (!armed) return; // a second click
  const { token, digest } = armed;
  armed = null;
  changed();
  await post(`/sequences/${digest}/send`, { arming: token, mode: $("by-steps").checked ? "steps" : "whole" }, once());
});

// How long what was armed may still be sent [s]; 0 where nothing is armed.
export const armedFor = () => (armed && !lapsed(known.summary, known.sequence) ? Math.ceil((armed.until - performance.now()) / 1000) : 0);

// What was armed is no longer what is shown, or may no longer be sent.
const lapsed = (summary, sequence) =>
  performance.now() > armed.until || summary.stop.latched || summary.gate.stopped || armed.digest !== sequence?.digest;

function notArmable() {
  if (!known.sequence) return "There is no sequence yet.";
  if (known.summary?.commands_carried_out) return complete();
  if (!known.sequence.valid) return "A rule does not hold: see the list.";
  if (known.summary?.stop.latched) return "A stop is in force: clear it first.";
  if (known.summary?.gate?.state === "sending") return "Commands are being sent already.";
  return kept() || unsure();
}

function draw({ summary, sequence }) {
  if (!summary) return;
  if (summary.undo) $("undo").title = `Undo: ${toldChoice(summary.undo)} (Ctrl+Z)`;
  if (summary.redo) $("redo").title = `Redo: ${toldChoice(summary.redo)} (Ctrl+Y)`;
  if (armed && lapsed(summary, sequence)) armed = null;
  const sending = summary.gate?.state === "sending";
  const lost = alive() ? "" : `${age(silent())} ago`;
  $("make-sequence").textContent = summary.to_command ? `Make sequence: ${summary.to_command.text}` : "Make sequence";
  $("arm-state").dataset.state = armed || (sending && (summary.gate.waiting || lost)) ? "warn" : sending ? "busy" : "none";
  $("arm-state").textContent = armed
    ? `armed for ${armedFor()} s more`
    : sending ? `${lost && `${lost}: `}${summary.gate.waiting ? "waits before" : "sending"} row ${(summary.gate.row ?? 0) + 1} of ${summary.run?.rows.length ?? "–"}`
      : sequence && notNow(summary) ? `not armed. ${notNow(summary)}` : "not armed"; // what passes is said in sight: no hand has to point at the button
  drawWay(summary, sequence);
  drawTable(summary, sequence);
}

// Every row was done.
const complete = () => `Sequence complete (${known.sequence.commands.length} of ${known.sequence.commands.length}): make new commands.`;

const notNow = (summary) => (summary.commands_carried_out ? complete() : unsure());

// How the next commands will take the rover, before they are made; and how those that are there do.
function drawWay({ way_of_commands: way }, sequence) {
  const rigid = way.mode === "rigid";
  $("way-text").textContent = $("as-commanded").checked && !rigid ? "as commanded: the rover sags; touch-down is not predicted"
    : rigid ? `as commanded: ${way.reason}` : `${titleOf(sagSettings().mode)}: the rover's sag is predicted`;
  $("sequence-way").hidden = !sequence?.way;
  if (sequence?.way) Object.assign($("sequence-way"), { textContent: sequence.way.text, className: sequence.way.doubt ? "doubt" : "hint" });
}

function drawTable(summary, sequence) {
  const states = rowStates(summary, sequence);
  const key = JSON.stringify([sequence?.digest, chosenRow(), [...states.values()]]);
  const focused = $("commands").contains(document.activeElement) ? document.activeElement : null;
  $("sequence-other").hidden = !sequence || !summary.commands_of_another_plan;
  $("sequence-start").hidden = sequence?.starts_from !== "rover";
  if (key === drawn) return;
  $("commands").hidden = !sequence;
  const broken = sequence?.rules.filter((rule) => !rule.holds) ?? [];
  $("sequence-text").className = !sequence ? "" : sequence.valid ? "yes" : "no";
  $("sequence-text").textContent = !sequence ? "No sequence yet." : `${sequence.commands.length} commands, ${fixed(sequence.duration, 1)} s. `
    + (sequence.valid ? "Every rule holds." : broken.map(ruleTold).join("; "));
  if (focused?.matches("input")) return; // the rows stay under the hands of somebody who types
  drawn = key;
  if (!sequence) return;
  $("commands").tBodies[0].replaceChildren(...sequence.commands.flatMap((command, row) => [groupRow(sequence, row), tableRow(command, row, broken, states.get(row), toldTether(sequence, row))]).filter(Boolean));
  if (focused) [...$("commands").querySelectorAll("button")].find((one) => one.ariaLabel === focused.ariaLabel)?.focus();
  follow();
}

let followed = null; // the row that was brought into sight last: who scrolls away meanwhile is left alone

// The row that is carried out stays in sight.
function follow() {
  const row = $("commands").querySelector("tr.current");
  const label = row?.querySelector("button").ariaLabel ?? null;
  if (label !== followed) row?.scrollIntoView({ block: "nearest" });
  followed = label;
}

// The rows of a walk are told by their foot moves.
function groupRow({ foot_moves: moves, commands }, row) {
  const first = moves?.find((one) => one.first_row === row);
  return first && element("tr", { className: "group" }, element("th", { colSpan: 8, scope: "rowgroup", textContent: `${first.text} (rows ${row + 1}–${Math.min(commands.length, row + first.rows)})${toldRest(first.rest)}` }));
}

const toldRest = (rest) => (rest
  ? `; predicted: torque ${fixed(100 * rest.torque, 0)} % at most (${rest.joint}), then ${fixed(Math.abs(1000 * rest.sag), 0)} mm ${rest.sag < 0 ? "higher" : "lower"} than planned`
  : "");

// To which length the tether is to be paid out or hauled in meanwhile; nothing where it keeps its length.
function toldTether({ tether_lengths: lengths }, row) {
  if (!lengths || fixed(lengths[row]) === fixed(lengths[row + 1])) return "";
  return `, tether to ${fixed(lengths[row + 1])} m`;
}

function tableRow(command, row, broken, state, tether) {
  const mine = broken.filter((rule) => rule.row === row);
  const duration = element("input", {
    type: "number", min: "0", step: "any", value: command.duration.toFixed(3), ariaLabel: `Seconds of row ${row + 1}`,
    onchange: (event) => {
      const seconds = Number(event.target.value);
      event.target.blur();
      drawn = "";
      edit({ kind: "duration", row, number: seconds });
    },
  });
  return element("tr", { className: mine.length ? "failing" : state?.state === "started" ? "current" : "" },
    element("td", {}, element("button", {
      type: "button", textContent: row + 1, ariaLabel: `Row ${row + 1}`, ariaPressed: String(row === chosenRow()),
      onclick: () => choose(row === chosenRow() ? null : row),
    })),
    element("td", { textContent: (command.force === null ? command.name : `${command.name} until ${command.force} N more`) + tether }),
    element("td", { textContent: command.leg ?? (command.joints ? "all" : "–") }),
    element("td", { textContent: command.phase || "–" }),
    element("td", {}, duration),
    element("td", { className: mine.length ? "no" : "sign", textContent: mine.length ? mine.map((rule) => rule.text).join(" ") : "✓" }),
    element("td", { textContent: state?.text ?? "–", title: state?.times ?? "" }),
    element("td", {}, element("button", {
      type: "button", textContent: "✕", ariaLabel: `Delete row ${row + 1}`, onclick: () => edit({ kind: "delete", row }),
    })));
}
