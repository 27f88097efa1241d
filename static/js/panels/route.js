// Route: the cheapest way of the chassis to the goal of the walk, read, and taken piece by piece as goals of walks.

import { act } from "../acts.js";
import { post } from "../api.js";
import { settled } from "../choosing.js";
import { $, attempt, element } from "../dom.js";
import { outOfDate } from "../fits.js";
import { areAmong, keptOff } from "../footfallmoves.js";
import { unfold } from "../layout.js";
import { isAthletes, legsLong } from "../robot.js";
import { freeze } from "../stance.js";
import { known, subscribe } from "../store.js";
import * as shared from "../texts/shared.js";
import * as texts from "../texts/walk.js";
import { isFilledIn, setGoal } from "./goal.js";
import { placesSaid } from "./places.js";

const PART = 2.15; // of the way that is walked at once: so many of the robot's legs, 5 m for ATHLETE
const SMALL = 0.043; // legs, 0.1 m for ATHLETE: a route ends so near to its goal, and no part is shorter

let shown = ""; // digest of the route that is shown

export function start() {
  $("route-part").value = String(Number(legsLong(PART).toPrecision(2)));
  act({ text: texts.planRoute, button: "plan-route", run: planRoute, refusal: () => (known.summary?.dem ? "" : shared.noTerrain) });
  act({ text: texts.goalAlongRoute, button: "route-goal", run: take, refusal: notTaken });
  subscribe(draw);
}

const out = () => outOfDate(known.summary?.up_to_date.route) || (isHeeded() ? "" : texts.areasSince);

// Whether the route keeps off all the ground that is said to be kept off.
const isHeeded = () => !known.route?.plan || areAmong(keptOff(placesSaid()), known.route.provenance.settings.no_go);

function notTaken() {
  if (!known.route?.plan) return texts.noRoute;
  return out() ? texts.routeIsOut(out()) : "";
}

const planRoute = () => attempt(async () => {
  await settled();
  unfold("goal");
  if (!isFilledIn()) return;
  await freeze();
  const goal = { x: Number($("walk-x").value), y: Number($("walk-y").value) };
  await post("/sessions/current/routes", { goal, settings: { no_go: keptOff(placesSaid()) } });
});

const small = () => Number(legsLong(SMALL).toPrecision(1));

const take = () => attempt(async () => {
  const along = Number($("route-part").value);
  if (!(along >= small())) throw new Error(texts.partTooShort(small()));
  await setGoal(...pointAt(known.route.plan.points, along));
});

// The point so far along a line of points, or its last one.
export function pointAt(points, along) {
  let left = along;
  for (let i = 1; i < points.length; i += 1) {
    const [from, to] = [points[i - 1], points[i]];
    const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (length >= left) return from.map((one, axis) => one + (left / length) * (to[axis] - one));
    left -= length;
  }
  return points[points.length - 1];
}

const lengthOf = (points) => points.slice(1).reduce((sum, at, i) => sum + Math.hypot(at[0] - points[i][0], at[1] - points[i][1]), 0);

// The route that the walk to a goal goes along, as its order says it: {} where it goes straight.
export function alongRoute({ x, y }) {
  if (isAthletes() || !known.route?.plan || !$("walk-along").checked) return {};
  if (out()) throw new Error(texts.alongIsOut(out()));
  const [toX, toY] = known.route.goal;
  if (Math.hypot(toX - x, toY - y) > small()) throw new Error(texts.leadsElsewhere);
  return { route: known.route.digest };
}

function draw({ summary, route }) {
  if (!summary) return;
  $("walk-along-row").hidden = isAthletes(); // what others described goes along it; ATHLETE's walks find their own way
  $("route-doubt").hidden = !out();
  $("route-doubt").textContent = out() ? texts.routeOutOfDate(out()) : "";
  if ((route?.digest ?? "") === shown) return;
  shown = route?.digest ?? "";
  $("route-way").hidden = !route?.plan;
  $("route-answer").replaceChildren(...(route ? [told(route)] : []));
}

function told({ plan, status, reason }) {
  if (!plan) return element("p", { className: "no", textContent: texts.noRouteFound(status, reason) });
  return element("p", { className: "yes", textContent: texts.routeFound(lengthOf(plan.points), plan.cost, isAthletes()) });
}
