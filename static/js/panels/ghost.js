// The ghost's scrubber: where the leg, or the rover, will be at a moment of the plan, of the commands where they were edited or move the chassis, or of a whole walk.

import { act } from "../acts.js";
import { put } from "../api.js";
import { followCursor } from "../cursor.js";
import { $, asTyped, attempt } from "../dom.js";
import { follows, notOwn } from "../following.js";
import { endBeside, footMoveTold, waypointAt } from "../footmoves.js";
import { momentAt, pace, played, rowAt, timeAt, travelOf, walkPlayed } from "../pace.js";
import { postureAt } from "../samples.js";
import { known, subscribe } from "../store.js";
import { refresh } from "../stream.js";
import * as texts from "../texts/ghost.js";
import * as shared from "../texts/shared.js";
import { onChoice, chosenRow } from "./row.js";

const PLAY_SECONDS = 6; // for the whole way, where it has no times or those are not asked for
const FOOT_MOVE_SECONDS = 2; // for each foot move of a walk

let wanted = null; // the newest position not yet sent
let sending = false;
let playing = 0;
let exact = null; // the moment that was asked for last: the slider holds it in steps
let time = null; // s: the one that was asked for, where a wait makes several of one moment

export function start() {
  $("scrub").addEventListener("input", () => ghostTo(Number($("scrub").value) / 1000));
  $("ghost-plays").addEventListener("change", () => attempt(async () => {
    await put("/sessions/current/view", { plays: $("ghost-plays").value });
    await refresh();
  }));
  $("scrub-time").addEventListener("change", () => { const way = pace(); if (way) showTime(way, Number($("scrub-time").value)); });
  const refusal = () => notOwn() || (played() ? "" : texts.nothingToPlay);
  const untimed = () => refusal() || (pace() || walkPlayed() ? "" : texts.noRows);
  act({ key: " ", text: texts.playOrPause, button: "ghost-play", run: toggle, refusal });
  act({ key: "[", text: texts.back, run: () => nudge(-0.02), refusal });
  act({ key: "]", text: texts.on, run: () => nudge(0.02), refusal });
  act({ key: "{", text: texts.toPartBefore, run: () => toPart(-1), refusal: untimed });
  act({ key: "}", text: texts.toPartAfter, run: () => toPart(1), refusal: untimed });
  onChoice(() => { if (chosenRow() !== null) endOf(chosenRow()); });
  followCursor(goTo);
  subscribe(draw);
}

const NEAR = 0.1; // rad: farther from the played way the rover was on another one

// Where the rover was at a moment of the timeline, on the way that the ghost plays.
function goTo(when) {
  const plan = when === null ? null : played();
  const posture = plan && postureAt(when);
  const moment = posture && nearest(plan.waypoints, posture);
  if (typeof moment === "number") ghostTo(moment);
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

// Only the newest position is sent while one is under way: scrubbing never queues up.
export async function ghostTo(moment, at = null) {
  time = at;
  wanted = exact = Math.min(1, Math.max(0, moment));
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

const nudge = (by) => { if (!$("scrub").disabled) ghostTo(shownMoment() + by); };

export const shownMoment = () => (exact !== null && Math.round(1000 * exact) === Number($("scrub").value) ? exact : Number($("scrub").value) / 1000);
const shownTime = (way) => time ?? timeAt(way, shownMoment());

function showTime(way, seconds) {
  const at = Math.min(way.seconds.at(-1), Math.max(0, seconds));
  ghostTo(momentAt(way, at), at);
}

// The end of a row (from 0), before which −1 is the start.
function endOf(row) {
  const way = pace();
  if (way) showTime(way, way.seconds[Math.max(0, Math.min(way.seconds.length - 1, row + 1))]);
}

// Of a walk, the end of a foot move.
function toPart(by) {
  const walk = walkPlayed();
  if (walk) ghostTo(endBeside(walk, shownMoment(), by));
  else toRow(by);
}

function toRow(by) {
  const way = pace();
  const now = shownTime(way);
  const row = rowAt(way, now);
  const inside = Math.abs(way.seconds[row + 1] - now) > 0.005; // s
  endOf(by > 0 ? row + (inside || now === 0 ? 0 : 1) : row - 1);
}

function sayPlaying(which) {
  playing = which;
  $("ghost-play").textContent = playing ? "❚❚" : "▶";
  $("ghost-play").ariaLabel = playing ? texts.pause : texts.play;
}

function toggle() {
  if ($("scrub").disabled) return;
  if (playing) {
    sayPlaying(0);
    return;
  }
  const way = pace();
  const rate = way ? Number($("ghost-rate").value) : 0; // times as fast as commanded; 0: whole way in PLAY_SECONDS
  const from = shownMoment() >= 1 ? 0 : shownMoment();
  const whole = walkPlayed() ? FOOT_MOVE_SECONDS * Math.max(1, walkPlayed().legs.length) : PLAY_SECONDS;
  const before = rate ? (from ? shownTime(way) : 0) / rate : from * whole;
  const begin = performance.now() - before * 1000;
  const mine = begin;
  sayPlaying(mine);
  const frame = () => {
    if (playing !== mine) return;
    const passed = (performance.now() - begin) / 1000;
    if (rate) showTime(way, passed * rate);
    else ghostTo(passed / whole);
    if (rate ? passed * rate >= way.seconds.at(-1) : passed >= whole) toggle();
    else setTimeout(frame, 40);
  };
  frame();
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
  const what = played();
  if (!what) return;
  const way = pace();
  $("scrub-time").parentElement.hidden = $("ghost-rate").hidden = !way;
  const walk = walkPlayed();
  const share = texts.shareOf(moment, what.what);
  if (walk) {
    const waypoint = waypointAt(walk, moment);
    $("scrub-read").textContent = `${footMoveTold(walk, waypoint)}, ${walk.phases[waypoint]}, ${share}`;
    return;
  }
  if (!way) {
    $("scrub-read").textContent = `${share}, ${phaseAt(what, moment)}`;
    return;
  }
  const now = time ?? timeAt(way, moment);
  const row = rowAt(way, now);
  $("scrub-read").textContent = texts.atRow(share, way.names[row], row + 1, way.names.length);
  if (document.activeElement !== $("scrub-time")) $("scrub-time").value = asTyped(now, 1);
  $("scrub-whole").textContent = texts.ofWhole(way.seconds.at(-1));
}

function draw({ summary, plan, sequence }) {
  if (!summary) return;
  const there = Boolean(played());
  const [walk, step] = [known.walk?.plan ?? known.walk?.partial, plan?.plan || sequence?.commands.length];
  $("ghost-plays").hidden = !(walk && step);
  if (document.activeElement !== $("ghost-plays")) $("ghost-plays").value = walkPlayed() ? "walk" : "step";
  $("scrub").disabled = !there || follows();
  if (!there) {
    $("scrub-read").textContent = shared.noPlanShort;
    $("scrub-time").parentElement.hidden = $("ghost-rate").hidden = true;
  } else if (!playing && !sending && document.activeElement !== $("scrub")) {
    const moved = Math.round(summary.view.scrub * 1000) !== Number($("scrub").value);
    if (moved) time = null;
    exact = summary.view.scrub;
    $("scrub").value = String(Math.round(summary.view.scrub * 1000));
    read(summary.view.scrub);
  } else {
    read(shownMoment()); // its place is the operator's, but another plan or its commands may be played by now
  }
}
