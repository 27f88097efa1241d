// Plan: ask for it, follow it, cancel it, and read which checks held and by how much.

import { post, request } from "../api.js";
import { $, attempt, element, fixed } from "../dom.js";
import { bind } from "../keys.js";
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
  await post("/sessions/current/state", {}).catch((error) => {
    if (!known.summary.state) throw error;
  });
  const settings = { planner: $("planner").value, seed: Number($("seed").value), conservative: $("conservative").checked };
  for (const name of NUMBERS) settings[name] = Number($(`set-${name}`).value);
  await post("/sessions/current/plans", { leg: chosen.leg, target: [chosen.x, chosen.y], settings });
});

function runningJob() {
  const alive = (job) => job.state === "queued" || job.state === "running";
  for (const job of known.summary?.jobs ?? []) if (!known.jobs.has(job.id)) known.jobs.set(job.id, job);
  return [...known.jobs.values()].filter(alive).at(-1);
}

const cancel = () => attempt(async () => {
  const job = runningJob();
  if (job) await request("DELETE", `/jobs/${job.id}`);
});

let shownFailure = "";

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
        element("td", { className: check.holds ? "yes" : "no", textContent: check.name }),
        element("td", { textContent: check.margin === null ? "–" : `${fixed(check.margin)} ${check.unit}` }),
        element("td", { textContent: check.where }))),
  );
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
  const last = [...known.jobs.values()].at(-1);
  if (last?.state === "failed" && last.id !== shownFailure) {
    shownFailure = last.id;
    attempt(async () => { throw new Error(`${last.kind} failed: ${last.error?.message ?? "no reason was given"}`); });
  }
}
