// Footfalls of the walk that a hand moves: each is pinned where it is put, and where it was is forbidden to its leg. Nothing is
// planned by that: it counts with the next plan. No part of the page is needed.

/** @typedef {{x: number, y: number, leg?: number, radius?: number}} Place of the ground, as a walk is asked for with it [m] */
/** @typedef {{forbidden: Place[], pinned: Place[]}} Places */
/** @typedef {{number: number, leg: number, from: number[], to: number[]}} Move number: of the foot move in the walk, from 0 */

const RADIUS = 0.2; // m: of a forbidden place, where the new one is not nearer
const SAME = 1e-6; // m
const ON = 0.05; // m: a foot that is put on a pinned place is no farther from it
const APART = 0.9; // of the way to the new place: that is not forbidden itself

// What is said of the ground, and what was moved since, as a walk is asked for with it.
/** @type {(said: Places, moves: Move[]) => Places} */
export function withMoves({ forbidden, pinned }, moves) {
  const held = pinned.filter((pin) => !moves.some(({ leg, from }) => pin.leg === leg && apart(from, [pin.x, pin.y]) < RADIUS));
  return {
    forbidden: [...forbidden, ...moves.map(({ leg, from, to }) => ({ x: from[0], y: from[1], leg, radius: Math.min(RADIUS, APART * apart(from, to)) }))],
    pinned: [...held, ...moves.map(({ leg, to }) => ({ x: to[0], y: to[1], leg }))],
  };
}

// Whether a walk that was asked for so counts with all of them.
/** @type {(places: Places, asked: Partial<Places> | undefined) => boolean} */
export const areHeeded = ({ forbidden, pinned }, asked) => areAmong(forbidden, asked?.forbidden) && areAmong(pinned, asked?.pinned);

// The pinned places that the first so many footfalls of a walk put a foot on, as the server counts them for the next one.
/** @type {(pinned: Place[], footfalls: {leg: number, at: number[]}[], done: number) => Place[]} */
export const metBy = (pinned, footfalls, done) => pinned.filter((pin) => {
  const away = footfalls.map(({ leg, at }) => ((pin.leg ?? leg) === leg ? apart(at, [pin.x, pin.y]) : Infinity));
  const least = Math.min(...away);
  return least <= ON && away.indexOf(least) < done;
});

// The ground that is kept off: no foot is put there, and routes keep the chassis off it, too.
/** @type {(places: Places) => {x: number, y: number, radius: number}[]} */
export const keptOff = ({ forbidden }) => forbidden.flatMap(({ x, y, radius, leg }) => (radius && leg === undefined ? [{ x, y, radius }] : []));

/** @type {(places: Place[], others: Place[] | undefined) => boolean} */
export const areAmong = (places, others = []) => places.every((one) => others.some((other) => (one.leg ?? null) === (other.leg ?? null) && apart([one.x, one.y], [other.x, other.y]) < SAME));

// A footfall that is moved again is moved from where the walk has it; back there, it is not moved.
/** @type {(moves: Move[], move: Move) => Move[]} */
export function movedTo(moves, move) {
  const others = moves.filter((one) => one.number !== move.number);
  return apart(move.from, move.to) ? [...others, move] : others;
}

// Where each footfall of a walk is to be: where it was put, or where the walk has it.
/** @type {(footfalls: {leg: number, at: number[]}[], moves: Move[]) => {number: number, leg: number, from: number[], at: number[]}[]} */
export const meantOf = (footfalls, moves) => footfalls.map(({ leg, at }, number) => {
  const moved = moves.find((one) => one.number === number);
  return { number, leg, from: at, at: moved ? moved.to : at };
});

// The footfall next to a pixel, of those that are no farther than so many; the later where two are as near, as it is drawn last.
/** @template {{at: number[]}} T @type {(footfalls: T[], place: (at: number[]) => number[], pixel: number[], most: number) => T | null} */
export function nearest(footfalls, place, pixel, most) {
  const [found] = [...footfalls].reverse().map((one) => ({ one, away: apart(place(one.at), pixel) }))
    .filter(({ away }) => away <= most).sort((a, b) => a.away - b.away);
  return found?.one ?? null;
}

/** @type {(one: number[], other: number[]) => number} */
const apart = (one, other) => Math.hypot(one[0] - other[0], one[1] - other[1]);
