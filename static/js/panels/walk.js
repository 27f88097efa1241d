// Walk: ask for a walk to a goal, and read its foot moves, or what stopped it and how far it comes.

import { act } from "../acts.js";
import { get, post } from "../api.js";
import { settled } from "../choosing.js";
import { $, attempt, element, fixed } from "../dom.js";
import { freeze } from "../stance.js";
import { known, subscribe } from "../store.js";

let shown = ""; // digest of the walk that is shown

export function start() {
  $("walk-form").addEventListener("submit", (event) => event.preventDefault()); // its button acts
  act({
    text: "Goal of the walk at the chosen footfall", button: "walk-here", run: takeFootfall,
    refusal: () => (known.summary?.footfall ? "" : "Choose a place first: click on the ground."),
  });
  act({ text: "Plan the walk to its goal", button: "plan-walk", run: plan });
  subscribe(draw);
}

const takeFootfall = () => attempt(async () => {
  await settled();
  const { x, y } = known.summary.footfall;
  $("panel-walk").open = true;
  $("walk-x").value = x.toFixed(3);
  $("walk-y").value = y.toFixed(3);
});

const plan = () => attempt(async () => {
  $("panel-walk").open = true;
  if (!$("walk-form").reportValidity()) return;
  const heading = $("walk-yaw").value;
  const goal = { x: Number($("walk-x").value), y: Number($("walk-y").value), yaw: heading === "" ? null : (Number(heading) * Math.PI) / 180 };
  await freeze();
  await post("/sessions/current/walks", { goal, settings: { seed: Number($("seed").value) } });
});

async function draw({ summary }) {
  if (!summary) return;
  const doubt = summary.up_to_date.walk?.fits === false ? summary.up_to_date.walk.reason : "";
  $("walk-doubt").hidden = !doubt;
  $("walk-doubt").textContent = doubt ? `▲ Out of date: ${doubt}. Plan the walk again.` : "";
  if ((summary.walk ?? "") === shown) return;
  shown = summary.walk ?? "";
  const digest = shown;
  if (!digest) {
    $("walk-answer").replaceChildren();
    return;
  }
  const answer = await get(`/sessions/current/walks/${digest}`);
  if (shown === digest) show(answer); // else a newer one came meanwhile
}

function show(answer) {
  const found = answer.status === "found";
  $("walk-answer").replaceChildren(
    element("p", { className: found ? "yes" : "no", textContent: found ? `found: ${inWords(answer.plan)}` : `${answer.status.replaceAll("_", " ")}: ${answer.reason}` }),
    ...(answer.partial ? [element("p", { className: "doubt", textContent: `It comes this far: ${inWords(answer.partial)}` })] : []),
    element("ul", {}, ...answer.checks.map((one) => element("li", {
      className: one.holds ? "yes" : "no",
      textContent: `${one.name}${one.margin === null ? "" : ` ${fixed(one.margin)} ${one.unit}`} ${one.where}`,
    })), ...answer.blocked.map((one) => element("li", { className: "no", textContent: blockedBy(one) }))),
    element("ol", { "aria-label": "Foot moves" }, ...footMoves(answer.plan ?? answer.partial)),
  );
}

function inWords(plan) {
  const places = plan.Ts_site_base.map((T) => [T[0][3], T[1][3], T[2][3]]);
  const way = places.slice(1).reduce((sum, at, i) => sum + Math.hypot(...at.map((one, axis) => one - places[i][axis])), 0);
  return `${plan.legs.length} foot move${plan.legs.length === 1 ? "" : "s"}, the chassis goes ${fixed(way, 2)} m, least margin ${fixed(Math.min(...plan.margins))} m, largest torque ${fixed(100 * Math.max(...plan.torques), 0)} % of its limit`;
}

function blockedBy({ check_name, leg, x, y, count }) {
  return `blocked ${count} times by ${check_name}${leg === null ? "" : ` of leg ${leg}`}${x === null ? "" : ` at (${fixed(x, 2)}, ${fixed(y, 2)}) m`}`;
}

// In the scene they have the same numbers.
function footMoves(plan) {
  return (plan?.legs ?? []).map((leg, number) => {
    const [x, y] = plan.stances[number + 1].contacts[leg];
    return element("li", { textContent: `leg ${leg} to (${fixed(x, 2)}, ${fixed(y, 2)}) m` });
  });
}
