// Tether: what the rover hangs on in its walk, from fields, and what its drum does on the way, in words.

import { act } from "../acts.js";
import { $, asTyped } from "../dom.js";
import { unfold } from "../layout.js";
import { keepFields, rememberInSession } from "../remembered.js";
import { known, subscribe } from "../store.js";
import * as texts from "../texts/walk.js";

const ANCHOR = ["tether-x", "tether-y", "tether-z"];
const LEAVES = ["tether-at-x", "tether-at-y", "tether-at-z"];
const DRUM = ["tether-length", "tether-force"];

export function start() {
  for (const id of ["tether-on", ...ANCHOR]) $(id).addEventListener("input", demand);
  rememberInSession("tether-on", ...ANCHOR, ...LEAVES, ...DRUM);
  subscribe(demand); // it may be that of before a reload
  act({ text: texts.anchorAtFootfall, button: "tether-here", run: takeFootfall, refusal: notTaken });
}

const numbers = (ids) => ids.map((id) => Number($(id).value));

// The tether of an order for a walk; none where the rover does not hang on one.
export function tether() {
  if (!$("tether-on").checked) return null;
  const [free_length, most_force] = numbers(DRUM);
  return { anchor: numbers(ANCHOR), attachment: numbers(LEAVES), free_length, most_force };
}

// What is asked for is in sight, so that the browser can point at what is missing.
export function showTether() {
  if ($("tether-on").checked) $("walk-tether").open = true;
}

function demand() {
  for (const id of [...ANCHOR, ...LEAVES, ...DRUM]) $(id).required = $("tether-on").checked;
}

const notTaken = () => (Number.isFinite(known.summary?.footfall_answer?.z) ? "" : texts.chooseKnownPlace);

function takeFootfall() {
  const { x, y, z } = known.summary.footfall_answer;
  for (const [axis, value] of [x, y, z].entries()) $(ANCHOR[axis]).value = asTyped(value);
  unfold("goal");
  $("walk-tether").open = true;
  $("tether-on").checked = true;
  keepFields();
  demand();
}

// How much of it each foot move takes, hauling in counted as less than nothing [m].
export function paidOut({ legs, moves, tethered }) {
  const out = legs.map(() => 0);
  for (let row = 1; row < moves.length; row += 1) {
    if (moves[row] < out.length) out[moves[row]] += tethered.lengths[row] - tethered.lengths[row - 1];
  }
  return out;
}
