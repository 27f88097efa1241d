// Sag: what to command so that a rover that gives way under load makes the planned step, and what is predicted of it.

import { act } from "../acts.js";
import { get, once, post, request } from "../api.js";
import { choices } from "../choices.js";
import { $, asTyped, attempt, element, fixed } from "../dom.js";
import { outOfDate } from "../fits.js";
import { answered } from "../planning.js";
import { keepFields, recallFields, rememberInSession } from "../remembered.js";
import { isAthletes } from "../robot.js";
import { changed, known, subscribe } from "../store.js";
import { refresh } from "../stream.js";
import { marginOf } from "../texts/plan.js";
import * as texts from "../texts/sag.js";
import * as shared from "../texts/shared.js";
import { balance } from "./ground.js";

let modes = {}; // mode → {title, text}, as the server has them

let shown = null; // the answer that the panel shows; it stays until the next, marked where it is out of date
let asked = ""; // its digest, as soon as it is asked for
let compared = ""; // the commands, and the stiffness in force, for which the measured sag was asked for
let calibration = null; // what that sag says of the joints

export function start() {
  $("execution-mode").addEventListener("change", describe);
  rememberInSession("execution-mode", ...fields().map(({ id }) => id));
  attempt(load);
  act({
    key: "B", text: texts.predict, button: "plan-execution", run: order,
    refusal: () => (known.summary?.plan.status === "found" ? "" : shared.noPlan),
  });
  act({
    key: "R", text: texts.compensate, button: "make-execution", run: make,
    refusal: () => (mayBeMade() ? "" : texts.noPrediction),
  });
  act({ text: texts.cancelPrediction, button: "execution-cancel", run: cancel, refusal: () => (runningJob() ? "" : texts.noPredictionRuns) });
  act({
    text: texts.takeOver, button: "take-over", run: takeOver,
    refusal: () => (mayBeTaken() ? "" : texts.nothingToTakeOver),
  });
  subscribe(draw);
}

async function load() {
  const { execution_modes: offered, execution_settings: delivered } = await choices();
  modes = Object.fromEntries(offered.map((one) => [one.mode, one]));
  $("execution-mode").replaceChildren(...offered.map(({ mode, title }) => element("option", { value: mode, textContent: title })));
  for (const field of fields()) field.placeholder = (delivered[nameOf(field)] ?? delivered.compliance[nameOf(field)]).toString();
  recallFields();
  describe();
}

// Of a mode, for a person; its own name until the server has told the others.
export const titleOf = (mode) => modes[mode]?.title ?? mode;

function describe() {
  const text = modes[$("execution-mode").value]?.text ?? "";
  if ($("execution-mode-text").textContent !== text) $("execution-mode-text").textContent = text;
}

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
  if (!summary || !isAthletes()) return;
  describe(); // the mode may be that of before a reload
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
  if (!ofPresentPlan()) return texts.ofAnotherPlan;
  const fit = shown.digest === summary.execution.digest ? summary.up_to_date.execution : null;
  return outOfDate(fit) ? texts.outOfDate(outOfDate(fit)) : "";
}

function drawAnswer({ status, reason, checks, settings: used, execution, figures }) {
  const found = status === "found";
  const mode = titleOf(used.mode);
  $("execution-answer").className = found ? "yes" : "no";
  $("execution-answer").textContent = found
    ? texts.canBeCommanded(mode)
    : texts.notToBeSent(mode, reason);
  for (const id of ["execution-lift", "execution-figures", "execution-loads"]) $(id).hidden = !execution;
  $("execution-checks-box").hidden = checks.length === 0;
  $("execution-checks-box").open = !found && checks.length > 0;
  $("execution-checks").tBodies[0].replaceChildren(...checks.map((check) =>
    element("tr", {},
      element("td", { className: check.holds ? "yes" : "no", textContent: check.name }),
      element("td", { textContent: marginOf(check) }),
      element("td", { textContent: check.where }))));
  if (!execution) return;
  const [className, textContent] = leaving(execution, figures, used);
  Object.assign($("execution-lift"), { className, textContent });
  $("execution-figures").tBodies[0].replaceChildren(...told(execution, figures, used).map(([name, text]) =>
    element("tr", {}, element("th", { scope: "row", textContent: name }), element("td", { textContent: text }))));
  drawLoads(execution);
}

// Whether the wheel leaves the ground, as a class and in words.
function leaving(execution, { clearance, clearance_uncertainty: less }, { tolerance }) {
  if (clearance <= 0) return ["no", texts.stays(lift(execution), -clearance)];
  if (less === null) return ["doubt", texts.fallsIfSofter(tolerance)];
  if (clearance - less <= 0) return ["doubt", texts.staysIfSofter(tolerance)];
  return ["yes", texts.leaves];
}

const lift = ({ plan }) => plan.provenance.settings.lift;

function told(execution, figures, used) {
  const wanted = ofPresentPlan() ? known.plan.plan.provenance.settings.lift : null;
  return [
    [texts.lowest, texts.lowestTold(figures, used.tolerance)],
    [texts.commandedLift, texts.liftTold(lift(execution), wanted)],
    [texts.touchDown, texts.touchDownTold(figures.touch_down_offset)],
    [texts.frictionUsed, texts.frictionTold(figures.friction_use)],
    [texts.chassis, texts.chassisTold(Math.max(...figures.sag), tilt(execution.Ts_site_base))],
    [texts.takes, texts.takesTold(figures.seconds)],
    [shared.assumptions, texts.assumptionsTold(used.compliance)],
  ];
}

// Largest angle by which the chassis' up leans away from where it pointed at the start [rad].
function tilt(poses) {
  const up = poses.map((pose) => pose.slice(0, 3).map((row) => row[2]));
  const along = up.map((one) => one.reduce((sum, part, i) => sum + part * up[0][i], 0));
  return Math.acos(Math.min(1, ...along));
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
      element("th", { scope: "row", textContent: leg === moving ? texts.moves(leg) : leg }),
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
  if (sag) $("execution-measured").textContent = texts.measured(sag.ratio, sag.rows.length);
  calibration = sag?.calibration ?? null;
  $("calibration").hidden = !sag;
  $("calibration-text").textContent = calibration ? toldCalibration(calibration) : sag?.refused ?? "";
  changed();
}

const toldCalibration = (measured) => (same(measured) ? texts.stiffnessAsMeasured(measured.was) : texts.stiffnessDiffers(measured));

const same = ({ was, now }) => Math.abs(now - was) < 1e-6 * was;

const mayBeTaken = () => calibration !== null && !same(calibration);

const rounded = (scale) => String(Number(asTyped(scale, 4)));

// A scale that is typed stands above what is taken over: it goes, so that what is said counts. Undo brings back the old.
const takeOver = () => attempt(async () => {
  await post("/sessions/current/sag/take-over", { joint_scale: calibration.now });
  $("sag-joint_scale").value = "";
  keepFields();
  await refresh();
});
