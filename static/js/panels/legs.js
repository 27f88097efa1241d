// Legs: which stand, what each bears, how near its worst joint is to its torque limit, and how far it is from the footfall.

import { element, fixed, $ } from "../dom.js";
import { percent } from "../figures.js";
import { isShown } from "../layout.js";
import { jointsOf, slides } from "../robot.js";
import { STALE_AFTER, known, subscribe, telemetryAge } from "../store.js";
import * as shared from "../texts/shared.js";
import * as texts from "../texts/telemetry.js";

const MOVES = 0.002; // rad or m between two frames; more is no noise of a sensor
const HIGH = 0.8; // share of a torque limit from which on it is marked

let before = null; // the frame before the shown one
let shown = null;

export function start() {
  subscribe(draw);
}

function draw({ frame, summary, robot }) {
  if (!isShown("legs")) return;
  $("legs-table").hidden = !frame;
  if (!frame) {
    $("legs-note").textContent = shared.noTelemetry;
    return;
  }
  const stale = telemetryAge(frame) > STALE_AFTER;
  $("legs-note").textContent = stale ? texts.stale : "";
  $("legs-note").className = stale ? "doubt" : "";
  $("legs-table").classList.toggle("stale", stale);
  if (frame === shown) return;
  before = shown ?? frame;
  shown = frame;
  const up = frame.wheel_forces.map((force) => force[2]);
  const weight = up.reduce((sum, one) => sum + one, 0);
  const most = Math.max(weight / 2, ...up, 1);
  $("legs-table").tBodies[0].replaceChildren(...robot.legs.map((leg) => row(leg, up[leg], weight, most, frame, summary)));
}

function row(leg, force, weight, most, frame, summary) {
  const share = weight > 0 ? force / weight : null; // what reports no forces says of no leg whether it stands
  const worst = worstTorque(leg, frame);
  const chosen = summary?.view.leg === leg;
  const state = stateOf(leg, share, frame);
  return element("tr", { className: chosen ? "current" : "" },
    element("th", { scope: "row", textContent: `${chosen ? "▸ " : ""}${leg}`, title: known.robot.leg_names[leg] }),
    element("td", { textContent: state }),
    element("td", {}, bar(force / most), number(fixed(force, 0), 4), number(share === null ? "–" : percent(share), 5)),
    element("td", { className: worst.share >= 1 ? "no" : worst.share >= HIGH ? "doubt" : "" },
      bar(worst.share, worst.share >= 1 ? "bad" : worst.share >= HIGH ? "warn" : "good"),
      number(worst.limit === null ? "–" : percent(worst.share), 5),
      element("span", { textContent: ` ${worst.joint}`, title: texts.torqueOf(worst.torque, worst.limit, worst.slides) })),
    element("td", { textContent: toFootfall(leg, frame, summary), title: leg in known.robot.leg_lengths ? texts.fromHip(known.robot.leg_lengths[leg]) : "" }));
}

function stateOf(leg, share, frame) {
  const turned = jointsOf(leg).map((joint) => Math.abs(frame.posture[joint] - before.posture[joint]));
  const moves = Math.max(...turned) > MOVES;
  const stands = share === null ? texts.noForces : share < known.robot.least_load ? texts.inAir : texts.stands;
  return stands + (moves ? texts.moves : "");
}

// Where nobody says a joint's limit (null), it has no share of one.
function worstTorque(leg, frame) {
  const { torque_limits: limits, joint_names: names } = known.robot;
  const torqueOf = (joint) => Math.abs(frame.joint_torques[joint]);
  const shareOf = (joint) => (limits[joint] === null ? 0 : torqueOf(joint) / limits[joint]);
  const worst = jointsOf(leg).reduce((a, b) => (shareOf(b) > shareOf(a) ? b : a));
  return { share: shareOf(worst), torque: torqueOf(worst), limit: limits[worst], joint: shortName(names[worst]), slides: slides(worst) };
}

// "leg2_hip_yaw" says its leg again
export const shortName = (name) => name.replace(/^leg\d+_|_joint$/g, "").replaceAll("_", " ");

function toFootfall(leg, { T_site_base: T }, summary) {
  const answer = summary?.footfall_answer;
  if (!answer || typeof answer.z !== "number") return "–";
  const { T_base_hips: hips, leg_lengths: lengths } = known.robot;
  if (!(leg in hips)) return "–"; // where the legs of a robot that others described begin is said nowhere
  const hip = [0, 1, 2].map((i) => T[i][3] + [0, 1, 2].reduce((sum, j) => sum + T[i][j] * hips[leg][j][3], 0));
  const away = Math.hypot(hip[0] - answer.x, hip[1] - answer.y, hip[2] - answer.z);
  return texts.away(away, away <= lengths[leg]);
}

// As wide whatever it is: what stands beside it must not move.
function number(text, digits) {
  const made = element("span", { className: "num", textContent: text });
  made.style.minWidth = `${digits}ch`;
  return made;
}

function bar(share, state = "") {
  const fill = element("i");
  fill.style.width = `${100 * Math.min(1, Math.max(0, share))}%`;
  const made = element("span", { className: "bar", ariaHidden: "true" }, fill);
  if (state) made.dataset.level = state;
  return made;
}
