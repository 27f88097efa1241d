// Walk: ask for a walk to a goal, read its foot moves, or what stopped it and how far it comes, and carry it out: each foot
// move becomes commands from where the rover stands, which are armed and sent as all are.

import { act } from "../acts.js";
import { once, post } from "../api.js";
import { settled } from "../choosing.js";
import { $, attempt, element, fixed, signed } from "../dom.js";
import { outOfDate } from "../fits.js";
import { statusTold } from "../kinds.js";
import { freeze } from "../stance.js";
import { changed, known, subscribe } from "../store.js";
import { sagSettings } from "./execution.js";
import { paidOut, showTether, tether, tetherInWords } from "./tether.js";

let shown = ""; // digest of the walk that is shown
let places = { forbidden: [], pinned: [] }; // what the operator says of the ground, for the next plan

export function start() {
  $("walk-form").addEventListener("submit", (event) => event.preventDefault()); // its button acts
  act({ text: "Plan the walk, or the gait, to its goal", button: "plan-walk", run: planWalk });
  for (const id of ["walk-gait", "walk-yaw"]) $(id).addEventListener("input", changed); // what comes next goes by them
  act({ text: "Commands of the walk's next foot move", button: "walk-next", run: () => command(1), refusal: notNext });
  act({ text: "Commands of all that is left of the walk", button: "walk-rest", run: () => command(left()), refusal: notNext });
  act({ text: "Re-plan the walk from here", button: "walk-again", run: again, refusal: () => (known.summary?.walk ? "" : "There is no walk yet.") });
  act({ text: "Forget forbidden and pinned places", button: "walk-places-clear", run: () => say({ forbidden: [], pinned: [] }) });
  subscribe(draw);
}

const walking = () => known.summary?.walking ?? null;
const left = () => walking().of - walking().done;

function notNext() {
  if (!walking()) return "There is no walk yet: plan one to its goal.";
  if (walking().next === null) return "The walk is over.";
  if (known.summary.gate.state === "sending") return "Commands are being sent already.";
  return walking().against;
}

const command = (count) => attempt(async () => {
  $("panel-walk").open = true;
  const { walk, next } = walking();
  const way = $("as-commanded").checked ? { as_commanded: true } : { settings: sagSettings() };
  await post(`/sessions/current/walks/${walk}/sequence`, { first: next, count, ...way }, once());
});

const again = () => attempt(async () => {
  $("panel-walk").open = true;
  await post(`/sessions/current/walks/${known.summary.walk}/again`, {});
});

// What is said of places counts with the next plan.
function say(wanted) {
  places = wanted;
  const told = Object.entries(places).filter(([, of]) => of.length).map(([what, of]) => `${of.length} ${what}`).join(", ");
  $("walk-places").hidden = !told;
  $("walk-places-text").textContent = told && `Places: ${told}. Plan the walk to heed them.`;
}

// As the fields have it: yaw null where any heading will do.
export function goalMeant() {
  const heading = $("walk-yaw").value;
  return { x: Number($("walk-x").value), y: Number($("walk-y").value), yaw: heading === "" ? null : (Number(heading) * Math.PI) / 180 };
}

export const walkSettings = () => ({ seed: Number($("seed").value), ...places });

const planWalk = () => attempt(async () => {
  await settled();
  $("panel-walk").open = true;
  showTether();
  if (!$("walk-form").reportValidity()) return;
  const goal = goalMeant();
  const gait = $("walk-gait").value;
  if (gait && tether()) throw new Error("No gait hangs on a tether: plan a free walk, or take the tether off.");
  await freeze();
  if (gait) await post("/sessions/current/gaits", { goal, settings: { gait } });
  else await post("/sessions/current/walks", { goal, settings: walkSettings(), tether: tether() });
});

function draw({ summary, walk }) {
  if (!summary) return;
  $("plan-walk").textContent = $("walk-gait").value ? "Plan gait" : "Plan walk";
  const doubt = outOfDate(summary.up_to_date.walk);
  $("walk-doubt").hidden = !doubt;
  $("walk-doubt").textContent = doubt ? `Out of date: ${doubt}. Plan the walk again.` : "";
  drawWalking(summary.walking);
  if ((walk?.digest ?? "") === shown) return;
  shown = walk?.digest ?? "";
  if (walk) show(walk);
  else $("walk-answer").replaceChildren();
}

const nextOf = (here) => (here.leg === null ? "the chassis goes to the goal" : `foot move ${here.next + 1} – leg ${here.leg}`);

function drawWalking(here) {
  $("walk-done").hidden = !here;
  $("walk-done").textContent = here?.text ?? "";
  $("walk-against").hidden = !here?.against;
  $("walk-against").textContent = here?.against ?? "";
  $("walk-next").textContent = here && here.next !== null ? `Next: ${nextOf(here)}` : "Next foot move";
  for (const [number, item] of [...$("walk-answer").querySelectorAll("ol > li")].entries()) {
    item.classList.toggle("done", Boolean(here) && number < here.done);
    if (here && number === here.next) item.setAttribute("aria-current", "step");
    else item.removeAttribute("aria-current");
  }
}

// What planning came to, as a class and in words.
export function walkTold({ status, plan, reason }) {
  return status === "found" ? ["yes", `Walk found: ${inWords(plan)}`] : ["no", `No walk (${statusTold(status, "the rover")}): ${reason}`];
}

function show(answer) {
  const [className, textContent] = walkTold(answer);
  $("walk-answer").replaceChildren(
    element("p", { className, textContent }),
    ...tethersOf(answer),
    ...(answer.smoothed ? [element("p", { id: "walk-smoothed", className: "hint", textContent: smoothedInWords(answer.smoothed) })] : []),
    ...(answer.partial ? [element("p", { className: "doubt", textContent: `It comes this far: ${inWords(answer.partial)}` })] : []),
    element("ul", {}, ...answer.checks.map((one) => element("li", {
      className: one.holds ? "yes" : "no",
      textContent: `${one.name}${one.margin === null ? "" : ` ${fixed(one.margin)} ${one.unit}`} ${one.where}`,
    })), ...answer.blocked.map((one) => element("li", { className: "no", textContent: blockedBy(one) }))),
    element("ol", { "aria-label": "Foot moves" }, ...footMoves(answer.plan ?? answer.partial)),
  );
  drawWalking(walking());
}

function tethersOf({ plan, partial }) {
  const { tethered } = plan ?? partial ?? {};
  return tethered ? [element("p", { id: "walk-tethered", className: "hint", textContent: tetherInWords(tethered) })] : [];
}

// What smoothing changed of the walk as it was found; the same on both sides is said once.
function smoothedInWords({ before, after }) {
  const change = (text, of) => (text(before) === text(after) ? of(text(after)) : of(`${text(before)} → ${text(after)}`));
  return `Smoothed: ${[
    change((one) => String(one.foot_moves), (told) => `${told} foot moves`),
    change((one) => fixed(one.chassis_way, 2), (told) => `${told} m of the chassis' way`),
    change((one) => fixed(one.turning, 1), (told) => `${told} rad of joints' turning`),
    change((one) => fixed(100 * one.largest_torque, 0), (told) => `largest torque ${told} %`),
    change((one) => fixed(100 * one.mean_torque, 0), (told) => `${told} % in the mean of foot moves`),
    change((one) => fixed(one.least_margin, 2), (told) => `least margin ${told} m`),
  ].join(", ")}.`;
}

function inWords(plan) {
  const stood = plan.Ts_site_base.map((T) => [T[0][3], T[1][3], T[2][3]]);
  const way = stood.slice(1).reduce((sum, at, i) => sum + Math.hypot(...at.map((one, axis) => one - stood[i][axis])), 0);
  return `${plan.legs.length} foot move${plan.legs.length === 1 ? "" : "s"}, the chassis goes ${fixed(way, 2)} m, least margin ${fixed(Math.min(...plan.margins))} m, largest torque ${fixed(100 * Math.max(...plan.torques), 0)} % of its limit`;
}

function blockedBy({ check_name, leg, x, y, count }) {
  return `blocked ${count} times by ${check_name}${leg === null ? "" : ` of leg ${leg}`}${x === null ? "" : ` at (${fixed(x, 2)}, ${fixed(y, 2)}) m`}`;
}

// In the scene they have the same numbers. Margin and torque are the worst of each, and the worst of the walk is said.
function footMoves(plan) {
  const worst = { margin: Math.min(...(plan?.margins ?? [])), torque: Math.max(...(plan?.torques ?? [])) };
  const out = plan?.tethered ? paidOut(plan) : [];
  return (plan?.legs ?? []).map((leg, number) => {
    const at = plan.stances[number + 1].contacts[leg];
    const rows = plan.moves.flatMap((move, row) => (move === number ? [row] : []));
    const margin = Math.min(...rows.map((row) => plan.margins[row]));
    const torque = Math.max(...rows.map((row) => plan.torques[row]));
    return element("li", {},
      `leg ${leg} to (${fixed(at[0], 2)}, ${fixed(at[1], 2)}) m, `,
      figure(`margin ${fixed(margin, 2)} m`, margin === worst.margin, "least"), ", ",
      figure(`torque ${fixed(100 * torque, 0)} %`, torque === worst.torque, "most"),
      number in out ? `, tether ${signed(out[number], 2)} m ` : " ",
      mark("Forbid", `Forbid the place of foot move ${number + 1}`, () => say({ ...places, forbidden: [...places.forbidden, place(at)] })),
      mark("Pin", `Pin the place of foot move ${number + 1}`, () => say({ ...places, pinned: [...places.pinned, { ...place(at), leg }] })));
  });
}

const place = ([x, y]) => ({ x, y });
const figure = (text, worst, what) => element("span", { textContent: worst ? `${text} (${what})` : text, title: worst ? `The ${what} of the whole walk` : "" });
const mark = (textContent, ariaLabel, onclick) => element("button", { type: "button", textContent, ariaLabel, onclick });
