// Plots: as many as the operator makes, of any channels together, over the whole recording; all show the same time.

import { act } from "../acts.js";
import { followCursor, point } from "../cursor.js";
import { $, element, toast } from "../dom.js";
import { subscribeToEvents, when } from "../events.js";
import { explainKey, heardFirst } from "../keys.js";
import { isShown, reveal } from "../layout.js";
import * as kept from "../plots/kept.js";
import { viewOf } from "../plots/view.js";
import { partOf, recordedSpan } from "../recorded.js";
import { heardAny, heardFrom } from "../samples.js";
import { STALE_AFTER, known, subscribe, telemetryAge } from "../store.js";
import * as texts from "../texts/plots.js";
import { WORN } from "../themes.js";

const PERIOD = 500; // ms
const STEP = 0.25; // of the time that is shown: one step aside
const CLOSER = 0.5; // what is left of it by one step closer
const SHORTEST = 0.5; // s
const WHEEL = 0.0015; // of a step for each pixel

/** @type {Map<number, ReturnType<typeof viewOf>>} */
const views = new Map();
let drawnAt = 0;
let changedAt = -Infinity; // when another time was chosen
let later = 0;

export function start() {
  kept.load();
  const list = $("plots-shown");
  list.append(element("option", { value: "whole", textContent: texts.whole }),
    ...texts.SPANS.map(([span, told]) => element("option", { value: String(span), textContent: texts.last(told) })),
    element("option", { value: "between", textContent: texts.between, disabled: true }));
  list.addEventListener("change", () => show(list.value === "whole" ? { kind: "whole" } : { kind: "last", span: Number(list.value) }));
  act({ text: texts.add, button: "plots-add", run: add });
  act({ text: texts.undo, button: "plots-undo", run: undo, refusal: () => (kept.toUndo() ? "" : texts.nothingToUndo) });
  act({ text: texts.zoomIn, button: "plots-in", run: () => zoom(CLOSER) });
  act({ text: texts.zoomOut, button: "plots-out", run: () => zoom(1 / CLOSER) });
  act({ text: texts.goBack, button: "plots-back", run: () => go(-STEP) });
  act({ text: texts.goOn, button: "plots-on", run: () => go(STEP) });
  act({ text: texts.showWhole, run: () => show({ kind: "whole" }) });
  for (const [span, told] of texts.SPANS) act({ text: texts.showLast(told), run: () => show({ kind: "last", span: Number(span) }) });
  for (const [key, text] of texts.KEYS) explainKey(key, text);
  heardFirst(press);
  kept.whenChanged(arrange);
  followCursor(() => views.forEach((view) => view.redraw()));
  subscribeToEvents(() => draw());
  document.addEventListener(WORN, () => views.forEach((view) => view.redraw()));
  subscribe(() => { if (performance.now() - drawnAt > PERIOD) draw(); });
  arrange();
}

function add() {
  reveal("plots");
  const id = kept.add();
  const { section } = views.get(id);
  section.scrollIntoView({ block: "nearest" });
  section.querySelector("summary").click();
}

function undo() {
  const done = kept.toUndo();
  kept.undo();
  toast(texts.undoes(done));
}

// -- which are there -------------------------------------------------------------------------------

function arrange() {
  const plots = kept.kept();
  $("plots-undo").disabled = !kept.toUndo();
  for (const [id, view] of views) {
    if (plots.some((one) => one.id === id)) continue;
    const focused = view.section.contains(document.activeElement);
    view.end();
    view.section.remove();
    views.delete(id);
    if (focused) $("plots-undo").focus();
  }
  plots.forEach(({ id }, i) => {
    if (!views.has(id)) views.set(id, made(id));
    const { section } = views.get(id);
    if ($("plots").children[i] !== section) $("plots").insertBefore(section, $("plots").children[i] ?? null);
  });
  draw();
}

function made(id) {
  const view = viewOf(id, (begin, end) => show({ kind: "between", begin, end }));
  view.box.addEventListener("wheel", (event) => {
    event.preventDefault();
    if (event.shiftKey) go((event.deltaX || event.deltaY) * WHEEL);
    else zoom(Math.exp(event.deltaY * WHEEL), view.timeAt(event.clientX));
  }, { passive: false });
  return view;
}

// -- the time that is shown ------------------------------------------------------------------------

const now = () => Date.now() / 1000;
const live = () => Boolean(known.frame) && telemetryAge(known.frame) <= STALE_AFTER;

// From when to when there may be anything.
function whole() {
  const { begin, end } = recordedSpan();
  const first = Math.min(begin ?? Infinity, heardAny() ? heardFrom() : Infinity);
  const last = live() ? now() : Math.max(end ?? -Infinity, known.frame ? now() - telemetryAge(known.frame) : -Infinity);
  return Number.isFinite(first) && last > first ? { begin: first, end: last } : { begin: now() - 60, end: now() };
}

function limits() {
  const shown = kept.shownTime();
  const all = whole();
  if (shown.kind === "between") return { begin: shown.begin, end: shown.end, from: shown.begin, to: shown.end };
  if (shown.kind === "whole") return { ...all, from: null, to: null };
  const begin = all.end - shown.span;
  const step = shown.span / 20;
  return { begin, end: all.end, from: Math.floor(begin / step) * step, to: null };
}

function show(time) {
  changedAt = kept.shownTime().kind === "between" && time.kind === "between" ? performance.now() : -Infinity;
  kept.show(time);
}

function zoom(by, at = null) {
  const { begin, end } = limits();
  const middle = at ?? (begin + end) / 2;
  const factor = Math.max(by, SHORTEST / (end - begin));
  show({ kind: "between", begin: middle - (middle - begin) * factor, end: middle + (end - middle) * factor });
}

function go(share) {
  const { begin, end } = limits();
  const by = share * (end - begin);
  show({ kind: "between", begin: begin + by, end: end + by });
}

const KEYS = {
  "+": () => zoom(CLOSER), "=": () => zoom(CLOSER), "-": () => zoom(1 / CLOSER),
  Home: () => show({ kind: "whole" }), End: () => show({ kind: "last", span: 600 }),
  ArrowLeft: () => go(-STEP), ArrowRight: () => go(STEP),
};

// Keys of the plot that has the focus.
function press(event) {
  const view = [...views.values()].find((one) => one.holds(event.target));
  if (!view) return false;
  if (event.key === "Delete") {
    kept.remove(view.id);
    return true;
  }
  if (event.shiftKey && ["ArrowLeft", "ArrowRight"].includes(event.key)) {
    const time = view.neighbour(event.key === "ArrowLeft" ? -1 : 1);
    if (time !== null) point(time);
    return true;
  }
  const done = KEYS[event.key];
  done?.();
  return Boolean(done);
}

// -- drawing ---------------------------------------------------------------------------------------

function draw() {
  if (!isShown("plots")) return;
  drawnAt = performance.now();
  clearTimeout(later);
  const shown = kept.shownTime();
  const time = limits();
  $("plots-shown").value = shown.kind === "last" ? String(shown.span) : shown.kind;
  const goesOn = live() && time.end > now() - 60;
  const answers = [...views.values()].map((view) => view.draw({ ...time, goesOn, changedAt })).filter(Boolean);
  $("plots-time").textContent = answers.length ? texts.shows(when(time.begin), when(time.end), texts.length(time.end - time.begin)) : "";
  $("plots-note").textContent = said(answers, time);
  if (performance.now() - changedAt < PERIOD) later = window.setTimeout(draw, PERIOD / 2);
}

function said(answers, { begin, end }) {
  if (!views.size) return texts.noPlots;
  const most = Math.max(0, ...answers.map(({ unread }) => unread));
  const damaged = [...new Set(answers.flatMap((one) => one.damaged))];
  const off = answers.find((one) => one.off)?.off;
  const part = partOf(begin, end);
  const told = [
    most ? texts.reading(most) : "",
    damaged.length ? texts.damaged(damaged.join(", ")) : "",
    off ? texts.clocksDiffer(off) : "",
    answers.length && answers.every((one) => !one.asking && !one.unread && one.end === null) && !heardAny() ? texts.nothing : "",
    answers.length && part > LEAST_TOLD ? texts.parts(part) : "",
  ];
  return told.filter(Boolean).join(" ");
}

const LEAST_TOLD = 0.5; // s: shorter parts hold hardly more than one frame

/** Times, numbers, pauses and events that a plot is drawn from, for who looks at the page from outside. */
export const drawnNumbers = (id) => views.get(id)?.numbers();
