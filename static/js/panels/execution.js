// Sag: what to command so that a rover that gives way under load makes the planned step, and what is predicted of it.

import { act } from "../acts.js";
import { get, once, post, request } from "../api.js";
import { choices } from "../choices.js";
import { $, attempt, element, fixed } from "../dom.js";
import { outOfDate } from "../fits.js";
import { answered } from "../planning.js";
import { changed, known, subscribe } from "../store.js";
import { refresh } from "../stream.js";
import { balance } from "./ground.js";

let modes = {}; // mode → {title, text}, as the server has them

let shown = null; // the answer that the panel shows; it stays until the next, marked where it is out of date
let asked = ""; // its digest, as soon as it is asked for
let compared = ""; // the commands, and the stiffness in force, for which the measured sag was asked for
let calibration = null; // what that sag says of the joints

export function start() {
  $("execution-mode").addEventListener("change", describe);
  attempt(load);
  act({
    key: "B", text: "Predict the sag of the planned step", button: "plan-execution", run: order,
    refusal: () => (known.summary?.plan.status === "found" ? "" : "There is no plan yet: plan the step first."),
  });
  act({
    key: "R", text: "Compensate for sag", button: "make-execution", run: make,
    refusal: () => (mayBeMade() ? "" : "There is no prediction that can be commanded: predict the sag of the present plan first."),
  });
  act({ text: "Cancel the prediction of sag", button: "execution-cancel", run: cancel, refusal: () => (runningJob() ? "" : "No prediction is running.") });
  act({
    text: "Take over the measured stiffness of the joints", button: "take-over", run: takeOver,
    refusal: () => (mayBeTaken() ? "" : "There is no measured stiffness that is not taken over already."),
  });
  subscribe(draw);
}

async function load() {
  const { execution_modes: offered, execution_settings: delivered } = await choices();
  modes = Object.fromEntries(offered.map((one) => [one.mode, one]));
  $("execution-mode").replaceChildren(...offered.map(({ mode, title }) => element("option", { value: mode, textContent: title })));
  for (const field of fields()) field.placeholder = (delivered[nameOf(field)] ?? delivered.compliance[nameOf(field)]).toString();
  describe();
}

// Of a mode, for a person; its own name until the server has told the others.
export const titleOf = (mode) => modes[mode]?.title ?? mode;

const describe = () => { $("execution-mode-text").textContent = modes[$("execution-mode").value].text; };

const SCALES = ["joint_scale", "wheel_scale"];

const fields = () => [...$("execution-settings").querySelectorAll("input")];
const nameOf = (field) => field.id.replace("sag-", "");

// An empty field stands for what is delivered; of the joints' stiffness, for what was taken over. Sag is that under the balance assumptions.
// mode: null: the chosen one
export function sagSettings(mode = null) {
  const chosen = { mode: mode ?? ($("execution-mode").value || "pose_held"), compliance: { balance: balance() } };
  for (const field of fields()) {
    const name = nameOf(field);
    if (field.value !== "") (SCALES.includes(name) ? chosen.compliance : chosen)[name] = Number(field.value);
  }
  return chosen;
}

const order = () => attempt(async () => {
  await answered();
  await post("/sessions/current/executions", { plan: known.summary.plan.digest, settings: sagSettings() });
});

const jobsThatAre = (...states) => [...known.jobs.values()].filter(({ kind, state }) => kind === "execution" && states.includes(state));

const runningJob = () => jobsThatAre("queued", "running").at(-1);

// An answer for another plan than the present is no execution of the session's, but it was asked for.
const latest = () => jobsThatAre("done").at(-1)?.result;

const cancel = () => attempt(async () => {
  const job = runningJob();
  if (job) await request("DELETE", `/jobs/${job.id}`);
});

const make = () => attempt(async () => {
  await post("/sessions/current/sequences", { execution: shown.digest }, once());
  await refresh();
});

const ofPresentPlan = () => shown.parents.plan === known.plan?.plan?.digest;

const mayBeMade = () => shown?.status === "found" && ofPresentPlan();

function draw({ summary }) {
  if (!summary) return;
  const job = runningJob();
  $("execution-job").hidden = !job;
  if (job) {
    $("execution-progress").value = job.fraction;
    $("execution-job-text").textContent = job.text || job.state;
  }
  const doubt = shown ? outdated(summary) : "";
  $("execution-doubt").hidden = !doubt;
  $("execution-doubt").textContent = doubt;
  const digest = summary.execution.digest ?? latest();
  if (digest && digest !== asked) read(digest);
  compare(summary);
}

const read = (digest) => attempt(async () => {
  asked = digest;
  const answer = await get(`/sessions/current/executions/${digest}`).catch((error) => {
    if (asked === digest) asked = ""; // the next summary asks again
    throw error;
  });
  if (asked !== digest) return; // another one is there by now
  shown = answer;
  drawAnswer(answer);
  changed();
});

function outdated(summary) {
  if (!ofPresentPlan()) return "Out of date: this is for another plan than the present one.";
  const fit = shown.digest === summary.execution.digest ? summary.up_to_date.execution : null;
  return outOfDate(fit) ? `Out of date: ${outOfDate(fit)}.` : "";
}

function drawAnswer({ status, reason, checks, settings: used, execution, figures }) {
  const found = status === "found";
  const mode = titleOf(used.mode);
  $("execution-answer").className = found ? "yes" : "no";
  $("execution-answer").textContent = found
    ? `Can be commanded, ${mode}. Every check holds.`
    : `Not to be sent, ${mode}: ${reason}`;
  for (const id of ["execution-lift", "execution-figures", "execution-loads"]) $(id).hidden = !execution;
  $("execution-checks-box").hidden = checks.length === 0;
  $("execution-checks-box").open = !found && checks.length > 0;
  $("execution-checks").tBodies[0].replaceChildren(...checks.map((check) =>
    element("tr", {},
      element("td", { className: check.holds ? "yes" : "no", textContent: check.name }),
      element("td", { textContent: check.margin === null ? "–" : `${fixed(check.margin)} ${check.unit}` }),
      element("td", { textContent: check.where }))));
  if (!execution) return;
  const [className, textContent] = leaving(execution, figures, used);
  Object.assign($("execution-lift"), { className, textContent });
  $("execution-figures").tBodies[0].replaceChildren(...told(execution, figures, used).map(([name, text]) =>
    element("tr", {}, element("th", { scope: "row", textContent: name }), element("td", { textContent: text }))));
  drawLoads(execution);
}

const softer = ({ tolerance }) => `with springs ${fixed(100 * tolerance, 0)} % softer`;

// Whether the wheel leaves the ground, the first thing to know of a rover that sags.
function leaving(execution, { clearance, clearance_uncertainty: less }, used) {
  if (clearance <= 0) {
    return ["no", `The wheel will not leave the ground: lifted by ${fixed(lift(execution))} m, it is still ${fixed(-clearance)} m too low.`];
  }
  if (less === null) return ["doubt", `The wheel leaves the ground, but ${softer(used)} the rover would not stand.`];
  if (clearance - less <= 0) return ["doubt", `The wheel leaves the ground, but ${softer(used)} it would not.`];
  return ["yes", "The wheel leaves the ground."];
}

const lift = ({ plan }) => plan.provenance.settings.lift;

function told(execution, figures, used) {
  const less = figures.clearance_uncertainty;
  const wanted = ofPresentPlan() ? known.plan.plan.provenance.settings.lift : null;
  const { friction, gravity, payload_mass: payload } = used.compliance.balance;
  return [
    ["Lowest in the swing", (figures.clearance > 0 ? `${fixed(figures.clearance)} m above the ground, ` : `${fixed(-figures.clearance)} m too low, `)
      + (less === null ? `not known ${softer(used)}` : `${fixed(Math.abs(less))} m ${less < 0 ? "more" : "less"} ${softer(used)}`)],
    ["Commanded lift", `${fixed(lift(execution))} m${wanted !== null && lift(execution) > wanted ? `, raised from ${fixed(wanted)} m` : ""}`],
    ["Touch-down", figures.touch_down_offset === null
      ? "none: the wheel never touches the ground" : `${fixed(figures.touch_down_offset)} m from the planned contact`],
    ["Friction used", `${fixed(100 * figures.friction_use, 1)} % at most`],
    ["Chassis", `sags ${fixed(Math.max(...figures.sag))} m, tilts ${fixed(tilt(execution.Ts_site_base), 2)}° at most`],
    ["It takes", `${fixed(figures.seconds, 1)} s`],
    ["Balance assumptions", `μ ${friction}, ${gravity} m/s², ${payload === null ? "payload as described" : `payload ${payload} kg`}, `
      + `joints ${fixed(used.compliance.joint_scale, 2)} × and wheels ${fixed(used.compliance.wheel_scale, 2)} × as stiff`],
  ];
}

// Largest angle by which the chassis' up leans away from where it pointed at the start [°].
function tilt(poses) {
  const up = poses.map((pose) => pose.slice(0, 3).map((row) => row[2]));
  const along = up.map((one) => one.reduce((sum, part, i) => sum + part * up[0][i], 0));
  return Math.acos(Math.min(1, ...along)) * 180 / Math.PI;
}

function drawLoads({ leg: moving, loads }) {
  const legs = loads[0].map((_, leg) => loads.map((row) => row[leg]));
  const largest = Math.max(...legs.flat());
  $("execution-loads").tBodies[0].replaceChildren(...legs.map((own, leg) => {
    const [least, most] = [Math.min(...own), Math.max(...own)];
    const bar = element("i");
    bar.style.left = `${100 * Math.max(0, least) / largest}%`;
    bar.style.right = `${100 - 100 * most / largest}%`;
    return element("tr", {},
      element("th", { scope: "row", textContent: leg === moving ? `${leg} moves` : leg }),
      element("td", { textContent: fixed(least, 0) }), element("td", { className: "load" }, bar), element("td", { textContent: fixed(most, 0) }));
  }));
}

// After the rover has moved: how far it gave way against what was predicted. Nothing is said where nothing can be.
async function compare(summary) {
  $("sag-joint_scale").placeholder = rounded(summary.joint_scale);
  const done = summary.commands.filter(({ state }) => state === "done").map(({ id }) => id).join();
  const now = `${done} ${summary.joint_scale}`;
  if (!done || summary.gate.state === "sending" || now === compared) return;
  compared = now;
  const sag = await get("/sessions/current/sag").catch(() => null);
  if (now !== compared) return;
  $("execution-measured").hidden = !sag;
  if (sag) $("execution-measured").textContent = `Measured sag is ${fixed(sag.ratio, 2)} times the predicted, at ${sag.rows.length} pauses of the latest run.`;
  calibration = sag?.calibration ?? null;
  $("calibration").hidden = !sag;
  $("calibration-text").textContent = calibration ? toldCalibration(calibration) : sag?.refused ?? "";
  changed();
}

const toldCalibration = ({ was, now, steps, ratio }) => (same({ was, now })
  ? `Joints are taken to be ${fixed(was, 2)} × as stiff as described, as measured.`
  : `Joint stiffness: ${fixed(was, 2)} × is taken, ${fixed(now, 2)} × was measured, by ${steps} step${steps === 1 ? "" : "s"} of mean ratio ${fixed(ratio, 2)}.`);

const same = ({ was, now }) => Math.abs(now - was) < 1e-6 * was;

const mayBeTaken = () => calibration !== null && !same(calibration);

const rounded = (scale) => String(Number(scale.toFixed(4)));

// A scale that is typed stands above what is taken over: it goes, so that what is said counts. Undo brings back the old.
const takeOver = () => attempt(async () => {
  await post("/sessions/current/sag/take-over", { joint_scale: calibration.now });
  $("sag-joint_scale").value = "";
  await refresh();
});
