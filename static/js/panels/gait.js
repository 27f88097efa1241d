// Gait: what came of one, to be compared with the walk: its figures, or at which step which check fails by how much.

import { $, element } from "../dom.js";
import { outOfDate } from "../fits.js";
import { subscribe } from "../store.js";
import * as texts from "../texts/walk.js";

let shown = ""; // digest of the gait that is shown

export function start() {
  subscribe(draw);
}

function draw({ summary, gait }) {
  if (!summary) return;
  const doubt = gait ? outOfDate(summary.up_to_date.gait) : "";
  $("gait-doubt").hidden = !doubt;
  $("gait-doubt").textContent = doubt ? texts.gaitOutOfDate(doubt) : "";
  if ((gait?.digest ?? "") === shown) return;
  shown = gait?.digest ?? "";
  $("gait-answer").replaceChildren(...(gait ? told(gait) : []));
}

function told({ status, plan, partial, reason, provenance, walked }) {
  const name = provenance.settings?.gait ?? "";
  if (plan) return [element("p", { className: "yes", textContent: texts.gaitFound(name, plan) })];
  return [
    element("p", { className: "no", textContent: texts.noGait(name, status, reason) }),
    ...(partial ? [element("p", { className: "doubt", textContent: texts.gaitComes(walked, partial) })] : []),
  ];
}
