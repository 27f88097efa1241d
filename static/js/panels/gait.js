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

// As it is chosen: tripod, ripple or wave.
export const nameOf = ({ provenance }) => provenance.settings?.gait ?? "";

// What planning came to, as a class and in words.
export function gaitTold(gait) {
  const { status, plan, reason } = gait;
  return plan ? ["yes", texts.gaitFound(nameOf(gait), plan)] : ["no", texts.noGait(nameOf(gait), status, reason)];
}

function told(gait) {
  const { plan, partial, walked } = gait;
  const [className, textContent] = gaitTold(gait);
  return [
    element("p", { className, textContent }),
    ...(!plan && partial ? [element("p", { className: "doubt", textContent: texts.gaitComes(walked, partial) })] : []),
  ];
}
