// The status bar: link and age, mode, ground and its age, whether the plan still matches the rover, and stop.

import { post, request } from "../api.js";
import { $, age, attempt, toast } from "../dom.js";
import { known, subscribe } from "../store.js";

const STALE_AFTER = 2; // seconds; the command gate refuses beyond this too

const SILENT_AFTER = 5; // seconds
const STOP_PATIENCE = 3000; // ms

let sent = ""; // "", or "sending", "failed": a stop request of this page that the summary does not show yet

export async function stop() {
  sent = "sending";
  draw();
  try {
    await request("POST", "/stop", {}, {}, STOP_PATIENCE);
  } catch (error) {
    sent = "failed";
    toast(`The stop request is not confirmed: ${error.message} Use another way to stop the rover.`);
  }
  draw();
}

export function start() {
  $("stop").addEventListener("click", stop);
  $("stop-clear").addEventListener("click", () => attempt(async () => {
    await post("/stop/clear", {});
    sent = "";
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
  const silent = (performance.now() - known.heardAt) / 1000;
  const alive = connected && silent < SILENT_AFTER;
  mark("status-server", alive ? "good" : "bad", alive ? "connected" : `silent for ${age(silent)}`);
  if (!summary) {
    if (sent) $("stop-state").textContent = STOP_TEXT[sent];
    return;
  }
  $("status-session").textContent = summary.name;
  drawLink(summary, frame);
  drawMatch(summary, frame);
  drawStop(summary, frame);
}

function drawLink(summary, frame) {
  if (!summary.link.connected) {
    const silent = frame ? telemetryAge(frame) : summary.link.age_s;
    mark("status-link", "bad", silent === null ? "no rover" : `LOST, last heard ${age(silent)} ago`);
  } else if (!frame) {
    mark("status-link", "warn", "no telemetry yet");
  } else {
    const old = telemetryAge(frame);
    const counted = ["gaps", "late", "restarts"].filter((one) => summary.link[one]).map((one) => `, ${summary.link[one]} ${one}`);
    mark("status-link", old > STALE_AFTER ? "stale" : "good", `${old > STALE_AFTER ? "STALE " : ""}${age(old)} old${counted.join("")}`);
  }
  $("status-link").title = summary.link.fault ? `${summary.link.faults} faults, the latest: ${summary.link.fault}` : "";
  // what the rover was when it was last heard is not what it is
  const fresh = frame && isFresh(summary, frame);
  mark("status-mode", frame && !fresh ? "stale" : "none", !frame ? "–" : fresh ? frame.mode : `was ${frame.mode}`);
}

const isFresh = (summary, frame) => summary.link.connected && telemetryAge(frame) <= STALE_AFTER;

export function telemetryAge(frame) {
  return frame.age_s + (performance.now() - frame.heardAt) / 1000;
}

function drawMatch(summary, frame) {
  const match = summary.plan_matches_rover;
  if (summary.plan.status !== "found" && !summary.sequence) mark("status-match", "none", "no plan");
  else if (summary.gate.state === "sending") mark("status-match", "warn", `executing row ${(summary.gate.row ?? 0) + 1}`);
  else if (match.ok === null || !frame || !isFresh(summary, frame)) mark("status-match", "warn", "not known");
  else if (match.ok) mark("status-match", "good", "plan starts where the rover is");
  else mark("status-match", "bad", match.reason);
}

const STOP_TEXT = {
  sending: "Stop request is being sent…",
  failed: "STOP NOT CONFIRMED: the server did not answer. Use another way to stop the rover.",
};

function drawStop(summary, frame) {
  const button = $("stop");
  const { latched, acknowledged } = summary.stop;
  if (latched) sent = "";
  const standing = frame?.mode === "stopped"; // by another session or another operator, perhaps
  button.dataset.sent = String(Boolean(sent) || latched);
  $("stop-clear").hidden = !latched && !standing;
  $("stop-state").textContent = sent ? STOP_TEXT[sent] : stopText(latched, acknowledged, summary.link.connected, standing);
}

function stopText(latched, acknowledged, connected, standing) {
  if (!latched) {
    return standing ? "The rover is STOPPED; clear the stop to move it." : "Stop request. Not a safety-rated stop.";
  }
  if (acknowledged) return "STOPPED: sent and acknowledged by the rover. Not a safety-rated stop.";
  return connected
    ? "Stop sent, NOT YET ACKNOWLEDGED by the rover."
    : "Stop in force, but NO ROVER IS CONNECTED: it is told when it connects.";
}
