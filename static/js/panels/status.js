// The status bar: link and age, mode, ground and its age, whether the plan still matches the rover, and stop.

import { act } from "../acts.js";
import { post } from "../api.js";
import { $, age, attempt, signed, toast } from "../dom.js";
import { askToStop, keepLineOpen } from "../stopline.js";
import { stopIsConfirmed, stopIsUnconfirmed, stopIsWished } from "../stopwish.js";
import { alive, known, silent, subscribe } from "../store.js";
import { verdictOf } from "./outcome.js";
import { toldApart } from "./sessions.js";

const STALE_AFTER = 2; // seconds; the command gate refuses beyond this too

const STOP_PATIENCE = 3000; // ms
const STOP_AGAIN = 500; // ms

let sent = ""; // "", or "sending", "failed": a stop request of this page that the summary does not show yet
let asking = false;
let wished = 0; // how often a stop was asked for here
let confirmed = 0; // how many of these the server has answered

// Asks until the server has confirmed it: nobody should have to press twice. Stopping twice is as good as once, and who
// asks while an answer is on its way may have seen the stop before cleared by another: it is asked once more.
export async function stop() {
  sent = "sending";
  wished += 1;
  draw();
  if (asking) return;
  asking = true;
  stopIsWished();
  while (confirmed < wished) {
    const meant = wished;
    try {
      await askToStop(STOP_PATIENCE);
      confirmed = meant;
    } catch (error) {
      if (sent !== "failed") toast(`The stop request is not confirmed: ${error.message} Use another way to stop the rover.`);
      sent = "failed";
      draw();
      await new Promise((resolve) => setTimeout(resolve, STOP_AGAIN));
    }
  }
  asking = false;
  stopIsConfirmed();
  if (sent === "failed") sent = "sending"; // confirmed at last; the summary will show it
  draw();
}

export function start() {
  keepLineOpen();
  $("stop").addEventListener("click", stop);
  act({ text: "Clear the stop", button: "stop-clear", run: clearStop, refusal: () => (standsStopped(known) ? "" : "No stop is in force.") });
  subscribe(draw);
  if (stopIsUnconfirmed()) stop(); // asked for before this page was loaded again
}

const clearStop = () => attempt(async () => {
  await post("/stop/clear", {});
  sent = "";
});

// By this session, or by another one or another operator.
export const standsStopped = ({ summary, frame }) => Boolean(summary?.stop.latched) || frame?.mode === "stopped";

function mark(id, state, text) {
  $(id).dataset.state = state;
  $(id).textContent = text;
  $(id).title = text; // where the bar is too narrow to show it all
}

function draw() {
  const { summary, frame } = known;
  mark("status-server", alive() ? "good" : "bad", alive() ? "connected" : `silent for ${age(silent())}`);
  if (!summary) {
    if (sent) $("stop-state").textContent = STOP_TEXT[sent];
    return;
  }
  if (alive() && summary.unrecorded) mark("status-server", "bad", `connected, ${summary.unrecorded} events NOT WRITTEN`);
  $("status-session").textContent = toldApart(summary);
  $("status-session").title = `${summary.name}, ${summary.id}`;
  drawLink(summary, frame);
  drawMatch(summary, frame);
  drawStop(summary, frame);
}

function drawLink(summary, frame) {
  const { link } = summary;
  const old = frame ? telemetryAge(frame) : link.age_s === null ? null : link.age_s + silent();
  const light = link.light_time.telemetry_s ? ` + ${age(link.light_time.telemetry_s)} on the way` : "";
  if (!link.connected && frame && old <= STALE_AFTER) {
    mark("status-link", "warn", `telemetry only, can't be commanded, ${age(old)} old${light}`);
  } else if (!link.connected) {
    mark("status-link", "bad", old === null ? "no rover" : `LOST, last heard ${age(old)} ago`);
  } else if (!frame) {
    mark("status-link", "warn", "no telemetry yet");
  } else {
    const counted = ["gaps", "late", "restarts", "faults"].filter((one) => link[one]).map((one) => `, ${link[one]} ${link[one] === 1 ? one.replace(/s$/, "") : one}`);
    mark("status-link", old > STALE_AFTER ? "stale" : "good", `${old > STALE_AFTER ? "STALE " : ""}${age(old)} old${light}${counted.join("")}`);
  }
  $("status-link").title = linkDetails(link);
  // what the rover was when it was last heard is not what it is
  const fresh = frame && isFresh(summary, frame);
  const mode = fresh ? steadyMode(summary, frame) : frame?.mode;
  mark("status-mode", !frame ? "none" : fresh ? MODES[mode] ?? "none" : "stale", !frame ? "–" : fresh ? mode : `was ${mode}`);
}

function linkDetails({ fault, faults, faults_by_kind: kinds, light_time: light }) {
  const lines = [];
  if (light.round_trip_s) lines.push(`Light time: telemetry ${light.telemetry_s} s, commands ${light.commands_s} s.`);
  if (fault) lines.push(`${faults} faults (${Object.entries(kinds).map(([kind, count]) => `${kind}: ${count}`).join(", ")}), the latest: ${fault}`);
  return lines.join("\n");
}

// What is known of the latest message of a type that can't have been answered yet; null where there is none.
function onItsWay(summary, type) {
  const passed = (performance.now() - summary.heardAt) / 1000;
  const message = summary.link.on_the_way.findLast((one) => one.type === type);
  if (!message || message.answer_in_s <= passed) return null;
  const arrives = message.arrives_in_s - passed;
  return `${arrives > 0 ? `reaches the rover in ${age(arrives)}, ` : "should be there, "}`
    + `acknowledgement in ${age(message.answer_in_s - passed)} at the earliest`;
}

const MODES = { moving: "busy", stopped: "bad", fault: "bad" };

const BETWEEN = 2000; // ms
let movedAt = -Infinity;

// Between two rows of a run the rover is idle for a moment: that is told only where it lasts.
function steadyMode({ gate }, { mode }) {
  if (mode === "moving") movedAt = performance.now();
  const between = mode === "idle" && gate.state === "sending" && !gate.waiting && performance.now() - movedAt < BETWEEN;
  return between ? "moving" : mode;
}

const isFresh = (summary, frame) => summary.link.connected && telemetryAge(frame) <= STALE_AFTER;

export function telemetryAge(frame) {
  return frame.age_s + (performance.now() - frame.heardAt) / 1000;
}

function drawMatch(summary, frame) {
  const match = summary.plan_matches_rover;
  if (summary.plan.status !== "found" && !summary.sequence) mark("status-match", "none", "no plan");
  else if (!alive()) mark("status-match", "stale", `not known for ${age(silent())}`);
  else if (summary.gate.state === "sending") drawRun(summary);
  else if (summary.plan.digest && summary.plan.status !== "found" && summary.commands_of_another_plan) mark("status-match", "warn", "the plan was refused");
  else if (match.ok === null || !frame || !isFresh(summary, frame)) mark("status-match", "warn", "not known");
  else if (match.ok && match.older_ground) mark("status-match", "warn", "planned on older ground");
  else if (match.ok) {
    mark("status-match", "good", match.reason ? "plan starts near enough to the rover" : "plan starts where the rover is");
    if (match.reason) $("status-match").title = match.reason; // colours may be out of date all the same
  }
  else if (carriedOut(summary)) mark("status-match", ...verdictOf(summary.run.compared));
  else {
    mark("status-match", "bad", off(match));
    $("status-match").title = match.reason;
  }
}

// In few words; all of them show where the bar is pointed at.
function off({ joint, difference, reason }) {
  if (!reason.startsWith(joint)) return reason;
  const [, leg, name] = /^leg(\d+)_(.*?)(?:_joint)?$/.exec(joint) ?? [null, "", joint];
  const degrees = (difference * 180) / Math.PI;
  return `leg ${leg} ${name.replaceAll("_", " ")} off ${signed(degrees, 1)}°`;
}

// What is meant to happen is no warning; what waits for somebody is one.
function drawRun(summary) {
  const { waiting, row } = summary.gate;
  const of = summary.run ? ` of ${summary.run.rows.length}` : "";
  mark("status-match", waiting ? "warn" : "busy", `${waiting ? "waiting before" : "executing"} row ${(row ?? 0) + 1}${of}${wayOf(summary)}`);
}

const carriedOut = ({ run, sequence, commands_of_another_plan: other }) => !other && sequence !== null && run?.sequence === sequence && run.rows.length > 0 && run.rows.every((row) => row.state === "done");

function wayOf(summary) {
  const way = onItsWay(summary, "command");
  return way ? `: ${way}` : "";
}

const STOP_TEXT = {
  sending: "Stop request is being sent…",
  failed: "STOP NOT CONFIRMED: no answer, still asking. Use another way to stop the rover.",
};

function drawStop(summary, frame) {
  const button = $("stop");
  const { latched, acknowledged } = summary.stop;
  if (latched) sent = "";
  const standing = frame?.mode === "stopped";
  button.dataset.sent = String(Boolean(sent) || latched || standing);
  $("stop-clear").hidden = !standsStopped({ summary, frame });
  $("stop-state").className = sent || latched || standing ? "in-force" : "";
  $("stop-state").textContent = sent ? STOP_TEXT[sent] : stopText(summary, latched, acknowledged, standing);
}

function stopText(summary, latched, acknowledged, standing) {
  if (!latched) {
    return standing ? "The rover is STOPPED; clear the stop to move it." : "Stop request. Not a safety-rated stop.";
  }
  if (!alive()) return `Stop in force ${age(silent())} ago${acknowledged ? ", acknowledged by the rover" : ", NOT YET ACKNOWLEDGED"}; the server is silent since.`;
  if (acknowledged) return "STOPPED, acknowledged by the rover.";
  const way = onItsWay(summary, "stop");
  if (way) return `Stop sent: ${way}. NOT YET ACKNOWLEDGED.`;
  return summary.link.connected
    ? "Stop sent, NOT YET ACKNOWLEDGED by the rover."
    : "Stop in force, but NO ROVER IS CONNECTED: it is told when it connects.";
}
