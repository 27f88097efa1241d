// Foot moves of a walk along its moments: where each ends, and which one is under way. A moment is 0…1 of the way, as in pace.js.

import { travelOf } from "./pace.js";
import * as texts from "./texts/walk.js";

const NEAR = 1e-6; // of a moment: as exact as the server tells one

const made = new WeakMap(); // plan → its moments

// moments: of the waypoints. ends: where each foot move ends, and last the walk, after the chassis' way to the goal.
export function along(plan) {
  if (!made.has(plan)) made.set(plan, measured(plan));
  return made.get(plan);
}

function measured({ waypoints, moves, legs }) {
  const sums = travelOf(waypoints).reduce((before, one) => [...before, before.at(-1) + one], [0]);
  const whole = sums.at(-1) || 1;
  const moments = sums.map((one) => one / whole);
  const ends = legs.map((_, number) => moments[moves.lastIndexOf(number)]);
  return { moments, ends: ends.at(-1) < 1 - NEAR ? [...ends, 1] : ends };
}

// The waypoint that is gone to at a moment; at one of them, that one.
export function waypointAt(plan, moment) {
  const { moments } = along(plan);
  const at = moments.findIndex((one, i) => i > 0 && one >= moment - NEAR);
  return at < 0 ? moments.length - 1 : at;
}

// A waypoint's foot move, in words.
export function footMoveTold(plan, waypoint) {
  const number = plan.moves[waypoint];
  const leg = plan.legs[number];
  return leg === undefined ? texts.chassisToItsGoal : texts.ofWalk(number + 1, plan.legs.length, leg);
}

// The moment where the foot move before, or the one after, ends; before the first is the start.
export function endBeside(plan, moment, by) {
  const stops = [0, ...along(plan).ends];
  return by > 0 ? stops.find((one) => one > moment + NEAR) ?? 1 : stops.findLast((one) => one < moment - NEAR) ?? 0;
}

// Where the walk is worst: least margin, largest torque.
export function worstOf({ margins, torques }) {
  const margin = margins.indexOf(Math.min(...margins));
  const torque = torques.indexOf(Math.max(...torques));
  return {
    margin: { waypoint: margin, text: texts.leastMargin(margins[margin]) },
    torque: { waypoint: torque, text: texts.mostTorque(torques[torque]) },
  };
}
