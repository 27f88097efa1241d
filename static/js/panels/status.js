// The status bar: link and age, mode, ground and its age, whether the plan still matches the rover, and stop.

import { act } from "../acts.js";
import { post } from "../api.js";
import { $, attempt, toast } from "../dom.js";
import { isAthletes, slides } from "../robot.js";
import { steadyMode } from "../steadymode.js";
import { askToStop, isNothingToStop, keepLineOpen } from "../stopline.js";
import { stopIsConfirmed, stopIsUnconfirmed, stopIsWished } from "../stopwish.js";
import { STALE_AFTER, alive, known, silent, subscribe, telemetryAge } from "../store.js";
import * as texts from "../texts/link.js";
import * as shared from "../texts/shared.js";
import { kept } from "./conn.js";
import { verdictOf } from "./outcome.js";
import { toldApart } from "./sessions.js";

const STOP_PATIENCE = 3000; // ms
const STOP_AGAIN = 500; // ms

let sent = ""; // "", or "sending", "failed", "nothing": a stop request of this page that the summary does not show yet
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
      if (isNothingToStop(error)) {
        sent = "nothing";
        confirmed = meant;
        continue;
      }
      if (sent !== "failed") toast(texts.notConfirmed(error.message));
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
  act({ text: texts.clearStop, button: "stop-clear", run: clearStop, refusal: () => (standsStopped(known) ? "" : texts.noStop) });
  subscribe(draw);
  if (stopIsUnconfirmed()) stop(); // asked for before this page was loaded again
}

const clearStop = () => attempt(async () => {
  await post("/stop/clear", {}).catch((problem) => {
    throw problem.body.check === "conn" && kept() ? new Error(kept()) : problem; // the server calls two pages of a computer alike
  });
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
  mark("status-server", alive() ? "good" : "bad", alive() ? texts.connected : texts.silentFor(silent()));
  if (!summary) {
    if (sent) $("stop-state").textContent = STOP_TEXT[sent];
    return;
  }
  if (alive() && summary.unrecorded) mark("status-server", "bad", texts.notWritten(summary.unrecorded));
  $("status-session").textContent = toldApart(summary);
  $("status-session").title = `${summary.name}, ${summary.id}`;
  drawLink(summary, frame);
  drawMatch(summary, frame);
  drawStop(summary, frame);
}

function drawLink(summary, frame) {
  const { link } = summary;
  const old = frame ? telemetryAge(frame) : link.age_s === null ? null : link.age_s + silent();
  const light = link.light_time.telemetry_s ? texts.onTheWay(link.light_time.telemetry_s) : "";
  if (!link.connected && frame && old <= STALE_AFTER) {
    mark("status-link", "warn", texts.telemetryOnly(old, light));
  } else if (!link.connected) {
    mark("status-link", "bad", old === null ? texts.noRoverYet : texts.lost(old));
  } else if (!frame) {
    mark("status-link", "warn", texts.noTelemetryYet);
  } else {
    const counted = ["gaps", "late", "restarts", "faults"].filter((one) => link[one]).map((one) => texts.counted(link[one], one));
    mark("status-link", old > STALE_AFTER ? "stale" : "good", texts.heard(old > STALE_AFTER ? texts.stale : "", old, light, counted.join("")));
  }
  $("status-link").title = linkDetails(link);
  // what the rover was when it was last heard is not what it is
  const fresh = frame && isFresh(summary, frame);
  const mode = fresh ? modeTold(summary, frame) : frame?.mode;
  mark("status-mode", !frame ? "none" : fresh ? MODES[mode] ?? "none" : "stale", !frame ? "–" : fresh ? mode : texts.was(mode));
}

function linkDetails({ fault, faults, faults_by_kind: kinds, light_time: light }) {
  const lines = [];
  if (light.round_trip_s) lines.push(texts.lightTime(light.telemetry_s, light.commands_s));
  if (fault) lines.push(texts.faults(faults, Object.entries(kinds).map(([kind, count]) => texts.kindOfFaults(kind, count)).join(", "), fault));
  return lines.join("\n");
}

// What is known of the latest message of a type that can't have been answered yet; null where there is none.
function onItsWay(summary, type) {
  const passed = (performance.now() - summary.heardAt) / 1000;
  const message = summary.link.on_the_way.findLast((one) => one.type === type);
  if (!message || message.answer_in_s <= passed) return null;
  const arrives = message.arrives_in_s - passed;
  return (arrives > 0 ? texts.arrivesIn(arrives) : texts.shouldBeThere) + texts.answerIn(message.answer_in_s - passed);
}

const MODES = { moving: "busy", stopped: "bad", fault: "bad" };

let movedAt = -Infinity;

function modeTold({ gate }, { mode }) {
  if (mode === "moving") movedAt = performance.now();
  return steadyMode(mode, gate, performance.now() - movedAt);
}

const isFresh = (summary, frame) => summary.link.connected && telemetryAge(frame) <= STALE_AFTER;

function drawMatch(summary, frame) {
  const match = summary.plan_matches_rover;
  if (summary.plan.status !== "found" && !summary.sequence) mark("status-match", "none", shared.noPlanShort);
  else if (!alive()) mark("status-match", "stale", texts.notKnownFor(silent()));
  else if (summary.gate.state === "sending") drawRun(summary);
  else if (summary.plan.digest && summary.plan.status !== "found" && summary.commands_of_another_plan) mark("status-match", "warn", shared.planRefused);
  else if (match.ok === null || !frame || !isFresh(summary, frame)) mark("status-match", "warn", shared.notKnown);
  else if (match.ok && match.older_ground) mark("status-match", "warn", texts.onOlderGround);
  else if (match.ok) {
    mark("status-match", "good", match.reason ? texts.nearEnough : texts.startsHere);
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
  const [, leg, name] = /^leg(\d+)_(.*?)(?:_joint)?$/.exec(joint) ?? [];
  const told = isAthletes() && leg ? texts.jointOfLeg(leg, name.replaceAll("_", " ")) : joint;
  if (slides(known.robot.joint_names.indexOf(joint))) return texts.slideOff(told, difference);
  return texts.jointOff(told, (difference * 180) / Math.PI);
}

// What is meant to happen is no warning; what waits for somebody is one.
function drawRun(summary) {
  const { waiting, row } = summary.gate;
  const of = summary.run ? texts.ofRows(summary.run.rows.length) : "";
  mark("status-match", waiting ? "warn" : "busy", texts.atRow(waiting ? texts.waitingBefore : texts.executing, (row ?? 0) + 1, of, wayOf(summary)));
}

const carriedOut = ({ run, sequence, commands_of_another_plan: other }) => !other && sequence !== null && run?.sequence === sequence && run.rows.length > 0 && run.rows.every((row) => row.state === "done");

function wayOf(summary) {
  const way = onItsWay(summary, "command");
  return way ? `: ${way}` : "";
}

const STOP_TEXT = {
  sending: texts.stopSending,
  failed: texts.stopFailed,
  nothing: texts.nothingToStop,
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
    return standing ? texts.standsStopped : texts.noSafetyStop;
  }
  if (!alive()) return texts.stopBefore(silent(), acknowledged ? texts.acknowledgedBefore : texts.notAcknowledgedBefore);
  if (acknowledged) return texts.stopAcknowledged;
  const way = onItsWay(summary, "stop");
  if (way) return texts.stopOnItsWay(way);
  return summary.link.connected
    ? texts.stopNotAcknowledged
    : texts.stopWithoutRover;
}
