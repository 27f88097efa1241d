// A walk on one strip over the ghost's slider: its foot moves, the margin and the torque along it, and where each is worst.

import { act } from "../acts.js";
import { $, asTyped, element } from "../dom.js";
import { along, footMoveTold, worstOf } from "../footmoves.js";
import { walkPlayed } from "../pace.js";
import { known, subscribe } from "../store.js";
import * as texts from "../texts/walk.js";
import { ghostTo, shownMoment } from "./ghost.js";

const BAND = 100; // height of one band of the picture, in its own units
const NUMBERS = 24; // at most
const FIGURES = { margin: "▼", torque: "▲" };

let drawn = null; // the plan that is on it

export function start() {
  const none = () => (walkPlayed() ? "" : texts.noWalkPlayed);
  for (const [name, text] of Object.entries({ margin: texts.ghostToMargin, torque: texts.ghostToTorque })) {
    act({ text, button: `strip-${name}`, refusal: none, run: () => {
      const plan = walkPlayed();
      ghostTo(along(plan).moments[worstOf(plan)[name].waypoint]);
    } });
  }
  $("strip-picture").addEventListener("click", (event) => {
    const box = $("strip-picture").getBoundingClientRect();
    ghostTo((event.clientX - box.left) / box.width);
  });
  $("scrub").addEventListener("input", () => pointAt(shownMoment()));
  subscribe(draw);
}

function draw() {
  const plan = walkPlayed();
  $("strip").hidden = !plan;
  $("ghost").classList.toggle("of-walk", Boolean(plan));
  if (!plan) return;
  if (plan !== drawn) show(plan);
  drawn = plan;
  pointAt(shownMoment());
}

function pointAt(moment) {
  $("strip-now").style.left = percent(moment);
}

const percent = (share) => `${asTyped(100 * share)}%`;

function show(plan) {
  const { moments, ends } = along(plan);
  const { least_margin: least = 0, most_torque: most = 1 } = known.walk.provenance.settings ?? {};
  const highest = { margin: Math.max(...plan.margins, 2 * least), torque: Math.max(...plan.torques, 1) };
  const shares = { margin: plan.margins.map((one) => one / highest.margin), torque: plan.torques.map((one) => one / highest.torque) };
  const worst = worstOf(plan);
  for (const [name, limit] of Object.entries({ margin: least / highest.margin, torque: most / highest.torque })) {
    const way = shares[name].map((share, i) => `${1000 * moments[i]},${BAND * (1 - Math.max(0, share))}`).join(" ");
    $(`strip-${name}-line`).setAttribute("points", way);
    $(`strip-${name}-limit`).setAttribute("y1", BAND * (1 - limit));
    $(`strip-${name}-limit`).setAttribute("y2", BAND * (1 - limit));
    const { waypoint, text } = worst[name];
    const mark = $(`strip-${name}-mark`);
    mark.textContent = FIGURES[name];
    mark.style.left = percent(moments[waypoint]);
    mark.style.top = percent(1 - Math.max(0, shares[name][waypoint]));
    $(`strip-${name}`).textContent = `${FIGURES[name]} ${text}`;
    $(`strip-${name}`).title = `${footMoveTold(plan, waypoint)}, ${plan.phases[waypoint]}`;
  }
  const every = Math.ceil(plan.legs.length / NUMBERS);
  $("strip-ticks").replaceChildren(...ends.map((end, number) => tick(end, [0, ...ends][number], number, plan, every)));
  $("strip-picture").setAttribute("aria-label", texts.strip(plan.legs.length, ["margin", "torque"].map((name) => texts.worstIn(worst[name].text, footMoveTold(plan, worst[name].waypoint)))));
}

// The end of a foot move, and its number over it.
function tick(end, begin, number, plan, every) {
  const made = element("i", {}, element("b", { textContent: number < plan.legs.length && number % every === 0 ? String(number + 1) : "" }));
  made.style.left = percent(begin);
  made.style.width = percent(end - begin);
  return made;
}
