// Age: the legend of the hatching that the scene lays over old ground, whatever layer it shows.

import { get } from "../api.js";
import { age, element, $ } from "../dom.js";
import { subscribe } from "../store.js";

let legendFor = "";

export function start() {
  subscribe(draw);
}

async function draw({ summary }) {
  if (!summary) return;
  const wanted = summary.view.shown.age ? summary.dem ?? "none" : "";
  if (wanted === legendFor) return;
  legendFor = wanted;
  const found = wanted && wanted !== "none" ? await get(`/sessions/current/terrains/${wanted}/age`).catch(() => null) : null;
  if (wanted === legendFor) $("age-legend").replaceChildren(...(wanted ? linesOf(found) : []));
}

const percent = (share) => `${share > 0 && share < 0.01 ? "<1" : (100 * share).toFixed(0)} %`;

function linesOf(found) {
  if (!found) return [line("", "There is no terrain whose age could be shown.")];
  const { bands, unknown } = found;
  if (unknown === 1) return [line("unknown", "? age unknown: this terrain does not say when it was measured")];
  const rows = bands.map(({ after, share }, i) => {
    const until = bands[i + 1]?.after;
    const words = i === 0 ? `no hatching: measured within ${age(until)} of the newest`
      : until ? `${age(after)} to ${age(until)} before` : `more than ${age(after)} before`;
    return line(`band${i}`, `${words} (${percent(share)})`);
  });
  return unknown > 0 ? [...rows, line("unknown", `? age unknown, not hatched (${percent(unknown)})`)] : rows;
}

const line = (kind, text) => element("li", {}, element("i", { className: `hatch ${kind}`, ariaHidden: "true" }), element("span", { textContent: text }));
