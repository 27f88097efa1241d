// Plan: ask for it, and read which checks held and by how much.

import { act } from "../acts.js";
import { get, post } from "../api.js";
import { chooseFootfall, settled } from "../choosing.js";
import { $, attempt, element } from "../dom.js";
import { isOfAnother, outOfDate } from "../fits.js";
import { askForPlan } from "../planning.js";
import { keepFields, recallFields, rememberInSession } from "../remembered.js";
import { isAthletes, orders } from "../robot.js";
import { freeze } from "../stance.js";
import { known, subscribe } from "../store.js";
import * as texts from "../texts/plan.js";
import * as shared from "../texts/shared.js";
import * as alternatives from "./alternatives.js";
import * as queue from "./queue.js";
import { settled as inHand } from "./hand.js";
import * as through from "./through.js";

let served = { planners: {}, settings: {} }; // what a plan can be asked for with, as the server knows it

export function start() {
  attempt(load);
  $("planner").addEventListener("change", describe);
  rememberInSession("planner", "seed", ...fields().map(({ id }) => id));
  act({ text: texts.settingsAsDelivered, button: "plan-defaults", run: () => { fill(); keepFields(); } });
  act({ key: "P", text: texts.planStep, button: "plan", run: plan, refusal: () => (known.summary?.footfall ? "" : shared.chooseFootfall) });
  act({
    key: "+", text: texts.nearestInstead, button: "nearest-place", run: stepToNearest,
    refusal: () => (nearestGood() ? "" : texts.noGoodPlace),
  });
  subscribe(draw);
  through.start();
  alternatives.start();
  queue.start();
}

async function load() {
  served = await get("/planners");
  $("planner").replaceChildren(...Object.keys(served.planners).map((name) => element("option", { textContent: name })));
  fill();
  recallFields();
  describe();
}

function describe() {
  const text = served.planners[$("planner").value] ?? "";
  if ($("planner-text").textContent !== text) $("planner-text").textContent = text;
}

const fields = () => [...$("plan-settings").querySelectorAll("input, select")];

function fill() {
  for (const field of fields()) field.value = served.settings[field.id.replace("set-", "")] ?? "";
}

const numberOrWord = (text) => (Number.isNaN(Number(text)) ? text : Number(text));

// An empty field is no zero: it stands for what is delivered.
function settings() {
  const chosen = { planner: $("planner").value, seed: Number($("seed").value), conservative: $("conservative").checked };
  for (const field of fields()) if (field.value !== "") chosen[field.id.replace("set-", "")] = numberOrWord(field.value);
  return chosen;
}

const plan = () => askForPlan(async () => {
  await Promise.all([settled(), inHand(), through.settled()]); // what is being chosen, moved or typed is meant
  const chosen = known.summary.footfall;
  await freeze();
  const order = { leg: chosen.leg, target: [chosen.x, chosen.y] };
  return post(orders("step"), isAthletes() ? { ...order, settings: settings(), through: through.points() } : order);
});

// Of the refusal of this footfall, else what the maps say of it.
function nearestGood() {
  const { summary, plan: result } = known;
  const chosen = summary?.footfall;
  if (!chosen) return null;
  const refused = result && !isOfAnother(chosen, result.footfall) ? result.instead : null;
  return refused ?? (summary.footfall_answer?.acceptable === false ? summary.footfall_answer.nearest : null);
}

const stepToNearest = () => attempt(async () => {
  const { x, y } = nearestGood();
  await chooseFootfall(x, y, known.summary.footfall.leg);
  plan();
});

let drawn; // the answer that is shown, null for none

function draw({ summary, plan: result }) {
  if (!summary) return;
  describe(); // the planner may be that of before a reload
  const { footfall, view } = summary; // which stays of the leg that it was chosen for, whichever is chosen next
  $("plan").textContent = footfall && footfall.leg !== view.leg ? texts.stepOf(shared.leg(footfall.leg)) : texts.step;
  const doubt = result ? outdated(summary, result) || summary.plan.doubt : "";
  $("plan-doubt").hidden = !doubt;
  $("plan-doubt").textContent = doubt;
  if (result === drawn) return;
  drawn = result;
  const answer = $("plan-answer");
  if (!result) {
    answer.className = "hint";
    answer.textContent = texts.noPlanYet;
    $("checks").hidden = true;
    $("decisions-box").hidden = true;
    return;
  }
  const found = result.status === "found";
  answer.className = found ? "yes" : "no";
  answer.textContent = found
    ? texts.found(result.plan, result.reason)
    : texts.notFound(result.status, result.reason);
  $("checks").hidden = result.checks.length === 0;
  $("checks").tBodies[0].replaceChildren(
    ...result.checks.map((check) =>
      element("tr", {},
        element("td", { className: mark(check), textContent: check.name }),
        element("td", { textContent: texts.marginOf(check) }),
        element("td", { textContent: check.where }))),
  );
  $("decisions-box").hidden = result.decisions.length === 0;
  $("decisions").replaceChildren(
    ...result.decisions.map(({ taken, text }) => element("li", { className: taken ? "yes" : "no", textContent: text })));
}

// Ground that nobody has seen is no reason against a plan, and none for it either.
export function mark({ name, holds, where }) {
  if (!holds) return "no";
  return name === "unknown ground under the path" && where !== "none" ? "doubt" : "yes";
}

// What is shown may no longer be what is wanted: say so instead of hiding it.
function outdated(summary, { digest, footfall }) {
  const chosen = summary.footfall;
  if (chosen && isOfAnother(chosen, footfall)) {
    return texts.ofAnother(footfall);
  }
  const fit = summary.plan.digest === digest ? summary.up_to_date.plan : null;
  if (outOfDate(fit)) return texts.answerOutOfDate(outOfDate(fit));
  return fit?.ground ? texts.newerGround : "";
}
