// How moments of what the ghost plays lie in its rows and seconds. A moment is 0…1 of the way, by the joint that travels most.

import { known } from "./store.js";

const travels = new WeakMap(); // waypoints → what they come to: a walk has hundreds, and is read at every message

export function travelOf(waypoints) {
  if (!travels.has(waypoints)) travels.set(waypoints, waypoints.slice(1).map((row, i) => Math.max(...row.map((q, j) => Math.abs(q - waypoints[i][j])))));
  return travels.get(waypoints);
}

const summed = (steps) => steps.reduce((sums, one) => [...sums, sums.at(-1) + one], [0]);

// The walk, or the part of it that was found, where that is what the scene plays.
export function walkPlayed() {
  const { summary, walk } = known;
  return walk && walk.digest === summary?.played ? walk.plan ?? walk.partial : null;
}

// What the scene plays: the waypoints, and what each leads through.
export function played() {
  const { summary, plan, sequence } = known;
  const walk = walkPlayed();
  if (walk) return { what: "walk", ...walk };
  if (sequence && sequence.digest === summary?.played) {
    const names = sequence.commands.map((command) => command.phase || command.name);
    return { what: "commands", waypoints: [sequence.start, ...sequence.predicted], phases: ["", ...names] };
  }
  return plan?.plan ? { what: "plan", ...plan.plan } : null;
}

// Moments and seconds at which its rows end, each from 0; null without commands for what is played.
export function pace() {
  const { summary, sequence } = known;
  const way = played();
  if (!way || !sequence || (sequence.digest !== summary.played && summary.commands_of_another_plan)) return null;
  const along = summed(travelOf([sequence.start, ...sequence.predicted]));
  const whole = summed(travelOf(way.waypoints)).at(-1);
  if (!(whole > 0) || Math.abs(along.at(-1) - whole) > 1e-6) return null; // commands of another way
  const seconds = summed(sequence.commands.map((command) => command.duration));
  return { moments: along.map((one) => one / whole), seconds, names: sequence.commands.map((command) => command.phase || command.name) };
}

function between(from, to, here) {
  const last = from.length - 1;
  const i = Math.min(last - 1, Math.max(0, from.findIndex((one) => one >= here) - 1));
  const own = from[i + 1] - from[i];
  const share = own > 0 ? Math.min(1, Math.max(0, (here - from[i]) / own)) : 1;
  return to[i] + share * (to[i + 1] - to[i]);
}

export const momentAt = ({ moments, seconds }, time) => (time >= seconds.at(-1) ? 1 : between(seconds, moments, time));
export const timeAt = ({ moments, seconds }, moment) => (moment >= 1 ? seconds.at(-1) : between(moments, seconds, moment));

// The row (from 0) under way at a time: one that ends there is the one that ends.
export const rowAt = ({ seconds }, time) => Math.max(0, Math.min(seconds.length - 2, seconds.findIndex((one) => one >= time - 1e-6) - 1));
