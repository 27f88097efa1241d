// Points that the wheel's centre is to pass during the swing: typed, moved by keys, or taken from where the ghost is.

import { act } from "../acts.js";
import { get } from "../api.js";
import { $, attempt, element } from "../dom.js";
import { changed, known, subscribe } from "../store.js";

const STEP = 0.05; // m, by which the arrow keys move a point

let listed = []; // [x, y, z] each
let leg = null; // whose wheel they are for

export function start() {
  act({
    key: "J", text: "Add a point at the ghost for the wheel to pass", button: "through-add", run: add,
    refusal: () => (known.plan?.plan ? "" : "There is no plan whose ghost could show a place: plan the step first."),
  });
  act({
    text: "Remove all points for the wheel to pass", button: "through-clear", run: () => change([]),
    refusal: () => (listed.length ? "" : "There are no points."),
  });
  subscribe(draw);
}

export const points = () => (leg === known.summary.footfall?.leg ? listed : []);

function change(to) {
  listed = to;
  $("through").hidden = listed.length === 0;
  changed();
  $("through").tBodies[0].replaceChildren(...listed.map(row));
}

function row(point, i) {
  const fields = ["x", "y", "z"].map((name, axis) => {
    const field = element("input", { type: "number", step: String(STEP), value: point[axis].toFixed(3) });
    field.setAttribute("aria-label", `${name} of point ${i + 1}`);
    field.addEventListener("change", () => { if (field.value !== "") listed[i][axis] = Number(field.value); });
    return element("td", {}, field);
  });
  const remove = element("button", { type: "button", textContent: "✕", title: "Remove", onclick: () => change(listed.filter((_, j) => j !== i)) });
  remove.setAttribute("aria-label", `Remove point ${i + 1}`);
  return element("tr", {}, element("td", { textContent: String(i + 1) }), ...fields, element("td", {}, remove));
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
  change([...listed.slice(0, passed), here, ...listed.slice(passed)]);
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
  // points of another leg's swing would lead this one astray
  if (leg !== null && summary?.footfall && summary.footfall.leg !== leg && listed.length) change([]);
}
