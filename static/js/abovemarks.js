// What the map from above shows over the ground: the rover, the route, the walk with its footfalls, goal, footfall, scale and north.

import { barOf } from "./above.js";
import { outOfDate, walkOutOfDate } from "./fits.js";
import { keptOff } from "./footfallmoves.js";
import { STALE_AFTER, telemetryAge } from "./store.js";
import * as texts from "./texts/ground.js";
import { leg as legTold } from "./texts/shared.js";

const BAR = 120; // px at most
const NUMBERED = 25; // pixels a metre, from which footfalls have the numbers of their legs
const FACING = 24; // px of that line where nobody says where the legs begin
const FRONT = 1.5; // of the chassis' radius: how far the line reaches that says where the front is
export const COLOURS = { rover: "#ffffff", route: "#be8cff", walk: "#6fd3ff", goal: "#ffc94d", footfall: "#ffffff", pointer: "#ffc94d", forbidden: "#ff5a5a", pinned: "#7ee08a" };

// The walk that is shown; null where there is none, or it is out of date.
const wayOf = (facts) => (walkOutOfDate(facts) ? null : facts.walk?.plan ?? facts.walk?.partial ?? null);

// The footfalls of that walk, in their order: legs, and where they come down [m].
// A walk of a robot that others described does not say the places.
export const footfallsOf = (facts) => footfallsIn(wayOf(facts));
export const footfallsIn = (plan) => (plan?.stances ? plan.legs : []).map((leg, number) => ({ leg, at: plan.stances[number + 1].contacts[leg].slice(0, 2) }));

// place: site [m] → pixel; facts: what the page knows; places: forbidden and pinned ones, for the next walk; moves: of its
// footfalls, also the one in hand.
export function paintMarks(pen, place, facts, { forbidden, pinned }, moves) {
  const { summary, robot, frame, route } = facts;
  if (route?.plan && !outOfDate(summary.up_to_date.route)) line(pen, route.plan.points.map(place), COLOURS.route);
  if (wayOf(facts)) paintWalk(pen, place, wayOf(facts), footfallsOf(facts));
  for (const { x, y } of forbidden) crossed(pen, place([x, y]));
  for (const { x, y, radius } of keptOff({ forbidden, pinned })) circle(pen, place([x, y]), radius * pixelsOf(place));
  for (const { x, y, leg } of pinned) boxed(pen, place([x, y]), String(leg));
  for (const { from, to } of moves) {
    line(pen, [place(from), place(to)], COLOURS.pinned, [4, 4]);
    dot(pen, place(to), COLOURS.pinned);
  }
  if (summary.view.goal) paintGoal(pen, place(summary.view.goal));
  if (summary.footfall) {
    const at = place([summary.footfall.x, summary.footfall.y]);
    cross(pen, at, COLOURS.footfall);
    write(pen, legTold(summary.footfall.leg), [at[0] + 10, at[1] - 8]);
  }
  if (frame) paintRover(pen, place, robot, frame);
}

// -- what is there ---------------------------------------------------------------------------------

// The hips, which are the chassis' corners, with the numbers of the legs, and where its front is. Dashed: not heard by now.
function paintRover(pen, place, { T_base_hips: hips, legs }, frame) {
  const T = frame.T_site_base;
  const onSite = ([x, y]) => [0, 1].map((i) => T[i][3] + T[i][0] * x + T[i][1] * y);
  const dash = telemetryAge(frame) > STALE_AFTER ? [6, 3] : [];
  if (!hips.length) return paintFacing(pen, place, onSite, dash);
  const corners = legs.map((leg) => [hips[leg][0][3], hips[leg][1][3]]);
  const around = [...corners].sort((a, b) => Math.atan2(a[1], a[0]) - Math.atan2(b[1], b[0])).map((at) => place(onSite(at)));
  line(pen, [...around, around[0]], COLOURS.rover, dash);
  const radius = Math.max(...corners.map(([x, y]) => Math.hypot(x, y)));
  line(pen, [place(onSite([0, 0])), place(onSite([FRONT * radius, 0]))], COLOURS.rover, dash);
  return corners.forEach(([x, y], i) => write(pen, String(legs[i]), place(onSite([1.2 * x, 1.2 * y])), "center"));
}

// Where nobody says where its legs begin: its place, and where it faces.
function paintFacing(pen, place, onSite, dash) {
  const [at, ahead] = [place(onSite([0, 0])), place(onSite([1, 0]))];
  const share = FACING / Math.hypot(ahead[0] - at[0], ahead[1] - at[1]);
  dot(pen, at, COLOURS.rover);
  line(pen, [at, at.map((one, axis) => one + share * (ahead[axis] - one))], COLOURS.rover, dash);
}

function paintWalk(pen, place, { Ts_site_base: stood }, footfalls) {
  line(pen, stood.map((T) => place([T[0][3], T[1][3]])), COLOURS.walk);
  const pixels = pixelsOf(place);
  for (const { leg, at: [x, y] } of footfalls) {
    const at = place([x, y]);
    dot(pen, at, COLOURS.walk);
    if (pixels >= NUMBERED) write(pen, String(leg), [at[0] + 6, at[1] - 6]);
  }
}

function paintGoal(pen, [x, y]) {
  line(pen, [[x, y], [x, y - 22], [x + 14, y - 17], [x, y - 12]], COLOURS.goal);
  dot(pen, [x, y], COLOURS.goal);
}

// -- how it is drawn -------------------------------------------------------------------------------

// Each over a wider one in black: it is seen on any ground.
function line(pen, points, colour, dash = []) {
  for (const [width, style, dashes] of [[5, "#000000", []], [2.5, colour, dash]]) {
    pen.lineWidth = width;
    pen.strokeStyle = style;
    pen.setLineDash(dashes);
    pen.beginPath();
    points.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    pen.stroke();
  }
  pen.setLineDash([]);
}

function dot(pen, [x, y], colour) {
  for (const [radius, style] of [[5, "#000000"], [3.5, colour]]) {
    pen.fillStyle = style;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.fill();
  }
}

export function cross(pen, [x, y], colour) {
  line(pen, [[x - 9, y], [x + 9, y]], colour);
  line(pen, [[x, y - 9], [x, y + 9]], colour);
}

function crossed(pen, [x, y]) {
  line(pen, [[x - 6, y - 6], [x + 6, y + 6]], COLOURS.forbidden);
  line(pen, [[x - 6, y + 6], [x + 6, y - 6]], COLOURS.forbidden);
}

function circle(pen, [x, y], radius) {
  const turns = Array.from({ length: 49 }, (_, i) => (2 * Math.PI * i) / 48);
  line(pen, turns.map((turn) => [x + radius * Math.cos(turn), y + radius * Math.sin(turn)]), COLOURS.forbidden, [6, 4]);
}

// Of a metre.
const pixelsOf = (place) => Math.hypot(...[0, 1].map((i) => place([1, 0])[i] - place([0, 0])[i]));

function boxed(pen, [x, y], text) {
  line(pen, [[x - 7, y - 7], [x + 7, y - 7], [x + 7, y + 7], [x - 7, y + 7], [x - 7, y - 7]], COLOURS.pinned);
  write(pen, text, [x + 11, y - 8]);
}

function write(pen, text, [x, y], align = "left") {
  pen.font = "12px system-ui, sans-serif";
  pen.textAlign = align;
  pen.textBaseline = "middle";
  pen.lineWidth = 3;
  pen.strokeStyle = "#000000";
  pen.fillStyle = "#ffffff";
  pen.strokeText(text, x, y);
  pen.fillText(text, x, y);
}

// A bar with its length in the lower left corner, and where north is in the upper right one.
export function paintScale(pen, lie, { width, height }) {
  const length = barOf(lie, Math.min(BAR, width / 3));
  const [left, low, right] = [12, height - 12, 12 + length * lie.scale];
  line(pen, [[left, low - 5], [left, low], [right, low], [right, low - 5]], "#ffffff");
  write(pen, texts.barLength(length), [left + 4, low - 14]);
  line(pen, [[width - 16, 34], [width - 16, 12], [width - 20, 18], [width - 16, 12], [width - 12, 18]], "#ffffff");
  write(pen, texts.northSign, [width - 16, 44], "center");
}
