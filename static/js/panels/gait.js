// Gait: what came of one, to be compared with the walk: its figures, or at which step which check fails by how much.

import { $, element, fixed } from "../dom.js";
import { outOfDate } from "../fits.js";
import { statusTold } from "../kinds.js";
import { subscribe } from "../store.js";

let shown = ""; // digest of the gait that is shown

export function start() {
  subscribe(draw);
}

function draw({ summary, gait }) {
  if (!summary) return;
  const doubt = gait ? outOfDate(summary.up_to_date.gait) : "";
  $("gait-doubt").hidden = !doubt;
  $("gait-doubt").textContent = doubt ? `The gait is out of date: ${doubt}. Plan it again.` : "";
  if ((gait?.digest ?? "") === shown) return;
  shown = gait?.digest ?? "";
  $("gait-answer").replaceChildren(...(gait ? told(gait) : []));
}

function told({ status, plan, partial, reason, provenance, walked }) {
  const name = `Gait ${provenance.settings?.gait ?? ""}`;
  if (plan) return [element("p", { className: "yes", textContent: `${name}: ${inWords(plan)}. To be looked at: it is not commanded.` })];
  return [
    element("p", { className: "no", textContent: `No ${name.toLowerCase().trim()} (${statusTold(status, "the rover")}): ${reason}` }),
    ...(partial ? [element("p", { className: "doubt", textContent: `It comes ${fixed(walked, 2)} m: ${inWords(partial)}` })] : []),
  ];
}

const feet = (groups) => groups.reduce((sum, group) => sum + group.length, 0);
const inWords = (plan) => `${plan.groups.length} steps, ${feet(plan.groups)} feet moved, stride ${fixed(plan.stride, 2)} m, least margin ${fixed(Math.min(...plan.margins))} m, largest torque ${fixed(100 * Math.max(...plan.torques), 0)} % of its limit`;
