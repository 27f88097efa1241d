// Walk: ask for a walk to a goal, read its foot moves, or what stopped it and how far it comes, and carry it out: each foot
// move becomes commands from where the rover stands, which are armed and sent as all are.

import { act } from "../acts.js";
import { once, post } from "../api.js";
import { settled } from "../choosing.js";
import { $, attempt, element } from "../dom.js";
import { isWalking, walkOutOfDate } from "../fits.js";
import { unfold } from "../layout.js";
import { rememberInSession } from "../remembered.js";
import { isAthletes, orders } from "../robot.js";
import { freeze } from "../stance.js";
import { changed, known, subscribe } from "../store.js";
import { checkTold } from "../texts/plan.js";
import * as shared from "../texts/shared.js";
import * as texts from "../texts/walk.js";
import { sagSettings } from "./execution.js";
import { isFilledIn } from "./goal.js";
import { addPlaces, forgetMet, placesSaid, settleMoves, takeFootfallOf, unheededPlaces } from "./places.js";
import { alongRoute } from "./route.js";
import { paidOut, showTether, tether } from "./tether.js";

let shown = ""; // digest of the walk that is shown
let made = 0; // foot moves of it

export function start() {
  $("walk-form").addEventListener("submit", (event) => event.preventDefault()); // its button acts
  act({ text: texts.planToGoal, button: "plan-walk", run: planWalk });
  for (const id of ["walk-gait", "walk-yaw"]) $(id).addEventListener("input", changed); // what comes next goes by them
  rememberInSession("walk-gait", "walk-yaw");
  act({ text: texts.commandNext, button: "walk-next", run: () => command(1), refusal: notNext });
  act({ text: texts.commandRest, button: "walk-rest", run: () => command(left()), refusal: notNext });
  act({ text: texts.planAgain, button: "walk-again", run: again, refusal: () => (known.summary?.walk ? unheededPlaces() : texts.noWalk) });
  subscribe(draw);
}

const walking = () => known.summary?.walking ?? null;
const left = () => walking().of - walking().done;

function notNext() {
  if (!walking()) return texts.noWalkToCommand;
  if (walking().next === null) return texts.walkOver;
  if (known.summary.gate.state === "sending") return shared.sendingAlready;
  return unheededPlaces() || walking().against;
}

const command = (count) => attempt(async () => {
  unfold("walk");
  const { walk, next } = walking();
  const way = $("as-commanded").checked ? { as_commanded: true } : { settings: sagSettings() };
  await post(`/sessions/current/walks/${walk}/sequence`, { first: next, count, ...way }, once());
  unfold("commands"); // what is looked at and sent next
});

const again = () => attempt(async () => {
  unfold("walk");
  await post(`/sessions/current/walks/${known.summary.walk}/again`, {});
});

// As the fields have it: yaw null where any heading will do.
export function goalMeant() {
  const heading = $("walk-yaw").value;
  return { x: Number($("walk-x").value), y: Number($("walk-y").value), yaw: heading === "" ? null : (Number(heading) * Math.PI) / 180 };
}

export const walkSettings = () => ({ seed: Number($("seed").value), ...placesSaid() });

const planWalk = () => attempt(async () => {
  await settled();
  unfold("goal");
  showTether();
  if (!isFilledIn()) return;
  const goal = goalMeant();
  if (!isAthletes()) {
    await freeze();
    await post(orders("walk"), { goal, ...alongRoute(goal) });
    return;
  }
  const gait = $("walk-gait").value;
  if (gait && tether()) throw new Error(texts.noGaitOnTether);
  await freeze();
  if (gait) await post("/sessions/current/gaits", { goal, settings: { gait } });
  else await post(orders("walk"), { goal, settings: walkSettings(), tether: tether() });
});

function draw({ summary, walk }) {
  if (!summary) return;
  $("plan-walk").textContent = $("walk-gait").value ? shared.planGait : shared.planWalk;
  const doubt = summary.walking?.done ? "" : walkOutOfDate(known); // of what is left, walk-against tells
  $("walk-doubt").hidden = !doubt;
  $("walk-doubt").textContent = doubt ? texts.outOfDate(doubt) : "";
  drawWalking(summary.walking);
  const before = made;
  made = walk && summary.walking?.walk === walk.digest ? summary.walking.done : 0;
  if (made > before) forgetMet(made);
  if ((walk?.digest ?? "") === shown) return;
  shown = walk?.digest ?? "";
  settleMoves();
  if (walk) show(walk);
  else $("walk-answer").replaceChildren();
}

const nextOf = (here) => (here.leg === null ? texts.chassisToGoal : texts.nextMove(here.next + 1, here.leg));

function drawWalking(here) {
  $("walk-done").hidden = !here;
  $("walk-done").textContent = here?.text ?? "";
  const against = isWalking(known) ? "" : here?.against ?? "";
  $("walk-against").hidden = !against;
  $("walk-against").textContent = against;
  $("walk-next").textContent = here && here.next !== null ? texts.nextIs(nextOf(here)) : texts.nextFootMove;
  for (const [number, item] of [...$("walk-answer").querySelectorAll("ol > li")].entries()) {
    item.classList.toggle("done", Boolean(here) && number < here.done);
    if (here && number === here.next) item.setAttribute("aria-current", "step");
    else item.removeAttribute("aria-current");
  }
}

// What planning came to, as a class and in words.
export function walkTold({ status, plan, reason }) {
  return status === "found" ? ["yes", texts.found(plan)] : ["no", texts.notFound(status, reason)];
}

function show(answer) {
  const [className, textContent] = walkTold(answer);
  $("walk-answer").replaceChildren(
    element("p", { className, textContent }),
    ...tethersOf(answer),
    ...(answer.smoothed ? [element("p", { id: "walk-smoothed", className: "hint", textContent: texts.smoothed(answer.smoothed) })] : []),
    ...(answer.partial ? [element("p", { className: "doubt", textContent: texts.comesThisFar(answer.partial) })] : []),
    element("ul", {}, ...answer.checks.map((one) => element("li", {
      className: one.holds ? "yes" : "no",
      textContent: checkTold(one),
    })), ...answer.blocked.map((one) => element("li", { className: "no", textContent: texts.blocked(one) })), ...(answer.unchecked ?? []).map((what) => element("li", { className: "doubt", textContent: texts.unchecked(what) }))),
    element("ol", { "aria-label": texts.footMoves }, ...footMoves(answer.plan ?? answer.partial)),
  );
  drawWalking(walking());
}

function tethersOf({ plan, partial }) {
  const { tethered } = plan ?? partial ?? {};
  return tethered ? [element("p", { id: "walk-tethered", className: "hint", textContent: texts.tetherTold(tethered) })] : [];
}

// In the scene they have the same numbers; of a robot that others described nothing more is told of each. Margin and torque are the worst of each, and the worst of the walk is said.
function footMoves(plan) {
  if (plan && !plan.stances) return plan.legs.map((leg) => element("li", { textContent: shared.leg(leg) }));
  const worst = { margin: Math.min(...(plan?.margins ?? [])), torque: Math.max(...(plan?.torques ?? [])) };
  const out = plan?.tethered ? paidOut(plan) : [];
  return (plan?.legs ?? []).map((leg, number) => {
    const at = plan.stances[number + 1].contacts[leg];
    const rows = plan.moves.flatMap((move, row) => (move === number ? [row] : []));
    const margin = Math.min(...rows.map((row) => plan.margins[row]));
    const torque = Math.max(...rows.map((row) => plan.torques[row]));
    return element("li", {},
      texts.legTo(leg, at.slice(0, 2)),
      figure(texts.marginOf(margin), margin === worst.margin, "least"), ", ",
      figure(texts.torqueOf(torque), torque === worst.torque, "most"),
      number in out ? texts.tetherBy(out[number]) : " ",
      mark(texts.forbid, texts.forbidPlace(number + 1), () => addPlaces({ forbidden: [place(at)], pinned: [] })),
      mark(texts.pin, texts.pinPlace(number + 1), () => addPlaces({ forbidden: [], pinned: [{ ...place(at), leg }] })),
      element("button", { type: "button", textContent: texts.move, ariaLabel: texts.movePlace(number + 1), title: texts.aboutMove, "data-moves": number, onclick: () => takeFootfallOf(number) }),
      element("em", { "data-moved": "" }));
  });
}

const place = ([x, y]) => ({ x, y });
const figure = (text, worst, what) => element("span", { textContent: worst ? texts.worst(text, what) : text, title: worst ? texts.worstOfWalk(what) : "" });
const mark = (textContent, ariaLabel, onclick) => element("button", { type: "button", textContent, ariaLabel, onclick });
