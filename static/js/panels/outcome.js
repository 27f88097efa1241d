// What came of the latest run, compared with its prediction: what differs by more than that is sure of, and what to do.

import { $, element, fixed } from "../dom.js";
import { subscribe } from "../store.js";
import * as texts from "../texts/sag.js";
import { row as wheelRow } from "./clearances.js";

export function start() {
  subscribe(draw);
}

const SIGNS = { as_predicted: "●", differs: "▲", not_told: "–" };

// Whether a run went as predicted, in few words, and its state for a mark; "waiting" is neither good nor bad.
export function verdictOf({ state, verdict, rigid }) {
  if (state === "waiting") return ["busy", texts.comparing];
  if (state !== "compared" || verdict === "not_told") return ["warn", texts.notCompared];
  if (verdict === "differs") return ["warn", texts.differs];
  return ["good", rigid ? texts.asCommanded : texts.asPredicted];
}

function draw({ summary }) {
  const compared = summary?.run?.compared;
  $("result").hidden = !compared || summary.run.state !== "ended";
  if ($("result").hidden) return;
  const { state, reason, verdict, differences } = compared;
  const good = state === "compared" && verdict === "as_predicted";
  const told = { className: state === "waiting" ? "hint" : good ? "yes" : "doubt", textContent: texts.runTold(summary.run.number, reason) };
  if ($("outcome-text").textContent !== told.textContent) Object.assign($("outcome-text"), told); // read aloud once
  const worse = differences.filter((one) => one.verdict === "differs");
  $("outcome-advice").replaceChildren(
    ...worse.map((one) => element("li", { className: "doubt", textContent: texts.difference(one.text) })),
    ...[...new Set(worse.map((one) => one.advice))].map((advice) => element("li", { textContent: texts.advice(advice) })));
  $("outcome-table").hidden = differences.length === 0;
  $("outcome-table").tBodies[0].replaceChildren(...differences.map(row));
  drawLeast(summary.run.least_clearances);
}

// Each wheel where the server measured it lowest while it swung in the run, and by how many looks at telemetry.
function drawLeast({ every_s: every, looks, missed, wheels }) {
  $("least-clearances").hidden = wheels.length === 0;
  $("least-clearances").caption.textContent = texts.leastClearances(looks, every, missed);
  $("least-clearances").tBodies[0].replaceChildren(...wheels.map((wheel) => element("tr", {}, ...wheelRow(wheel))));
}

function row({ quantity, leg, unit, predicted, measured, difference, uncertainty, verdict }) {
  const digits = unit === "N" ? 0 : 3;
  const cells = [predicted, measured, difference, uncertainty].map((one) => element("td", { textContent: fixed(one, digits) }));
  return element("tr", {},
    element("th", { scope: "row", textContent: texts.quantity(quantity, leg, unit) }),
    ...cells,
    element("td", { textContent: SIGNS[verdict], title: verdict.replaceAll("_", " ") }));
}
