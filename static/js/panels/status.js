// The status bar: link and age, mode, ground and its age, whether the plan still matches the rover, and stop.

import { post } from "../api.js";
import { $, age, attempt, fixed, toast } from "../dom.js";
import { known, subscribe } from "../store.js";

const STALE_AFTER = 2; // seconds; the command gate refuses beyond this too

let sent = false; // a stop request left this page and is not yet known to have arrived

export async function stop() {
  sent = true;
  draw();
  try {
    await post("/stop", {});
  } catch (error) {
    toast(`The stop request did not reach the server: ${error.message} Use another way to stop the rover.`);
  }
  draw();
}

export function start() {
  $("stop").addEventListener("click", stop);
  $("stop-clear").addEventListener("click", () => attempt(async () => {
    await post("/stop/clear", {});
    sent = false;
  }));
  subscribe(draw);
}

function mark(id, state, text) {
  $(id).dataset.state = state;
  $(id).textContent = text;
  $(id).title = text; // where the bar is too narrow to show it all
}

function draw() {
  const { summary, frame, connected } = known;
  mark("status-server", connected ? "good" : "bad", connected ? "connected" : `silent for ${age((performance.now() - known.heardAt) / 1000)}`);
  if (!summary) return;
  $("status-session").textContent = summary.name;
  drawLink(summary, frame);
  drawMatch(summary);
  drawStop(summary);
}

function drawLink(summary, frame) {
  if (!summary.link.connected) {
    const silent = frame ? telemetryAge(frame) : summary.link.age_s;
    mark("status-link", "bad", silent === null ? "no rover" : `LOST, last heard ${age(silent)} ago`);
  } else if (!frame) {
    mark("status-link", "warn", "no telemetry yet");
  } else {
    const old = telemetryAge(frame);
    const gaps = summary.link.gaps ? `, ${summary.link.gaps} gaps` : "";
    mark("status-link", old > STALE_AFTER ? "stale" : "good", `${old > STALE_AFTER ? "STALE " : ""}${age(old)} old${gaps}`);
  }
  $("status-mode").textContent = frame ? frame.mode : "–";
}

export function telemetryAge(frame) {
  return frame.age_s + (performance.now() - frame.heardAt) / 1000;
}

function drawMatch(summary) {
  const match = summary.plan_matches_rover;
  if (summary.plan.status !== "found" && !summary.sequence) mark("status-match", "none", "no plan");
  else if (summary.gate.state === "sending") mark("status-match", "warn", `executing row ${(summary.gate.row ?? 0) + 1}`);
  else if (match.ok === null) mark("status-match", "warn", "not known");
  else if (match.ok) mark("status-match", "good", "plan starts where the rover is");
  else mark("status-match", "bad", match.joint ? `${match.joint} differs by ${fixed(match.difference)} rad` : match.reason);
}

function drawStop(summary) {
  const button = $("stop");
  const latched = summary.stop.latched;
  if (latched) sent = false;
  button.dataset.sent = String(sent || latched);
  $("stop-clear").hidden = !latched;
  $("stop-state").textContent = sent
    ? "Stop request is being sent…"
    : !latched
      ? "Stop request. Not a safety-rated stop."
      : summary.stop.acknowledged
        ? "STOPPED, acknowledged by the rover. Not a safety-rated stop."
        : "Stop sent, NOT YET ACKNOWLEDGED.";
}
