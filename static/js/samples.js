// What the rover said in the last ten minutes, number by number, in rings of fixed size.

import { STALE_AFTER, subscribe } from "./store.js";
import * as shared from "./texts/shared.js";
import * as texts from "./texts/telemetry.js";

export const KEPT = 600; // s
const CAPACITY = 6200; // ten a second
const DEGREES = 180 / Math.PI;

// By which a number of the server's, in SI units, is multiplied to be in a unit.
export const scaleOf = (unit) => texts.UNITS[unit].scale;

let slides = []; // of each joint whether it slides
let channels = []; // { id, quantity, leg, nth of its quantity, name, unit, low, high } each; low and high are null where nothing limits them
let times = new Float64Array(0);
let numbers = []; // one ring for each channel
let count = 0; // ever taken
let last = null;

export function startSamples(robot) {
  const joints = robot.leg_joints.flatMap((own, leg) => own.map((i) => ({ i, leg, name: robot.joint_names[i] })));
  slides = robot.joint_units.map((unit) => unit === "m");
  const limited = (quantity, low, high) => joints.map((one) => ({ ...one, quantity, low: low(one.i), high: high(one.i) }));
  channels = [
    ...limited("torque", (i) => scaled(robot.torque_limits[i], -1), (i) => robot.torque_limits[i]),
    ...limited("position", (i) => asRead(robot.lower[i], i), (i) => asRead(robot.upper[i], i)),
    ...limited("error", () => null, () => null),
    ...robot.legs.map((leg) => free("force", shared.leg(leg))),
    ...robot.legs.map((leg) => ({ ...free("share", shared.leg(leg)), low: robot.least_load * 100 })),
    ...texts.PLACE.map((name) => free("place", name)),
    ...texts.LEAN.map((name) => free("lean", name)),
    free("tilt", texts.TILT),
    { ...free("interval", texts.INTERVAL), high: STALE_AFTER },
  ].map((channel, at, all) => {
    const nth = at - all.findIndex(({ quantity }) => quantity === channel.quantity);
    return { ...channel, at, nth, id: `${channel.quantity}.${nth}`, unit: unitOf(channel) };
  });
  times = new Float64Array(CAPACITY);
  numbers = channels.map(() => new Float32Array(CAPACITY));
  subscribe(({ frame }) => { if (frame && isNew(frame)) take(frame); });
}

// A joint that slides moves by metres, under a force.
const unitOf = ({ quantity, i }) => {
  const { unit, sliding } = texts.QUANTITIES[quantity];
  return sliding && slides[i] ? sliding : unit;
};

// A limit that nobody says (null) stays one.
const scaled = (limit, by) => (limit === null ? null : limit * by);
const asRead = (q, i) => scaled(q, slides[i] ? 1 : DEGREES);

const free = (quantity, name) => ({ quantity, leg: null, name, low: null, high: null });

// A line that was cut begins with what this page may have heard already.
const isNew = ({ number, time }) => number !== last?.number || time !== last.time;

function take(frame) {
  last = frame;
  const slot = count % CAPACITY;
  times[slot] = Date.now() / 1000 - (frame.age_s ?? 0); // when it was so, by this page's clock
  const interval = count > 0 ? times[slot] - times[(count - 1) % CAPACITY] : NaN;
  [...rowOf(frame), interval].forEach((number, i) => { numbers[i][slot] = number; });
  count += 1;
}

function rowOf({ posture, commanded, joint_torques: torques, wheel_forces: forces, T_site_base: T }) {
  const lean = [Math.atan2(T[2][1], T[2][2]), Math.asin(Math.max(-1, Math.min(1, -T[2][0]))), Math.atan2(T[1][0], T[0][0])];
  return [
    ...torques, ...posture.map(asRead), ...posture.map((q, i) => asRead(commanded[i] - q, i)),
    ...forces.map((force) => force[2]), ...sharesOf(forces), T[0][3], T[1][3], T[2][3], ...lean.map((angle) => angle * DEGREES),
    Math.acos(Math.max(-1, Math.min(1, T[2][2]))) * DEGREES,
  ];
}

function sharesOf(forces) {
  const weight = forces.reduce((sum, force) => sum + force[2], 0);
  return forces.map((force) => (weight > 0 ? (100 * force[2]) / weight : 0));
}

export const allChannels = () => channels;

export const channelsOf = (quantity, leg) => channels.filter((one) => one.quantity === quantity && (one.leg === null || one.leg === leg));

export const heardAny = () => count > 0;

// When the first of what is kept was heard.
export const heardFrom = () => times[count > CAPACITY ? count % CAPACITY : 0];

// Times and numbers of some channels since a moment, oldest first. A column is plain numbers.
export function since(start, wanted) {
  const found = [[], ...wanted.map(() => [])];
  for (let i = Math.max(0, count - CAPACITY); i < count; i += 1) {
    const slot = i % CAPACITY;
    if (times[slot] < start) continue;
    found[0].push(times[slot]);
    wanted.forEach((channel, j) => found[j + 1].push(numbers[channel.at][slot]));
  }
  return found;
}

// The measured posture at a moment [rad, m], or null where none were heard within a second of it.
export function postureAt(time) {
  let nearest = -1;
  for (let i = Math.max(0, count - CAPACITY); i < count; i += 1) {
    if (nearest < 0 || Math.abs(times[i % CAPACITY] - time) < Math.abs(times[nearest] - time)) nearest = i % CAPACITY;
  }
  if (nearest < 0 || Math.abs(times[nearest] - time) > 1) return null;
  return channels.filter(({ quantity }) => quantity === "position").map(({ at, i }) => numbers[at][nearest] / (slides[i] ? 1 : DEGREES));
}
