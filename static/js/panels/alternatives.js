// Plans side by side: ask for the step otherwise, compare, choose; and go on from where the plan ends.

import { act } from "../acts.js";
import { askAgain, get, post, put, request } from "../api.js";
import { $, attempt, element, fixed, signed } from "../dom.js";
import { answered } from "../planning.js";
import { known, subscribe } from "../store.js";
import { refresh } from "../stream.js";
import * as texts from "../texts/plan.js";
import * as shared from "../texts/shared.js";

let listed = []; // as GET plans gives them
let shownFor = ""; // what the list was asked for

export function start() {
  const refusal = () => (known.plan?.plan ? "" : shared.noPlan);
  act({ key: "O", text: texts.askAlternatives, button: "alternatives", run: ask, refusal });
  act({
    key: "K", text: texts.nextAlternative, run: chooseNext,
    refusal: () => (able().length > 1 ? "" : texts.noAlternatives),
  });
  act({
    key: "N", text: texts.goOn, button: "go-on", run: goOn,
    refusal: () => (known.summary?.ends.go_on ? "" : texts.noPlanToGoOn),
  });
  act({ text: shared.backToTheRover, button: "go-back", run: goBack, quiet: true });
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

async function draw({ summary }) {
  if (!summary) return;
  const { go_on: from, after } = summary.ends;
  $("go-on-from").hidden = !from;
  $("go-on-from").textContent = from ? texts.goesOnFrom(texts.endOf(from)) : "";
  $("go-back").hidden = $("go-on-text").hidden = !after;
  $("go-on-text").textContent = after
    ? texts.plannedFrom(texts.endOf(after))
    : "";
  const wanted = JSON.stringify([summary.plan.digest, summary.plan.compared]);
  if (wanted === shownFor) return;
  shownFor = wanted;
  const found = summary.plan.compared.length ? await get("/sessions/current/plans").catch(() => null) : [];
  if (wanted !== shownFor) return;
  if (!found) askAgain(() => { if (wanted === shownFor) shownFor = ""; });
  listed = found ?? [];
  show();
}

function show() {
  $("compare").hidden = listed.length === 0;
  const asked = listed.find((one) => one.kind === "asked")?.figures;
  $("compare").tBodies[0].replaceChildren(...listed.map((one) => {
    const name = element("button", { type: "button", textContent: one.text, disabled: !one.figures || one.chosen, title: one.chosen ? texts.isChosen : one.figures ? "" : one.reason, onclick: () => choose(one.digest) });
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
