// The plots that the operator made: their names, channels and the time that they show. The browser remembers them.

import * as texts from "../texts/plots.js";

const KEPT_AS = "footfall.plots";
const MOST_STEPS = 50; // that can be taken back
export const MOST_CHANNELS = 36; // of one plot: as many lines can be told apart

/** @typedef {{id: number, name: string, channels: string[]}} Plot */
/** @typedef {{kind: "whole"} | {kind: "last", span: number} | {kind: "between", begin: number, end: number}} Shown */

/** @type {Plot[]} */
let plots = [];
/** @type {Shown} */
let shown = { kind: "whole" };
const before = []; // { plots, what was done }, oldest first
const listeners = [];

export const kept = () => plots;
export const shownTime = () => shown;

// What undo would take back, in words; "" where there is nothing.
export const toUndo = () => before.at(-1)?.done ?? "";

export const whenChanged = (listener) => listeners.push(listener);

export function load() {
  try {
    const found = JSON.parse(localStorage.getItem(KEPT_AS));
    if (arePlots(found?.plots)) plots = found.plots;
    if (isTime(found?.shown)) shown = found.shown;
  } catch { /* plots that can't be read are made anew */ }
  addEventListener("storage", takeOthers);
}

// What another tab of this browser did to the plots is done here, too: else the next change here would take it back. Its time
// stays its own; to take back what was done here before would take back the other's.
function takeOthers({ key, newValue }) {
  if (key !== KEPT_AS) return;
  const others = JSON.parse(newValue)?.plots;
  if (!arePlots(others) || JSON.stringify(others) === JSON.stringify(plots)) return;
  plots = others;
  before.length = 0;
  listeners.forEach((listener) => listener());
}

const arePlots = (found) => Array.isArray(found) && found.every(isPlot);

const isPlot = (one) => Number.isInteger(one?.id) && typeof one.name === "string" && Array.isArray(one.channels) && one.channels.every((id) => typeof id === "string");

function isTime(one) {
  if (one?.kind === "between") return Number.isFinite(one.begin) && one.begin < one.end && Number.isFinite(one.end);
  return one?.kind === "whole" || (one?.kind === "last" && one.span > 0);
}

function save() {
  try {
    localStorage.setItem(KEPT_AS, JSON.stringify({ plots, shown }));
  } catch { /* without storage the plots last as long as the page */ }
  listeners.forEach((listener) => listener());
}

function change(done, made) {
  before.push({ plots, done });
  if (before.length > MOST_STEPS) before.shift();
  plots = made;
  save();
}

export function add(channels = []) {
  const id = Math.max(0, ...plots.map((one) => one.id)) + 1;
  change(texts.added(texts.nameOf(id)), [...plots, { id, name: texts.nameOf(id), channels }]);
  return id;
}

export function remove(id) {
  const gone = plots.find((one) => one.id === id);
  if (gone) change(texts.removed(gone.name), plots.filter((one) => one !== gone));
}

export function rename(id, name) {
  const named = plots.find((one) => one.id === id);
  if (named && name && name !== named.name) change(texts.renamed(name), plots.map((one) => (one === named ? { ...one, name } : one)));
}

export function setChannels(id, channels) {
  const of = plots.find((one) => one.id === id);
  if (of) change(texts.chosenFor(of.name), plots.map((one) => (one === of ? { ...one, channels: channels.slice(0, MOST_CHANNELS) } : one)));
}

export function undo() {
  const last = before.pop();
  if (!last) return;
  plots = last.plots;
  save();
}

export function show(time) {
  shown = time;
  save();
}
