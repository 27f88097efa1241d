// Loop: the rover walks to the goal by itself, over ground that it looks at on the way. Begun, watched, held and ended here;
// each decision with its time and reason.

import { act } from "../acts.js";
import { once, post } from "../api.js";
import { settled } from "../choosing.js";
import { $, attempt, element } from "../dom.js";
import { events, subscribeToEvents, when } from "../events.js";
import { keptOff } from "../footfallmoves.js";
import { reveal, unfold } from "../layout.js";
import { rememberInSession } from "../remembered.js";
import { known, subscribe } from "../store.js";
import { refresh } from "../stream.js";
import * as shared from "../texts/shared.js";
import * as texts from "../texts/walk.js";
import { kept, unsure } from "./conn.js";
import { goalTold, isFilledIn } from "./goal.js";
import { placesSaid } from "./places.js";
import { tether } from "./tether.js";
import { goalMeant, walkSettings } from "./walk.js";

const SHOWN = 8; // decisions
const LIMITS = ["foot_moves", "look_every", "least_margin", "most_torque", "most_anew"];
const CLASSES = { arrived: "yes", stopped: "no", cancelled: "" };

let opened = false; // whether the session was seen since the page was opened

export function start() {
  act({ text: texts.beginLoop, button: "loop-begin", held: true, run: begin, refusal: notBegun });
  const hold = { text: texts.holdLoop, run: () => steer("hold"), refusal: () => notSteered() || (loopNow().state === "held" ? texts.heldAlready : "") };
  const cancel = { text: texts.cancelLoop, run: () => steer("cancel"), refusal: notSteered };
  for (const [button, one] of Object.entries({ hold, cancel })) {
    act({ ...one, button: `loop-${button}` });
    act({ ...one, button: `next-loop-${button}`, quiet: true }); // in sight whichever panels are
  }
  act({ text: texts.resumeLoop, button: "loop-on", held: true, run: () => steer("resume"), refusal: () => notSteered() || (loopNow().state === "held" ? unsure() : texts.goesOnAlready) });
  rememberInSession(...[...LIMITS, "farthest", "route", "choose_by"].map((name) => `loop-${name}`));
  subscribeToEvents((fresh) => { if (fresh.some(isDecision)) drawDecisions(); });
  subscribe(draw);
}

const latest = () => known.summary?.walk_loop ?? null;

// The walk that the rover is on by itself, held or not; null where it is on none.
export const loopNow = () => (latest()?.state === "ended" ? null : latest());

const notSteered = () => (loopNow() ? kept() : texts.notByItself);

function notBegun() {
  if (loopNow()) return texts.byItselfAlready;
  if (!goalTold()) return texts.sayGoal;
  if (tether()) return texts.noTetherByItself;
  if (!known.summary?.link.connected) return shared.noRover;
  if (known.summary.stop.latched) return shared.stopInForce;
  if (known.summary.gate.state === "sending") return shared.sendingAlready;
  return kept() || unsure();
}

const begin = () => attempt(async () => {
  await settled();
  unfold("loop");
  if (!isFilledIn()) return;
  if (!$("loop-form").checkValidity()) reveal("loop");
  if (!$("loop-form").reportValidity()) return;
  const limits = Object.fromEntries(LIMITS.map((name) => [name, Number($(`loop-${name}`).value)]));
  const { seed, forbidden } = walkSettings(); // a pinned place is one of the walk that it was pinned in
  await post("/sessions/current/walk-loop", { goal: goalMeant(), limits, walk: { seed, forbidden }, farthest: Number($("loop-farthest").value), route: $("loop-route").checked ? { no_go: keptOff(placesSaid()) } : null, choose_by: $("loop-choose_by").value }, once());
  await refresh();
});

const steer = (what) => attempt(async () => {
  await post(`/sessions/current/walk-loop/${what}`, {});
  await refresh();
});

function draw({ summary, frame }) {
  const loop = latest();
  if (summary && !opened) openWith(loopNow());
  const [className, textContent] = loop ? loopTold(loop) : ["", ""];
  if ($("loop-now").textContent !== textContent) Object.assign($("loop-now"), { className, textContent });
  $("loop-part").textContent = loop ? underWay(loop) : "";
  $("loop-way").textContent = loop?.chosen ? texts.wayTold(loop.chosen) : "";
  $("loop-far").textContent = loop ? howFar(loop, frame?.T_site_base) : "";
}

// A page that finds the rover on its way shows that, with the limits that it walks by.
function openWith(loop) {
  opened = true;
  if (!loop) return;
  unfold("loop");
  for (const [name, value] of Object.entries({ ...loop.limits, farthest: loop.farthest, choose_by: loop.choose_by })) $(`loop-${name}`).value = value;
}

const underWay = ({ part, waits_for: waits }) => [part && `${part}.`, waits && texts.waitsFor(waits)].filter(Boolean).join(" ");

// What was decided last and why, or how it ended, as a class and in words.
export function loopTold({ state, outcome, act: what, reason }) {
  if (state === "ended") return endWords(outcome, reason);
  const decided = what ? texts.decision(what, reason) : texts.begins;
  return state === "held" ? ["doubt", texts.held(decided)] : ["", texts.decided(decided)];
}

const endWords = (outcome, reason) => [CLASSES[outcome] ?? "", texts.loopEnded(outcome, reason)];

function howFar({ goal, foot_moves: moves, decided }, T) {
  const left = T ? texts.farFrom(Math.hypot(goal.x - T[0][3], goal.y - T[1][3])) : texts.onTheWayTo;
  return texts.loopTold(left, goal, moves, decided.look ?? 0, decided.replan ?? 0);
}

const isDecision = ({ type }) => type === "walk_decided";

function drawDecisions() {
  const shown = events.filter(isDecision).slice(-SHOWN).reverse();
  $("loop-decisions").replaceChildren(...shown.map(({ time, payload }) => element("li", { textContent: `${when(time)} ${payload.act}: ${payload.reason}` })));
}

// How the latest walk by itself ended, as a class and in words, until something is sent or made of these kinds; else undefined.
export function endTold(kinds) {
  const last = events.findLast(({ type, payload }) => type === "walk_decided" || type === "run_started" || (type === "product" && kinds.includes(payload.kind)));
  if (last?.payload.act !== "end") return undefined;
  const [outcome, ...reason] = last.payload.reason.split(": ");
  return endWords(outcome, reason.join(": "));
}
