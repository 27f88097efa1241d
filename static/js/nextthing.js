// What comes next for an operator who walks the rover: one thing at a time, from what is known. Nothing is done or shown here.

import { fixed } from "./figures.js";

const OLD = 3600; // s: ground that was seen longer ago is looked at again
const SAME = 0.01; // m, rad: a goal as near as this to another is that one

// facts: as panels/next.js gathers them. The answer: button, the id of the button whose act it is, "" where there is nothing
// to do but wait; text, what it is; about, what to know of it; judge, whose verdict belongs to it: "run", "loop", "sequence",
// "walk", or "".
export function nextThing(facts) {
  const { gate, armed, loop, making, picking, stopped } = facts;
  if (stopped) return wait("A stop is in force", "Clear it, left of STOP, once it is safe to go on.", "run");
  if (loop && (loop.state === "held" || !gate.waiting)) return byItself(loop, facts);
  if (gate.state === "sending") return underWay(gate, facts);
  if (armed) return thing("send", "Send to rover", `Armed for ${armed} s more. The run holds where the rover does not stand as it was to.`, "sequence");
  if (making) return wait(`Wait for the ${making}`, "Progress and Cancel are in the bar above.");
  if (isOnItsWay(facts)) return onward(facts);
  return lookedAt(facts) ?? toGoal(facts) ?? (picking ? PICKS : lookedAgain(facts))
    ?? thing("walk-to", "Walk to…", "A click on the ground is the goal, or type how far to go.", facts.walked ? "run" : "");
}

const thing = (button, text, about = "", judge = "") => ({ button, text, about, judge });
const wait = (text, about, judge = "") => thing("", text, about, judge);

const PICKS = wait("Click on the ground", "Or type how far to go, under Plan. Escape leaves.");

// Whether the page's goal is the one that the walk was asked for. Where any heading will do (null), so does the walk's.
const isMeant = ({ goal, heading, walk }) => Boolean(walk && goal) && Math.hypot(walk.goal.x - goal[0], walk.goal.y - goal[1]) <= SAME
  && (heading === null || (typeof walk.goal.yaw === "number" && isSameAngle(walk.goal.yaw, heading)));

const isSameAngle = (one, other) => Math.abs(Math.atan2(Math.sin(one - other), Math.cos(one - other))) <= SAME;

const placeTold = (x, y) => `(${fixed(x, 2)}, ${fixed(y, 2)}) m`;

const isOnItsWay = (facts) => facts.walking !== null && facts.walking.next !== null && (facts.goal === null || isMeant(facts));

// The rover walks to its goal by itself: it is held, or let go on. part: of the walk, that is under way or next.
function byItself({ state, goal, part: next, waits_for: waits }, { gate, part }) {
  const about = `By itself to ${placeTold(goal.x, goal.y)}${part || next ? `: ${part || next}` : ""}.${waits ? ` Waits for ${waits}.` : ""}`;
  if (state !== "held") return thing("loop-hold", "Hold the walk", about, "loop");
  if (gate.state === "sending" && !gate.waiting) return wait(`Held: the present ${gate.mode === "steps" ? "row ends" : "commands end"}`, about, "loop");
  return thing("loop-on", "Go on by itself", about, "loop");
}

function underWay({ waiting, why, aborted }, { part }) {
  if (!waiting || aborted) return wait(aborted ? "The present row ends" : `Under way: ${part || "commands"}`, "It goes on while the rover stands as it was to. Hold and Abort are under Commands.", "run");
  return why === "step by step" ? thing("run-next", "Next row", "", "run") : thing("run-resume", "Go on", why, "run");
}

// The next foot move of a walk that was found, or all that are left.
function onward({ walking, ready, rest }) {
  const judge = walking.done ? "run" : "walk";
  if (walking.against) return thing("walk-again", "Re-plan from here", walking.against, judge);
  const left = walking.of - walking.done;
  const parts = rest ? left : 1;
  if (ready === parts) return thing("arm", "Arm", "Look at the ghost first; then there are ten seconds to send.", "sequence");
  const mover = walking.leg === null ? "the chassis" : `leg ${walking.leg}`;
  const which = parts > 1 ? `${parts} moves to the goal` : `move ${walking.done + 1} of ${walking.of}: ${mover}`;
  return thing(rest ? "walk-rest" : "walk-next", `Make commands: ${which}`, "", judge);
}

// Ground there must be, of the newest images.
function lookedAt({ ground, look }) {
  if (look && (!ground || look.taken > ground.time)) return thing("build-terrain", "Build terrain", "The newest images are not in the ground yet.");
  return ground ? null : thing("take-images", "Take images", "There is no ground yet.");
}

// A goal that no walk was planned for. One that was refused is refused again, until the ground or the goal is another.
function toGoal(facts) {
  const { goal, walking, fits, picking } = facts;
  if (!goal || (isMeant(facts) && walking)) return null;
  if (isMeant(facts) && fits) return picking ? { ...PICKS, judge: "walk" } : thing("walk-to", "Choose another goal", "", "walk");
  return thing("plan-walk", facts.gait ? "Plan gait" : "Plan walk", `To ${placeTold(...goal)}.`);
}

function lookedAgain({ look, ground, now, walked }) {
  const judge = walked ? "run" : "";
  if (look?.moved) return thing("take-images", "Look again: take images", `Since the newest images, ${look.reason.replace(/ since$/, "")}.`, judge);
  if (look && now - ground.time > OLD) return thing("take-images", "Take images", "The ground was seen more than an hour ago.", judge);
  return null;
}
