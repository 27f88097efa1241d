// What if the chassis stood elsewhere over the same feet: shown as the state that is planned from, and marked as such.

import { act } from "../acts.js";
import { askAgain, get, once, post, put, request } from "../api.js";
import { settled } from "../choosing.js";
import { $, asTyped, attempt, element } from "../dom.js";
import { reveal } from "../layout.js";
import { jobEnded } from "../planning.js";
import { notFor } from "../robot.js";
import { known, subscribe } from "../store.js";
import { refresh } from "../stream.js";
import { makeCommands } from "../texts/commands.js";
import * as texts from "../texts/plan.js";
import { add as queueIt } from "../texts/queue.js";
import * as shared from "../texts/shared.js";
import { wayOfMove } from "./commands.js";
import { computeMaps } from "./ground.js";
import { add, plannedAfter } from "./queue.js";

const { FIELDS, shiftTold } = texts;

let shownAnswer = ""; // "shift", "body_move", or "": what the answer that stands there is of
const answered = { shift: "", body_move: "", what_if: "" };
const ANSWERS = { shift: { folder: "shifts", told: (answer) => toldShift(answer) }, body_move: { folder: "body-moves", told: (answer) => toldMove(answer) } };

export function start() {
  $("what-if-fields").append(...FIELDS.map(([name, text]) =>
    element("label", { textContent: text }, element("input", { id: `shift-${name}`, type: "number", step: "any", value: "0" }))));
  $("what-if-form").addEventListener("submit", (event) => {
    event.preventDefault();
    show();
  });
  // once a what-if is shown, it follows the fields
  $("what-if-fields").addEventListener("change", () => { if (known.summary.what_if) show(); });
  act({ key: "W", text: texts.whatIf, run: toggle, refusal: () => notFor($("panel-what-if")) });
  act({
    key: "H", text: texts.findShift, button: "find-shift", run: find,
    refusal: () => (known.summary?.footfall ? "" : texts.chooseForShift),
  });
  act({ text: texts.checkMove, button: "plan-body-move", run: check });
  act({ text: shared.backToTheRover, button: "what-if-end", run: end, refusal: () => (known.summary?.what_if ? "" : texts.noWhatIf) });
  subscribe(draw);
}

function toggle() {
  $("panel-what-if").open = !$("panel-what-if").open;
  if ($("panel-what-if").open) reveal("footfall");
}

const shift = () => Object.fromEntries(FIELDS.map(([name, , unit]) => [name, Number($(`shift-${name}`).value) * unit]));

function write(wanted) {
  for (const [name, , unit] of FIELDS) $(`shift-${name}`).value = String(Number(asTyped(wanted[name] / unit, 4)));
}

async function show() {
  let answer;
  try {
    answer = await put("/sessions/current/what-if", shift());
  } catch (error) {
    say(error.message, "no");
    return;
  }
  say(texts.planningThere(Math.max(...answer.wheel_forces.map((force) => force[2]))), "doubt");
  await refresh();
  await computeMaps(); // the colours follow the chassis
}

const end = () => attempt(async () => {
  await request("DELETE", "/sessions/current/what-if");
  say("");
  await refresh();
  await computeMaps();
});

const find = () => attempt(async () => {
  await settled();
  const chosen = known.summary.footfall;
  $("panel-what-if").open = true;
  say(texts.lookingForShift);
  try {
    await ask("shift", { leg: chosen.leg, target: [chosen.x, chosen.y], ...reserve() });
  } catch (error) {
    if ($("what-if-answer").textContent === texts.lookingForShift) say("");
    throw error;
  }
});

const check = () => attempt(() => ask("body_move", { shift: shift(), after: plannedAfter(), ...reserve() }));

// Whoever asks again is shown the answer again, also where it is the one before.
async function ask(kind, order) {
  await jobEnded(await post(`/sessions/current/${ANSWERS[kind].folder}`, order));
  await refresh();
  if (shownAnswer !== kind) answered[kind] = "";
  draw(known);
}

// what is not kept is asked for as such
const reserve = () => ($("keep-reserve").checked ? {} : { settings: { reach_reserve: 0, joint_reserve: 0 } });

const queueMove = (digest) => attempt(() => add(digest));

// commands of a checked move of the chassis: they start from how the rover stands, not from the what-if
const make = (digest) => attempt(async () => {
  await post("/sessions/current/sequences", { plan: digest, ...wayOfMove() }, once());
  await refresh();
});

function say(text, className = "") {
  shownAnswer = "";
  $("what-if-answer").replaceChildren(element("p", { className, textContent: text }));
}

function draw({ summary }) {
  if (!summary) return;
  $("status-what-if-box").hidden = !summary.what_if;
  if (summary.what_if) {
    const { fits, reason } = summary.up_to_date.what_if;
    $("status-what-if").textContent = (summary.after ? texts.afterStep : texts.chassisAt(shiftTold(summary.what_if) || texts.unmoved))
      + (fits ? "" : texts.statusOutOfDate(reason));
  }
  const doubt = Object.keys(ANSWERS).filter((one) => one === shownAnswer && summary.up_to_date[one]?.fits === false).map((one) => summary.up_to_date[one].reason)[0];
  $("what-if-doubt").hidden = !doubt;
  $("what-if-doubt").textContent = doubt ? texts.askAgain(doubt) : "";
  const shown = summary.after ? "" : JSON.stringify(summary.what_if ?? "");
  if (shown !== answered.what_if) {
    answered.what_if = shown;
    // moved by hand, or on another page
    if (summary.what_if && shown && !$("what-if-fields").contains(document.activeElement)) write(summary.what_if);
  }
  for (const kind of Object.keys(ANSWERS)) if (summary[kind] && summary[kind] !== answered[kind]) read(kind, summary[kind]);
}

async function read(kind, digest) {
  answered[kind] = digest;
  try {
    const answer = await get(`/sessions/current/${ANSWERS[kind].folder}/${digest}`);
    if (answered[kind] === digest) showAnswer(kind, answer, ANSWERS[kind].told(answer));
  } catch {
    askAgain(() => { if (answered[kind] === digest) answered[kind] = ""; });
  }
}

function toldShift({ shift: found, reason }) {
  if (found) write(found);
  // where none keeps a reserve this one is checked without, and says so
  if (reason.startsWith("▲")) $("keep-reserve").checked = false;
  const moved = found ? shiftTold(found) : "";
  return moved ? texts.shiftFound(moved, reason) : reason;
}

const toldMove = ({ plan, shift: asked, reason }) => (plan ? texts.moveFound(shiftTold(asked) || texts.unmoved, plan.waypoints.length) : reason);

function showAnswer(kind, answer, text) {
  shownAnswer = kind;
  $("what-if-answer").replaceChildren(
    element("p", { className: answer.status === "found" ? "yes" : "no", textContent: text }),
    element("ul", {}, ...answer.checks.map((one) => element("li", {
      className: one.holds ? "yes" : "no",
      textContent: texts.checkTold(one),
    }))),
    ...(answer.plan ? [element("button", { id: "make-body-move", type: "button", textContent: makeCommands, onclick: () => make(answer.digest) }),
      element("button", { id: "queue-body-move", type: "button", textContent: queueIt, onclick: () => queueMove(answer.digest) })] : []),
  );
}
