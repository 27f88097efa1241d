// The ghost's scrubber: where the leg will be at a moment of the plan.

import { put } from "../api.js";
import { $, attempt } from "../dom.js";
import { bind } from "../keys.js";
import { known, subscribe } from "../store.js";

const PLAY_SECONDS = 6;

let wanted = null; // the newest position not yet sent
let sending = false;
let playing = 0;

export function start() {
  $("scrub").addEventListener("input", () => show(Number($("scrub").value) / 1000));
  $("ghost-play").addEventListener("click", toggle);
  bind(" ", "Play or pause the ghost", toggle);
  bind("[", "Ghost back", () => nudge(-0.02));
  bind("]", "Ghost on", () => nudge(0.02));
  subscribe(draw);
}

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

function phaseAt(moment) {
  const plan = known.plan?.plan;
  if (!plan) return "";
  const travel = plan.waypoints.slice(1).map((row, i) => Math.max(...row.map((q, j) => Math.abs(q - plan.waypoints[i][j]))));
  const total = travel.reduce((sum, one) => sum + one, 0);
  let along = 0;
  for (let i = 0; i < travel.length; i += 1) {
    along += travel[i];
    if (along >= moment * total) return plan.phases[i + 1];
  }
  return plan.phases.at(-1);
}

function read(moment) {
  $("scrub-read").textContent = `${Math.round(moment * 100)} % of the plan, ${phaseAt(moment)}`;
}

function draw({ summary, plan }) {
  const there = Boolean(plan?.plan);
  $("scrub").disabled = !there;
  $("ghost-play").disabled = !there;
  if (!there) {
    $("scrub-read").textContent = "no plan";
  } else if (!playing && !sending && document.activeElement !== $("scrub")) {
    $("scrub").value = String(Math.round(summary.view.scrub * 1000));
    read(summary.view.scrub);
  }
}
