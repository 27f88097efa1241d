// By how much the wheel in the air clears the ground: commanded, predicted, and as it is measured, side by side.

import { get } from "../api.js";
import { $, element, fixed } from "../dom.js";
import { isAthletes } from "../robot.js";
import { STALE_AFTER, known, subscribe, telemetryAge } from "../store.js";
import * as texts from "../texts/sag.js";

const PERIOD = 500; // ms between two questions
const SHARE = 0.01; // of the weight: a wheel that bears less is in the air

let answer = null; // what the server said last
let about = ""; // the session and the frame that it is about
let asking = false;
let askedAt = -Infinity;
let answeredAt = -Infinity;

export function start() {
  if (isAthletes()) subscribe(draw);
}

function draw({ summary, frame }) {
  if (!summary) return;
  const why = doubt(summary, frame);
  if (why || performance.now() - answeredAt > 1000 * STALE_AFTER) answer = null; // of an earlier moment
  if (!why) look(summary, frame);
  show(why || !answer ? [] : answer.wheels, why || (answer?.reason ?? ""));
}

// Why nothing can be said of now, or "".
function doubt(summary, frame) {
  if (!frame) return texts.noTelemetry;
  const old = telemetryAge(frame);
  if (old > STALE_AFTER) return texts.stale;
  return aloft(summary, frame) ? "" : texts.noneAloft;
}

// Whether it is worth asking. A rover that reports no forces may have a leg in the air whenever it is sent commands.
function aloft(summary, { wheel_forces: forces }) {
  const weight = forces.reduce((sum, force) => sum + force[2], 0);
  return weight > 0 ? forces.some((force) => force[2] <= SHARE * weight) : summary.gate.state === "sending";
}

function look(summary, frame) {
  const now = `${summary.id} ${frame.number}`;
  if (asking || document.hidden || now === about || performance.now() - askedAt < PERIOD) return;
  [asking, askedAt, about] = [true, performance.now(), now];
  get("/sessions/current/clearance")
    .then((found) => { [answer, answeredAt] = [found, performance.now()]; })
    .catch(() => { answer = null; about = ""; }) // unknown is shown, and it is asked again
    .finally(() => { asking = false; draw(known); });
}

function show(wheels, note) {
  const rows = wheels.length ? wheels.map(row) : [["–", "–", "–", "–"].map((text) => element("td", { textContent: text }))];
  $("clearances").tBodies[0].replaceChildren(...rows.map((cells) => element("tr", {}, ...cells)));
  const told = note || wheels.map(toldOf).filter(Boolean).join(" ");
  if ($("clearances-note").textContent !== told) $("clearances-note").textContent = told; // read aloud once
}

/** The cells of a wheel's row: how much it clears the ground by, commanded, predicted and measured. */
export function row({ leg, commanded, predicted, less, rigid, measured, low }) {
  const softer = rigid ? texts.asRigid : less === null ? "" : texts.ifSofter(less);
  return [
    element("td", { textContent: leg }),
    element("td", { textContent: fixed(commanded) }),
    element("td", { textContent: `${fixed(predicted)}${predicted === null ? "" : softer}` }),
    element("td", { className: low ? "doubt" : "", textContent: measured ? texts.clearance(measured.clearance, measured.uncertainty, lacking(measured).length > 0) : "–" }),
  ];
}

// What nothing tells the uncertainty of.
const lacking = ({ pose, ground }) => [pose === null && texts.pose, ground === null && texts.map].filter(Boolean);

// What there is to say of a wheel beside its numbers: that it is too low, and what is not in the uncertainty.
function toldOf({ leg, measured, low }) {
  if (!measured) return texts.groundUnknown(leg);
  const missing = lacking(measured);
  return [
    low ? texts.tooLow(leg) : "",
    measured.whole ? "" : texts.groundPartlyUnknown(leg),
    missing.length ? texts.leftOut(missing) : "",
  ].filter(Boolean).join(" ");
}
