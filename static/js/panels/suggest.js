// Suggested footfalls: the best places on the current maps, ranked, each with its reasons; the weights are the operator's.

import { get, post } from "../api.js";
import { $, attempt, element, fixed } from "../dom.js";
import { bind } from "../keys.js";
import { known, subscribe } from "../store.js";

const WEIGHTS = {
  slope: 1, roughness: 1, step: 1, support: 2, limit_margin: 1, margin: 2, certainty: 0.5, age: 0.25, height_sd: 0.5, advance: 1,
};
const NAMES = {
  slope: "Slope", roughness: "Roughness", step: "Step", support: "Support under the wheel", limit_margin: "Joint limits",
  margin: "Stability", certainty: "Ground known", age: "Age", height_sd: "Certainty", advance: "Advance",
};

let shownFor = ""; // the maps that the list is about

export function start() {
  $("weights").append(...Object.entries(WEIGHTS).map(([name, weight]) =>
    element("label", { textContent: NAMES[name] }, element("input", { id: `weight-${name}`, type: "number", min: "0", step: "any", value: String(weight) }))));
  $("suggest").addEventListener("click", suggest);
  bind("G", "Suggest footfalls", suggest);
  subscribe(draw);
}

export const weights = () => Object.fromEntries(Object.keys(WEIGHTS).map((name) => [name, Number($(`weight-${name}`).value)]));

function towards() {
  const degrees = $("suggest-towards").value;
  if (degrees === "") return null;
  const angle = (Number(degrees) * Math.PI) / 180;
  return [Math.cos(angle), Math.sin(angle)];
}

const suggest = () => attempt(async () => {
  const leg = known.summary.view.leg;
  const { maps } = await get("/sessions/current"); // what is known here may be a moment old
  const answer = await post("/sessions/current/suggestions", { leg, count: 5, towards: towards(), settings: { weights: weights() } });
  shownFor = maps[leg];
  $("suggestions").replaceChildren(...answer.footfalls.map((one) => element("li", {},
    element("button", { type: "button", textContent: `(${fixed(one.x, 2)}, ${fixed(one.y, 2)}) m`, onclick: () => choose(leg, one) }),
    element("strong", { textContent: ` ${(100 * one.score).toFixed(0)} of 100 ` }),
    element("span", { textContent: one.reasons.at(-1) }),
    element("details", {}, element("summary", { textContent: "why" }), ...one.reasons.map((reason) => element("p", { textContent: reason }))))));
  $("suggestions-note").textContent = answer.reason;
});

const choose = (leg, { x, y }) => attempt(() => post("/sessions/current/footfalls", { leg, x, y }));

// Suggestions for other maps than the current ones would be a wrong green.
function draw({ summary }) {
  if (!summary || !shownFor) return;
  const leg = summary.view.leg;
  if (summary.maps_current?.[leg] && summary.maps[leg] === shownFor) return;
  shownFor = "";
  $("suggestions").replaceChildren();
  $("suggestions-note").textContent = "";
}
