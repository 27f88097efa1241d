// The layouts, and what the browser keeps of each: which areas are in sight, which cards are closed, what was put elsewhere.
// What differs from a layout as it was delivered is kept; every change can be undone until the page is loaded anew. A tab that is
// loaded anew has its own, another begins with what was changed last in any.

import * as texts from "../texts/layout.js";

const WALK = ["ground", "goal", "walk", "loop", "commands"];
// shown: areas in sight; closed: those of them whose card is closed; follows: whether the card opens where the job is.
export const LAYOUTS = {
  walk: { key: "6", shown: WALK, closed: WALK, follows: true },
  [texts.planAStep]: { key: "7", shown: ["ground", "footfall", "plan", "execution", "commands"], closed: [], follows: false },
  execute: { key: "8", shown: ["legs", "telemetry", "commands"], closed: [], follows: false },
  plots: { key: "", shown: ["plots"], closed: [], follows: false },
  review: { key: "9", shown: ["legs", "telemetry", "sessions", "record"], closed: [], follows: false },
};
const KEPT_AS = "footfall.layout";
const MOST = 50; // changes that can be undone
const BOX = ["left", "top", "width", "height"];
const PARTS = ["shown", "closed", "placed"];

// chosen: a layout; the parts: layout → names of areas, and for placed, name → where it is: {at: "side", "dock"} or
// {at: "scene", left, top, width, height}
let kept = { chosen: Object.keys(LAYOUTS)[0], shown: {}, closed: {}, placed: {} };
const before = [];

export const chosen = () => kept.chosen;
export const follows = () => LAYOUTS[kept.chosen].follows;
export const shown = () => kept.shown[kept.chosen] ?? LAYOUTS[kept.chosen].shown;
export const closed = () => kept.closed[kept.chosen] ?? LAYOUTS[kept.chosen].closed;
export const placed = () => kept.placed[kept.chosen] ?? {};

export function recall() {
  try {
    const found = JSON.parse(sessionStorage.getItem(KEPT_AS) ?? localStorage.getItem(KEPT_AS));
    if (!(found?.chosen in LAYOUTS)) return;
    const recalled = { ...kept, chosen: found.chosen };
    for (const part of PARTS) recalled[part] = understood(part, found[part]);
    kept = recalled;
  } catch { /* a layout that can't be read is no loss */ }
}

// What was kept of a part, without what is none of it.
const understood = (part, layouts) => Object.fromEntries(Object.entries(layouts ?? {}).filter(([, one]) => (part === "placed" ? isPlaces(one) : Array.isArray(one))));
const isPlaces = (one) => Boolean(one) && Object.values(one).every((place) => ["side", "dock"].includes(place?.at) || (place?.at === "scene" && BOX.every((name) => Number.isFinite(place[name]))));

// values: part → what it is in the layout that is chosen; undefined: as delivered.
export function change(values) {
  const next = { ...kept };
  for (const [part, value] of Object.entries(values)) next[part] = { ...kept[part], [kept.chosen]: value };
  take(next);
}

export const choose = (name) => take({ ...kept, chosen: name });
export const deliver = () => change(Object.fromEntries(PARTS.map((part) => [part, undefined])));

function take(next) {
  before.push(kept);
  if (before.length > MOST) before.shift();
  save(next);
}

export const canUndo = () => before.length > 0;
export const undo = () => save(before.pop());

function save(next) {
  kept = next;
  try {
    for (const storage of [sessionStorage, localStorage]) storage.setItem(KEPT_AS, JSON.stringify(kept));
  } catch { /* without storage the layout lasts as long as the page */ }
}
