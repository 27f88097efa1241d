// Plans side by side: ask for the step otherwise, compare, choose; and go on from where the plan ends.

import { act } from "../acts.js";
import { get, post, put, request } from "../api.js";
import { $, attempt, element, fixed, signed } from "../dom.js";
import { answered } from "../planning.js";
import { known, subscribe } from "../store.js";
import { refresh } from "../stream.js";

let listed = []; // as GET plans gives them
let shownFor = ""; // what the list was asked for

export function start() {
  const refusal = () => (known.plan?.plan ? "" : "There is no plan yet: plan the step first.");
  act({ key: "O", text: "Ask for alternatives of the plan", button: "alternatives", run: ask, refusal });
  act({
    key: "K", text: "Choose the next of the alternatives", run: chooseNext,
    refusal: () => (able().length > 1 ? "" : "There are no alternatives to choose from: ask for them first."),
  });
  act({
    key: "N", text: "Go on from the plan's predicted end", button: "go-on", run: goOn,
    refusal: () => (known.summary?.ends.go_on ? "" : "There is no plan to go on from: plan the step first."),
  });
  act({ text: "End the what-if: back to the rover", button: "go-back", run: goBack, quiet: true });
  subscribe(draw);
}

const ask = () => attempt(async () => {
  await answered();
  await post(`/sessions/current/plans/${known.plan.digest}/alternatives`, {});
});

const choose = (plan) => attempt(async () => {
  await put("/sessions/current/plans/current", { plan });
  await refresh();
});

const able = () => listed.filter((one) => one.figures);

const chooseNext = () => choose(able()[(able().findIndex((one) => one.chosen) + 1) % able().length].digest);

const goOn = () => attempt(async () => {
  // what the page said it goes on from, whatever was made since
  await put("/sessions/current/what-if/after", { after: known.summary.ends.go_on.digest });
  await refresh();
});

const goBack = () => attempt(async () => {
  await request("DELETE", "/sessions/current/what-if");
  await refresh();
});

const ENDS = { plan: "the plan", execution: "the prediction of sag", commands: "the commands" };

// Which of what was made of a step it is, and whether the rover sags there.
const endOf = ({ of, sags }) => `${ENDS[of]}, ${sags ? "the rover's sag in it" : "the rover taken as rigid"}`;

async function draw({ summary }) {
  if (!summary) return;
  const { go_on: from, after } = summary.ends;
  $("go-on-from").hidden = !from;
  $("go-on-from").textContent = from ? `Going on starts from the predicted end of ${endOf(from)}.` : "";
  $("go-back").hidden = $("go-on-text").hidden = !after;
  $("go-on-text").textContent = after
    ? `Planned from the predicted end of ${endOf(after)}. What is made from here can be sent once the rover stands there.`
    : "";
  const wanted = JSON.stringify([summary.plan.digest, summary.plan.compared]);
  if (wanted === shownFor) return;
  shownFor = wanted;
  listed = summary.plan.compared.length ? await attempt(() => get("/sessions/current/plans")) ?? [] : [];
  if (wanted === shownFor) show();
}

function show() {
  $("compare").hidden = listed.length === 0;
  const asked = listed.find((one) => one.kind === "asked")?.figures;
  $("compare").tBodies[0].replaceChildren(...listed.map((one) => {
    const name = element("button", { type: "button", textContent: one.text, disabled: !one.figures || one.chosen, onclick: () => choose(one.digest) });
    const figures = one.figures
      ? ["length", "duration", "clearance", "margin"].map((figure) => element("td", {}, ...told(one.figures[figure], asked?.[figure], one.kind, figure)))
      : [element("td", { colSpan: 4, className: "no", textContent: one.reason })];
    return element("tr", { className: one.chosen ? "current" : "" },
      element("td", { textContent: one.chosen ? "✓" : "" }), element("td", {}, name), ...figures);
  }));
}

// A figure, and by how much it differs from that of the plan as it was asked for.
function told(figure, asked, kind, name) {
  const digits = name === "duration" ? 1 : 3;
  const parts = [element("span", { textContent: fixed(figure, digits) })];
  if (kind !== "asked" && typeof figure === "number" && typeof asked === "number") {
    const by = figure - asked;
    parts.push(element("small", { textContent: signed(by, digits) }));
  }
  return parts;
}
