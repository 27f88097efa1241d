// Plan: ask for it, follow it, cancel it, and read which checks held and by how much.

import { post, request } from "../api.js";
import { $, attempt, element, fixed, toast } from "../dom.js";
import { bind } from "../keys.js";
import { freeze } from "../stance.js";
import { known, subscribe } from "../store.js";

const NUMBERS = ["lift", "raise_terrain", "clearance", "least_margin", "radius", "milestones", "epsilon", "time_limit"];

export function start() {
  $("plan").addEventListener("click", plan);
  $("job-cancel").addEventListener("click", cancel);
  bind("P", "Plan the step", plan);
  bind("X", "Cancel the running job", cancel);
  subscribe(draw);
}

const plan = () => attempt(async () => {
  const chosen = known.summary.footfall;
  if (!chosen) throw new Error("Choose a footfall first: click on the ground.");
  await freeze();
  const settings = { planner: $("planner").value, seed: Number($("seed").value), conservative: $("conservative").checked };
  for (const name of NUMBERS) settings[name] = Number($(`set-${name}`).value);
  await post("/sessions/current/plans", { leg: chosen.leg, target: [chosen.x, chosen.y], settings });
});

function runningJob() {
  const alive = (job) => job.state === "queued" || job.state === "running";
  return [...known.jobs.values()].filter(alive).at(-1);
}

const cancel = () => attempt(async () => {
  const job = runningJob();
  if (job) await request("DELETE", `/jobs/${job.id}`);
});

let told = null; // ids of the failed jobs that were told, or had failed before this page opened

function draw({ summary, plan: result }) {
  if (!summary) return;
  const job = runningJob();
  $("job").hidden = !job;
  if (job) {
    $("job-progress").value = job.fraction;
    $("job-text").textContent = `${job.kind}: ${job.text || job.state}`;
  }
  drawFailure();
  const answer = $("plan-answer");
  if (!result) {
    $("plan-doubt").hidden = true;
    answer.className = "";
    answer.textContent = "";
    $("checks").hidden = true;
    return;
  }
  const found = result.status === "found";
  const doubt = outdated(summary, result);
  answer.className = found ? "yes" : "no";
  answer.textContent = found
    ? `Found by ${result.plan.planner}: ${result.plan.waypoints.length} waypoints. ${result.reason}`
    : `No plan (${result.status.replaceAll("_", " ")}): ${result.reason}`;
  $("plan-doubt").hidden = !doubt;
  $("plan-doubt").textContent = doubt;
  $("checks").hidden = result.checks.length === 0;
  $("checks").tBodies[0].replaceChildren(
    ...result.checks.map((check) =>
      element("tr", {},
        element("td", { className: mark(check), textContent: check.name }),
        element("td", { textContent: check.margin === null ? "–" : `${fixed(check.margin)} ${check.unit}` }),
        element("td", { textContent: check.where }))),
  );
}

// Ground that nobody has seen is no reason against a plan, and none for it either.
function mark({ name, holds, where }) {
  if (!holds) return "no";
  return name === "unknown ground under the path" && where !== "none" ? "doubt" : "yes";
}

// What is shown may no longer be what is wanted: say so instead of hiding it.
function outdated(summary, { footfall, provenance }) {
  const chosen = summary.footfall;
  if (chosen && (chosen.leg !== footfall.leg || chosen.x !== footfall.x || chosen.y !== footfall.y)) {
    return `This answer is for leg ${footfall.leg} at (${fixed(footfall.x)}, ${fixed(footfall.y)}) m, not for the chosen footfall.`;
  }
  if (provenance.parents.dem !== summary.dem) return "This answer is for an older terrain.";
  if (provenance.parents.state !== summary.state) return "This answer is for an older state of the rover.";
  return "";
}

// A failed job is told once; cancelled ones were the operator's wish.
function drawFailure() {
  const failed = [...known.jobs.values()].filter((job) => job.state === "failed");
  told ??= new Set(failed.map((job) => job.id));
  for (const job of failed) {
    if (told.has(job.id)) continue;
    told.add(job.id);
    toast(`${job.kind} failed: ${job.error?.message ?? "no reason was given"}`);
  }
}
