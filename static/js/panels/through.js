// Points that the wheel's centre is to pass during the swing: typed, moved by keys or by hand, or taken from where the ghost is.
// They are this page's, and setting them can be undone.

import { act } from "../acts.js";
import { get, put } from "../api.js";
import { $, asTyped, attempt, element } from "../dom.js";
import { changed, known, subscribe } from "../store.js";
import { refresh } from "../stream.js";
import * as texts from "../texts/footfall.js";
import { take } from "./hand.js";

const STEP = 0.05; // m, by which the arrow keys move a point
const PAUSE = 700; // ms after which numbers that were typed or stepped are set

let listed = []; // [x, y, z] each
let leg = null; // whose wheel they are for
let pausing = 0; // the timer while numbers here are not set yet
let setting = null; // the promise of those that are on their way to the server
let drawn = "";

export function start() {
  act({
    key: "J", text: texts.addPoint, button: "through-add", run: add,
    refusal: () => (known.plan?.plan ? "" : texts.noGhost),
  });
  act({
    text: texts.removePoints, button: "through-clear", run: () => change([]),
    refusal: () => (points().length ? "" : texts.noPoints),
  });
  $("through").addEventListener("focusout", () => { if (pausing) attempt(set); });
  subscribe(draw);
}

// points of another leg's swing would lead this one astray
export const points = () => (leg === (known.summary?.footfall?.leg ?? leg) ? listed : []);

function set() {
  clearTimeout(pausing);
  pausing = 0;
  const asked = { leg, points: listed };
  const mine = Promise.resolve(setting).catch(() => {}).then(async () => {
    await put("/sessions/current/points", asked);
    await refresh();
  }).finally(() => {
    if (setting !== mine) return; // others are on their way by now
    setting = null;
    draw(known); // as the server has them
  });
  setting = mine;
  return mine;
}

// What is typed counts before it rests, and what is on its way before it has arrived.
export const settled = () => (pausing ? set() : Promise.resolve(setting));

const change = (to) => attempt(() => {
  listed = to;
  return set();
});

function row(point, i) {
  const fields = ["x", "y", "z"].map((name, axis) => {
    const field = element("input", { type: "number", step: String(STEP), value: asTyped(point[axis]) });
    field.setAttribute("aria-label", texts.axisOfPoint(name, i + 1));
    field.addEventListener("change", () => {
      if (field.value === "") return;
      listed = listed.map((one, j) => (j === i ? one.map((at, k) => (k === axis ? Number(field.value) : at)) : one));
      clearTimeout(pausing);
      pausing = setTimeout(() => attempt(set), PAUSE);
    });
    return element("td", {}, field);
  });
  const hand = element("button", { type: "button", textContent: "✥", title: texts.moveByHand, onclick: () => take({ what: "point", index: i }) });
  hand.setAttribute("aria-label", texts.movePoint(i + 1));
  const remove = element("button", { type: "button", textContent: "✕", title: texts.remove, onclick: () => change(listed.filter((_, j) => j !== i)) });
  remove.setAttribute("aria-label", texts.removePoint(i + 1));
  return element("tr", {}, element("td", { textContent: String(i + 1) }), ...fields, element("td", {}, hand, remove));
}

// The points stay in the order in which the ghost passes them: a new one goes behind those that it has passed.
const add = () => attempt(async () => {
  const result = known.plan;
  $("panel-through").open = true;
  const { points: path } = await get(`/sessions/current/plans/${result.digest}/wheel-path`);
  const { i, share } = segment(result.plan.waypoints, Number($("scrub").value) / 1000);
  const here = path[i].map((from, axis) => from + share * (path[i + 1][axis] - from));
  if (leg !== result.plan.leg) listed = [];
  leg = result.plan.leg;
  const passed = listed.filter((point) => place(path, point) <= i + share).length;
  listed = [...listed.slice(0, passed), here, ...listed.slice(passed)];
  await set();
});

// Where along the plan its ghost is: as the scene plays it, by the largest turn of a joint.
function segment(waypoints, moment) {
  const travel = waypoints.slice(1).map((q, i) => Math.max(...q.map((angle, j) => Math.abs(angle - waypoints[i][j]))));
  let left = moment * travel.reduce((sum, one) => sum + one, 0);
  for (let i = 0; i < travel.length; i += 1) {
    if (left <= travel[i]) return { i, share: travel[i] ? left / travel[i] : 0 };
    left -= travel[i];
  }
  return { i: travel.length - 1, share: 1 };
}

// Number of the waypoint at which the wheel is nearest to a point.
function place(path, point) {
  const away = path.map((one) => Math.hypot(...one.map((at, axis) => at - point[axis])));
  return away.indexOf(Math.min(...away));
}

function draw({ summary }) {
  if (!summary || pausing || setting) return; // not under the hands of somebody who types
  if (summary.points) ({ leg, points: listed } = summary.points);
  else listed = [];
  const shown = points();
  const key = JSON.stringify([leg, shown]);
  if (key === drawn) return;
  drawn = key;
  const focused = $("through").contains(document.activeElement) ? document.activeElement.ariaLabel : null;
  $("through").hidden = shown.length === 0;
  $("through").tBodies[0].replaceChildren(...shown.map(row));
  if (focused) [...$("through").querySelectorAll("input, button")].find((one) => one.ariaLabel === focused)?.focus();
  changed();
}
