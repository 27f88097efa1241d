// The goal of a walk: typed as a place, as a way ahead, taken from the footfall, or from a click on the ground while that is
// asked for. It is this page's, and its scene flies a flag there.

import { act } from "../acts.js";
import { PAGE, put } from "../api.js";
import { settled } from "../choosing.js";
import { $, asTyped, attempt } from "../dom.js";
import { follows } from "../following.js";
import { heardFirst } from "../keys.js";
import { reveal, unfold } from "../layout.js";
import { isEscape } from "../stopkeys.js";
import { changed, known, subscribe } from "../store.js";
import * as shared from "../texts/shared.js";
import * as texts from "../texts/walk.js";

const PLACE = ["walk-x", "walk-y"];
const AHEAD = ["walk-ahead", "walk-toward"];

let drawn = "null"; // the goal that is in the fields
let followed = false; // whether it is another page's

export function start() {
  act({
    text: texts.goalAtFootfall, button: "walk-here", run: takeFootfall,
    refusal: () => (known.summary?.footfall ? "" : texts.choosePlace),
  });
  act({ key: "=", text: texts.walkTo, button: "walk-to", run: () => (picks() ? leave() : pick()), refusal: () => (known.summary?.dem ? "" : shared.noTerrain) });
  for (const id of AHEAD) $(id).addEventListener("input", goAhead);
  for (const id of [...PLACE, ...AHEAD]) {
    $(id).addEventListener("change", typed);
    $(id).addEventListener("input", changed); // what comes next goes by the fields
  }
  heardFirst((event) => {
    const leaves = isEscape(event) && picks();
    if (leaves) leave();
    return leaves;
  });
  subscribe(draw);
}

// Whether the next click on the ground by this page sets the goal.
export const picks = () => known.summary?.view.goal_page === PAGE;

const change = (view) => attempt(() => put("/sessions/current/view", view));
const leave = () => change({ goal_page: "" });
export const setGoal = (x, y) => change({ goal: [x, y], goal_page: "" });

function pick() {
  reveal("goal");
  $("walk-form").scrollIntoView({ block: "nearest" });
  change({ goal_page: PAGE });
}

// Whether the fields of the goal can be asked for; where not, the browser points at what is missing.
export function isFilledIn() {
  if ($("walk-form").checkValidity()) return true;
  reveal("goal");
  return $("walk-form").reportValidity();
}

// Where the walk is to go, as the fields have it [x, y]; null where they don't say.
export function goalTold() {
  const told = PLACE.map((id) => $(id).value);
  return told.includes("") ? null : told.map(Number);
}

const takeFootfall = () => attempt(async () => {
  await settled();
  const { x, y } = known.summary.footfall;
  unfold("goal");
  write(x, y);
  await setGoal(x, y);
});

function typed() {
  const [x, y] = PLACE.map((id) => $(id).value);
  if (x !== "" && y !== "") setGoal(Number(x), Number(y));
}

// Straight on, or aside, from where the chassis is by the latest telemetry.
function goAhead() {
  const T = known.frame?.T_site_base;
  if (!T || $("walk-ahead").value === "") return;
  const toward = facing(T) + (Number($("walk-toward").value) * Math.PI) / 180;
  $("walk-x").value = asTyped(T[0][3] + Number($("walk-ahead").value) * Math.cos(toward));
  $("walk-y").value = asTyped(T[1][3] + Number($("walk-ahead").value) * Math.sin(toward));
}

const facing = (T) => Math.atan2(T[1][0], T[0][0]);

// The place, and the way there from where the chassis is; without telemetry nobody knows that way.
function write(x, y) {
  $("walk-x").value = asTyped(x);
  $("walk-y").value = asTyped(y);
  const T = known.frame?.T_site_base;
  const [east, north] = T ? [x - T[0][3], y - T[1][3]] : [0, 0];
  const turn = T ? Math.atan2(north, east) - facing(T) : 0;
  $("walk-ahead").value = T ? asTyped(Math.hypot(east, north), 2) : "";
  $("walk-toward").value = asTyped((Math.atan2(Math.sin(turn), Math.cos(turn)) * 180) / Math.PI, 0);
}

function draw({ summary }) {
  if (!summary) return;
  $("goal-note").hidden = !picks();
  $("walk-to").setAttribute("aria-pressed", String(picks()));
  const { goal } = summary.view;
  const key = JSON.stringify(goal);
  const typing = [...PLACE, ...AHEAD].some((id) => document.activeElement === $(id));
  if (key === drawn || typing) return; // never write over what the operator is typing
  drawn = key;
  if (goal) write(...goal);
  else if (followed) for (const id of [...PLACE, ...AHEAD]) $(id).value = ""; // another's goal is none of this page
  followed = follows();
}
