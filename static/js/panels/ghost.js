// The ghost's scrubber: where the leg, or the rover, will be at a moment of the plan, or of the commands where they were edited or move the chassis.

import { act } from "../acts.js";
import { put } from "../api.js";
import { followCursor } from "../cursor.js";
import { $, attempt } from "../dom.js";
import { postureAt } from "../samples.js";
import { known, subscribe } from "../store.js";

const PLAY_SECONDS = 6;

let wanted = null; // the newest position not yet sent
let sending = false;
let playing = 0;

export function start() {
  $("scrub").addEventListener("input", () => show(Number($("scrub").value) / 1000));
  const refusal = () => (played(known) ? "" : "There is neither a plan nor a sequence to play.");
  act({ key: " ", text: "Play or pause the ghost", button: "ghost-play", run: toggle, refusal });
  act({ key: "[", text: "Ghost back", run: () => nudge(-0.02), refusal });
  act({ key: "]", text: "Ghost on", run: () => nudge(0.02), refusal });
  followCursor(goTo);
  subscribe(draw);
}

const NEAR = 0.1; // rad: farther from the played way the rover was on another one

// Where the rover was at a moment of the timeline, on the way that the ghost plays.
function goTo(time) {
  const plan = time === null ? null : played(known);
  const posture = plan && postureAt(time);
  const moment = posture && nearest(plan.waypoints, posture);
  if (typeof moment === "number") show(moment);
}

function nearest(waypoints, posture) {
  const travel = travelOf(waypoints);
  const total = travel.reduce((sum, one) => sum + one, 0);
  let [best, moment, before] = [NEAR, null, 0];
  travel.forEach((own, i) => {
    const way = waypoints[i + 1].map((q, j) => q - waypoints[i][j]);
    const length = way.reduce((sum, one) => sum + one * one, 0);
    const along = way.reduce((sum, one, j) => sum + one * (posture[j] - waypoints[i][j]), 0);
    const part = length > 0 ? Math.min(1, Math.max(0, along / length)) : 0;
    const away = Math.max(...way.map((one, j) => Math.abs(posture[j] - waypoints[i][j] - part * one)));
    if (away < best) [best, moment] = [away, total > 0 ? (before + part * own) / total : 0];
    before += own;
  });
  return moment;
}

const travelOf = (waypoints) => waypoints.slice(1).map((row, i) => Math.max(...row.map((q, j) => Math.abs(q - waypoints[i][j]))));

// Only the newest position is sent while one is under way: scrubbing never queues up.
async function show(moment) {
  wanted = Math.min(1, Math.max(0, moment));
  $("scrub").value = String(Math.round(wanted * 1000));
  read(wanted);
  if (sending) return;
  sending = true;
  while (wanted !== null) {
    const scrub = wanted;
    wanted = null;
    await attempt(() => put("/sessions/current/view", { scrub, show_ghost: true }));
  }
  sending = false;
}

const nudge = (by) => { if (!$("scrub").disabled) show(Number($("scrub").value) / 1000 + by); };

function toggle() {
  if ($("scrub").disabled) return;
  if (playing) {
    playing = 0;
    $("ghost-play").textContent = "▶";
    return;
  }
  const from = Number($("scrub").value) / 1000;
  const begin = performance.now() - (from >= 1 ? 0 : from) * PLAY_SECONDS * 1000;
  const mine = begin;
  playing = mine;
  $("ghost-play").textContent = "❚❚";
  const frame = () => {
    if (playing !== mine) return;
    const moment = (performance.now() - begin) / (PLAY_SECONDS * 1000);
    show(moment);
    if (moment >= 1) toggle();
    else setTimeout(frame, 40);
  };
  frame();
}

// What the scene plays: the waypoints, and what each leads through.
function played({ summary, plan, sequence }) {
  if (sequence && sequence.digest === summary?.played) {
    const names = sequence.commands.map((command) => command.phase || command.name);
    return { what: "commands", waypoints: [sequence.start, ...sequence.predicted], phases: ["", ...names] };
  }
  return plan?.plan ? { what: "plan", ...plan.plan } : null;
}

function phaseAt(plan, moment) {
  const travel = travelOf(plan.waypoints);
  const total = travel.reduce((sum, one) => sum + one, 0);
  let along = 0;
  for (let i = 0; i < travel.length; i += 1) {
    along += travel[i];
    if (along >= moment * total) return plan.phases[i + 1];
  }
  return plan.phases.at(-1);
}

function read(moment) {
  const plan = played(known);
  if (plan) $("scrub-read").textContent = `${Math.round(moment * 100)} % of the ${plan.what}, ${phaseAt(plan, moment)}`;
}

function draw({ summary, plan, sequence }) {
  if (!summary) return;
  const there = Boolean(played({ summary, plan, sequence }));
  $("scrub").disabled = !there;
  if (!there) {
    $("scrub-read").textContent = "no plan";
  } else if (!playing && !sending && document.activeElement !== $("scrub")) {
    $("scrub").value = String(Math.round(summary.view.scrub * 1000));
    read(summary.view.scrub);
  }
}
