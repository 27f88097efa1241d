// Age: the legend of the hatching that the scene lays over old ground, whatever layer it shows.

import { askAgain, get } from "../api.js";
import { element, $ } from "../dom.js";
import { subscribe } from "../store.js";
import * as texts from "../texts/scene.js";

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
  if (wanted !== legendFor) return;
  if (wanted && wanted !== "none" && !found) askAgain(() => { if (wanted === legendFor) legendFor = ""; });
  else $("age-legend").replaceChildren(...(wanted ? linesOf(found) : []));
}

function linesOf(found) {
  if (!found) return [line("", texts.noAges)];
  const { bands, unknown } = found;
  if (unknown === 1) return [line("unknown", texts.ageUnknown)];
  const rows = bands.map(({ after, share }, i) => {
    const until = bands[i + 1]?.after;
    const words = i === 0 ? texts.newest(until)
      : until ? texts.between(after, until) : texts.olderThan(after);
    return line(`band${i}`, texts.band(words, share));
  });
  return unknown > 0 ? [...rows, line("unknown", texts.someUnknown(unknown))] : rows;
}

const line = (kind, text) => element("li", {}, element("i", { className: `hatch ${kind}`, ariaHidden: "true" }), element("span", { textContent: text }));
