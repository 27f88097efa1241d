// Suggested footfalls: the best places on the current maps, ranked, each with its reasons; the weights are the operator's.

import { act } from "../acts.js";
import { get, post } from "../api.js";
import { chooseFootfall, settled } from "../choosing.js";
import { $, attempt, element } from "../dom.js";
import { factors, subscribeToLayers } from "../layers.js";
import { jobEnded } from "../planning.js";
import { rememberInSession } from "../remembered.js";
import { changed, known, subscribe } from "../store.js";
import { refresh } from "../stream.js";
import * as texts from "../texts/footfall.js";

let shownFor = ""; // the maps that the list is about
let askedAs = ""; // how it was asked for: leg, direction, weights
let awaited = null; // {leg, job}: the maps that suggestions wait for

export function start() {
  subscribeToLayers(() => {
    $("weights").replaceChildren(...factors().map(({ name, title, weight }) =>
      element("label", { textContent: title }, element("input", { id: `weight-${name}`, type: "number", min: "0", step: "any", value: String(weight) }))));
    rememberInSession(...factors().map(({ name }) => `weight-${name}`));
  });
  act({ key: "G", text: texts.suggest, button: "suggest", run: suggest });
  for (const id of ["weights", "suggest-towards"]) $(id).addEventListener("input", changed);
  subscribe(draw);
}

export const weights = () => Object.fromEntries(factors().map(({ name }) => [name, Number($(`weight-${name}`).value)]));

function towards() {
  const degrees = $("suggest-towards").value;
  if (degrees === "") return null;
  const angle = (Number(degrees) * Math.PI) / 180;
  return [Math.cos(angle), Math.sin(angle)];
}

const suggest = () => attempt(async () => {
  await settled();
  const { leg } = known.summary.view;
  try {
    await suggestNow(leg);
  } catch (problem) {
    if (!problem.body?.job) throw problem;
    if (await isMade(leg, problem.body.job)) await suggestNow(leg);
  }
});

const orderFor = (leg) => ({ leg, count: 5, towards: towards(), settings: { weights: weights() } });

async function suggestNow(leg) {
  const order = orderFor(leg);
  await show(order, await post("/sessions/current/suggestions", order));
}

// The maps are on their way. Whether suggestions are still waited for once they are there.
async function isMade(leg, id) {
  const mine = awaited = { leg, job: await get(`/jobs/${id}`) };
  changed();
  try {
    await jobEnded(mine.job);
    await refresh();
    return awaited === mine && known.summary.view.leg === leg;
  } finally {
    if (awaited === mine) awaited = null;
    changed();
  }
}

async function show(order, answer) {
  const { leg } = order;
  const { maps } = await get("/sessions/current"); // what is known here may be a moment old
  [shownFor, askedAs] = [maps[leg], JSON.stringify(order)];
  $("suggestions").replaceChildren(...answer.footfalls.map((one) => element("li", {},
    element("button", { type: "button", textContent: texts.at(one.x, one.y), onclick: () => chooseFootfall(one.x, one.y, leg) }),
    element("strong", { textContent: texts.apart(one.apart?.text) }),
    element("span", { textContent: texts.scored(one.score, one.reasons.at(-1)) }),
    element("details", {}, element("summary", { textContent: texts.reasons }), ...one.reasons.map((reason) => element("p", { textContent: reason }))))));
  $("suggestions-note").textContent = answer.reason;
  draw(known); // weights may have been changed while the answer was on its way
}

// Suggestions for other maps than the current ones, or ranked by other weights, would be a wrong green.
function draw({ summary, jobs }) {
  if (!summary) return;
  const leg = summary.view.leg;
  $("suggestions-wait").textContent = awaited?.leg === leg ? texts.onceMade(leg, (jobs.get(awaited.job.id) ?? awaited.job).fraction) : "";
  if (!shownFor) return;
  const isOfMaps = summary.up_to_date.maps[leg]?.fits && summary.maps[leg] === shownFor;
  if (isOfMaps && JSON.stringify(orderFor(leg)) === askedAs) return;
  shownFor = "";
  $("suggestions").replaceChildren();
  $("suggestions-note").textContent = isOfMaps ? texts.rankedOtherwise : "";
}
