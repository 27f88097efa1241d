// Commands: the sequence as an editable table, export, and sending through the command gate.

import { ROOT, once, post, request } from "../api.js";
import { $, attempt, element } from "../dom.js";
import { bind } from "../keys.js";
import { refresh } from "../stream.js";
import { known, subscribe } from "../store.js";

let armed = null; // {token, digest, until}
let drawn = "";

export function start() {
  $("make-sequence").addEventListener("click", make);
  $("undo").addEventListener("click", undo);
  $("insert-wait").addEventListener("click", () => edit({ kind: "insert", row: 0, command: { name: "WAIT", duration: 1.0 } }));
  $("export").addEventListener("click", exportSequence);
  $("arm").addEventListener("click", arm);
  $("send").addEventListener("click", send);
  bind("S", "Make the command sequence", make);
  bind("E", "Export the sequence", exportSequence);
  bind("Ctrl+Z", "Undo the last edit", undo);
  subscribe(draw);
}

const make = () => attempt(() => post("/sessions/current/sequences", {}, once()));
const undo = () => attempt(async () => {
  await request("POST", `/sequences/${known.sequence.digest}/undo`, {}, { "If-Match": known.sequence.etag });
  await refresh();
});

const edit = (change) => attempt(async () => {
  await request("PATCH", `/sequences/${known.sequence.digest}`, { edit: change }, { "If-Match": known.sequence.etag });
  await refresh();
});

const exportSequence = () => attempt(async () => {
  const format = $("export-format").value;
  const path = `${ROOT}/sequences/${known.sequence.digest}/export?format=${format}`;
  const { response } = await request("GET", path); // a refusal is told here, before the browser saves anything
  const name = /filename="([^"]+)"/.exec(response.headers.get("Content-Disposition") ?? "")?.[1] ?? `sequence.${format}`;
  const link = element("a", { href: path, download: name });
  document.body.append(link);
  link.click();
  link.remove();
});

const arm = () => attempt(async () => {
  const asked = performance.now(); // the server counts from before its answer arrives
  const answer = await post(`/sequences/${known.sequence.digest}/arm`, {});
  armed = { token: answer.token, digest: answer.sequence, until: asked + answer.expires_in * 1000 };
  draw(known);
});

const send = () => attempt(async () => {
  if (!armed) return; // a second click
  const { token, digest } = armed;
  armed = null;
  draw(known);
  await post(`/sequences/${digest}/send`, { arming: token }, once());
});

// What was armed is no longer what is shown, or may no longer be sent.
const lapsed = (summary, sequence) =>
  performance.now() > armed.until || summary.stop.latched || summary.gate.stopped || armed.digest !== sequence?.digest;

function draw({ summary, sequence }) {
  if (!summary) return;
  const there = Boolean(sequence);
  $("make-sequence").disabled = summary.plan.status !== "found";
  $("undo").disabled = !there || !summary.can_undo;
  $("insert-wait").disabled = !there;
  $("export").disabled = !there || !sequence.valid;
  if (armed && lapsed(summary, sequence)) armed = null;
  $("arm").disabled = !there || !sequence.valid || summary.gate?.state === "sending";
  $("send").disabled = !armed;
  $("arm-state").textContent = armed
    ? `armed for ${Math.ceil((armed.until - performance.now()) / 1000)} s more`
    : summary.gate?.state === "sending" ? `sending row ${(summary.gate.row ?? 0) + 1}` : "not armed";
  drawTable(summary, sequence);
}

function drawTable(summary, sequence) {
  const states = new Map(summary.commands.filter((one) => one.sequence === sequence?.digest).map((one) => [one.row, one]));
  const key = JSON.stringify([sequence?.digest, [...states.values()]]);
  if (key === drawn || $("commands").contains(document.activeElement)) return;
  drawn = key;
  $("commands").hidden = !sequence;
  if (!sequence) {
    $("sequence-text").textContent = "No sequence yet.";
    return;
  }
  const broken = sequence.rules.filter((rule) => !rule.holds);
  $("sequence-text").className = sequence.valid ? "yes" : "no";
  $("sequence-text").textContent = `${sequence.commands.length} commands, ${sequence.duration.toFixed(1)} s. `
    + (sequence.valid ? "Every rule holds." : broken.map((rule) => rule.text).join(" "));
  $("commands").tBodies[0].replaceChildren(...sequence.commands.map((command, row) => tableRow(command, row, broken, states.get(row))));
}

function tableRow(command, row, broken, state) {
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
    element("td", { textContent: row + 1 }),
    element("td", { textContent: command.name }),
    element("td", { textContent: command.leg === null ? "–" : command.leg }),
    element("td", { textContent: command.phase || "–" }),
    element("td", {}, duration),
    element("td", { className: mine.length ? "no" : "yes", textContent: mine.map((rule) => rule.text).join(" ") }),
    element("td", { textContent: state ? `${state.state}${state.reason ? `: ${state.reason}` : ""}` : "–" }),
    element("td", {}, element("button", {
      type: "button", textContent: "✕", ariaLabel: `Delete row ${row + 1}`, onclick: () => { drawn = ""; edit({ kind: "delete", row }); },
    })));
}
