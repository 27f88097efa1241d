// Commands: the sequence as an editable table, export, and sending through the command gate, whole or step by step.

import { ROOT, once, post, request } from "../api.js";
import { choices } from "../choices.js";
import { act } from "../acts.js";
import { $, asTyped, attempt, element, fixed } from "../dom.js";
import { editTyped, isOnItsWay, redo, undo } from "../edits.js";
import { answered, awaited } from "../planning.js";
import { remember, rememberInSession } from "../remembered.js";
import { isAthletes } from "../robot.js";
import { alive, changed, known, silent, subscribe } from "../store.js";
import * as texts from "../texts/commands.js";
import * as shared from "../texts/shared.js";
import { kept, unsure } from "./conn.js";
import { sagSettings, titleOf } from "./execution.js";
import { choose, chosenRow, deleteRow, onChoice, waitFirst } from "./row.js";
import { rowStates } from "./run.js";

let armed = null; // {token, digest, until}
let drawn = "";
let listed; // digest of the sequence whose rows stand there

export function start() {
  act({ text: texts.insertWait, button: "insert-wait", run: waitFirst, refusal: () => (known.sequence ? "" : shared.noSequence) });
  act({ text: texts.arm, button: "arm", run: arm, refusal: notArmable });
  act({ text: shared.send, button: "send", run: send, refusal: () => (armedFor() ? unsure() : texts.armFirst) });
  act({ key: "S", text: texts.make, button: "make-sequence", run: make, refusal: () => (awaited() || known.summary?.to_command ? "" : notPlanned()) });
  act({ key: "E", text: texts.exportSequence, button: "export", run: exportSequence, refusal: () => (!known.sequence ? shared.noSequence : known.sequence.valid ? "" : texts.ruleBroken) });
  act({ text: texts.importCommands, button: "import", run: () => $("import-file").click(), refusal: notImportable });
  $("import-file").addEventListener("change", importFile);
  act({ key: "Ctrl+Z", text: texts.undo, button: "undo", run: undo, refusal: () => (known.summary?.undo || known.summary?.hand?.moved ? "" : texts.nothingToUndo) });
  act({ key: "Ctrl+Y", text: texts.redo, button: "redo", run: redo, refusal: () => (known.summary?.redo ? "" : texts.nothingToRedo) });
  attempt(offerFormats);
  onChoice(() => draw(known));
  remember("by-steps");
  rememberInSession("as-commanded");
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
  if (fresh && plan.status !== "found") throw new Error(texts.noPlanFound(plan.reason));
  if (!meant) throw new Error(texts.nothingMade(notPlanned()));
  const way = isAthletes() ? (meant.step ? wayOfStep() : wayOfMove()) : {};
  await post("/sessions/current/sequences", { plan: meant.plan, ...way }, once());
});

const commandedAs = (mode) => ($("as-commanded").checked ? { as_commanded: true } : { settings: sagSettings(mode) });

const wayOfStep = () => commandedAs(null);

// How a move of the chassis is commanded: with the pose held where sag is known, unless an expert takes it as commanded.
export const wayOfMove = () => commandedAs("pose_held");

const notPlanned = () => (known.summary?.plan.status === "found"
  ? texts.carriedOut
  : texts.noPlanToCommand);
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
  if (!known.summary?.dem) return texts.noTerrainToCheck;
  return known.summary.state ? "" : texts.stanceUnknown;
}

const importFile = () => attempt(async () => {
  const file = $("import-file").files[0];
  if (!file) return;
  const form = new FormData();
  form.append("file", file);
  try {
    await post(`/sessions/current/sequences/import?as_commanded=${$("as-commanded").checked}`, form, once());
  } finally {
    $("import-file").value = ""; // the same file, mended, is a change again
  }
});

const arm = () => attempt(async () => {
  const asked = performance.now(); // what it took the answer to arrive is over by now
  const answer = await post(`/sequences/${known.sequence.digest}/arm`, {});
  armed = { token: answer.token, digest: answer.sequence, until: asked + 1000 * (answer.took + answer.expires_in) };
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
  if (!known.sequence) return shared.noSequence;
  if (known.summary?.commands_carried_out) return complete();
  if (!known.sequence.valid) return texts.ruleBroken;
  if (known.summary?.stop.latched) return shared.stopInForce;
  if (known.summary?.gate?.state === "sending") return shared.sendingAlready;
  if (known.summary && !known.summary.link.connected) return shared.noRover;
  return kept() || unsure();
}

function draw({ summary, sequence }) {
  if (!summary) return;
  if (summary.undo) $("undo").title = texts.undoing(texts.choiceTold(summary.undo));
  if (summary.redo) $("redo").title = texts.redoing(texts.choiceTold(summary.redo));
  if (armed && lapsed(summary, sequence)) armed = null;
  const sending = summary.gate?.state === "sending";
  const lost = alive() ? "" : texts.ago(silent());
  $("make-sequence").textContent = summary.to_command ? texts.makeCommandsOf(summary.to_command.text) : texts.makeCommands;
  $("arm-state").dataset.state = armed || (sending && (summary.gate.waiting || lost)) ? "warn" : sending ? "busy" : "none";
  $("arm-state").textContent = armed
    ? texts.armedFor(armedFor())
    : sending ? texts.atRow(lost && `${lost}: `, summary.gate.waiting ? texts.waitsBefore : texts.sending, (summary.gate.row ?? 0) + 1, summary.run?.rows.length ?? "–")
      : sequence && notNow(summary) ? texts.notArmedAs(notNow(summary)) : texts.notArmed; // what passes is said in sight: no hand has to point at the button
  drawWay(summary, sequence);
  if (sequence) drawFormats(sequence.export_formats);
  drawTable(summary, sequence);
}

// Every row was done.
const complete = () => texts.complete(known.sequence.commands.length);

const notNow = (summary) => (summary.commands_carried_out ? complete() : unsure());

// What can't carry these commands says why, and is not chosen.
function drawFormats(lacks) {
  const options = /** @type {HTMLOptionElement[]} */ ([...$("export-format").options]);
  for (const option of options) {
    const lack = lacks[option.value] ?? "";
    if (option.title !== lack) Object.assign(option, { disabled: Boolean(lack), title: lack });
  }
  const chosen = options.find((one) => one.selected);
  if (chosen?.disabled) $("export-format").value = options.find((one) => !one.disabled)?.value ?? "";
}

// How the next commands will take the rover, before they are made; and how those that are there do.
function drawWay({ way_of_commands: way }, sequence) {
  const rigid = way.mode === "rigid";
  $("way-text").textContent = $("as-commanded").checked && !rigid ? texts.asCommanded
    : rigid ? texts.asRigid(way.reason) : texts.sagPredicted(titleOf(sagSettings().mode));
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
  $("sequence-text").textContent = !sequence ? texts.noCommandsYet : texts.summary(sequence.commands.length, sequence.duration, sequence.valid ? texts.rulesHold : broken.map(texts.ruleTold).join("; "));
  if (focused?.matches("input") || isOnItsWay()) { // the rows stay under the hands of somebody who types
    if (sequence?.digest === listed) tellStates(states);
    return;
  }
  drawn = key;
  listed = sequence?.digest;
  if (!sequence) return;
  $("commands").tBodies[0].replaceChildren(...sequence.commands.flatMap((_, row) => [groupRow(sequence, row), tableRow(sequence, row, broken, states.get(row))]).filter(Boolean));
  if (focused) [...$("commands").querySelectorAll("button")].find((one) => one.ariaLabel === focused.ariaLabel)?.focus();
  follow();
}

// How far each row came, in the rows that stand there.
function tellStates(states) {
  for (const [row, one] of $("commands").querySelectorAll("tbody tr:not(.group)").entries()) {
    Object.assign(one.children[TOLD], told(states.get(row)));
    one.classList.toggle("current", isCurrent(states.get(row)) && !one.classList.contains("failing"));
  }
}

const TOLD = 6; // column
const told = (state) => ({ className: state ? "told" : "", textContent: state?.text ?? "–", title: state?.times ?? "" });
const isCurrent = (state) => state?.state === "started";

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
  return first && element("tr", { className: "group" }, element("th", { colSpan: 8, scope: "rowgroup", textContent: texts.group(first.text, row + 1, Math.min(commands.length, row + first.rows), first.rest ? texts.rest(first.rest) : "") }));
}

// To which length the tether is to be paid out or hauled in meanwhile; nothing where it keeps its length.
function toldTether({ tether_lengths: lengths }, row) {
  if (!lengths || fixed(lengths[row]) === fixed(lengths[row + 1])) return "";
  return texts.tetherTo(lengths[row + 1]);
}

// A long name may go on in a second line behind its underscore.
const breakable = (text) => text.split(/(?<=_)/).flatMap((part, i) => (i ? [element("wbr"), part] : [part]));

function tableRow(sequence, row, broken, state) {
  const [command, tether, leg] = [sequence.commands[row], toldTether(sequence, row), sequence.legs[row]];
  const mine = broken.filter((rule) => rule.row === row);
  const duration = element("input", {
    type: "number", min: "0", step: "any", value: asTyped(command.duration), ariaLabel: texts.secondsOf(row + 1),
    onchange: ({ target }) => {
      target.blur();
      drawn = "";
      editTyped(target, asTyped(command.duration), (number) => ({ kind: "duration", row, number }), sequence.digest);
    },
  });
  return element("tr", { className: mine.length ? "failing" : isCurrent(state) ? "current" : "" },
    element("td", {}, element("button", {
      type: "button", textContent: row + 1, ariaLabel: shared.rowFirst(row + 1), ariaPressed: String(row === chosenRow()),
      onclick: () => choose(row === chosenRow() ? null : row),
    })),
    element("td", {}, ...breakable((command.force === null ? command.name : texts.until(command.name, command.force)) + tether)),
    element("td", { textContent: leg ?? (command.joints ? texts.all : "–"), title: command.leg === null && leg !== null ? texts.stepsOf(leg) : "" }),
    element("td", { textContent: command.phase || "–" }),
    element("td", {}, duration),
    element("td", { className: mine.length ? "no" : "sign", textContent: mine.length ? mine.map((rule) => rule.text).join(" ") : "✓" }),
    element("td", told(state)),
    element("td", {}, element("button", {
      type: "button", textContent: "✕", ariaLabel: texts.deleteRow(row + 1), onclick: () => deleteRow(row, sequence.digest),
    })));
}
