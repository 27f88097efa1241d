// What comes next for an operator who walks the rover: one thing at a time, from what is known. Nothing is done or shown here.

import { armIt, goOn, makeCommandsOf, next as nextRow } from "./texts/commands.js";
import { build, takeImages } from "./texts/ground.js";
import * as texts from "./texts/next.js";
import { step as planStep } from "./texts/plan.js";
import * as shared from "./texts/shared.js";
import { chassisToItsGoal, fromHere, goOnByItself, holdIt, ofWalk } from "./texts/walk.js";

const OLD = 3600; // s: ground that was seen longer ago is looked at again
const SAME = 0.01; // m, rad: a goal as near as this to another is that one

// facts: as panels/next.js gathers them. The answer: button, the id of the button whose act it is, "" where there is nothing
// to do but wait; text, what it is; about, what to know of it; judge, whose verdict belongs to it: "run", "loop", "sequence",
// "walk", "gait", or "".
export function nextThing(facts) {
  const { gate, armed, loop, making, picking, stopped } = facts;
  if (stopped) return wait(texts.stopped, facts.notCleared ? texts.notClearedHere(facts.notCleared) : texts.aboutStopped, "run");
  if (loop && (loop.state === "held" || !gate.waiting)) return byItself(loop, facts);
  if (gate.state === "sending") return underWay(gate, facts);
  if (armed) return thing("send", shared.send, texts.aboutSend(armed), "sequence");
  if (making) return wait(texts.waitFor(making), texts.aboutWait);
  if (facts.whole) return asAWhole(facts, facts.whole);
  if (isOnItsWay(facts)) return onward(facts);
  return lookedAt(facts) ?? toGoal(facts) ?? (picking ? PICKS : lookedAgain(facts))
    ?? thing("walk-to", texts.walkTo, texts.aboutWalkTo, facts.walked ? "run" : "");
}

const thing = (button, text, about = "", judge = "") => ({ button, text, about, judge });
const wait = (text, about, judge = "") => thing("", text, about, judge);

const PICKS = wait(texts.click, texts.aboutClick);

// Whether the page's goal is the one that the walk, or the gait, was asked for. Where any heading will do (null), so does the walk's.
const isMeant = ({ goal, heading, walk }) => Boolean(walk && goal) && Math.hypot(walk.goal.x - goal[0], walk.goal.y - goal[1]) <= SAME
  && (heading === null || (typeof walk.goal.yaw === "number" && isSameAngle(walk.goal.yaw, heading)));

// Whether the gait that is chosen was planned to the page's goal from how things are; it is not commanded.
const isGaited = (facts) => facts.gait !== "" && facts.gaited?.name === facts.gait && facts.gaited.fits && isMeant({ ...facts, walk: facts.gaited });

const isSameAngle = (one, other) => Math.abs(Math.atan2(Math.sin(one - other), Math.cos(one - other))) <= SAME;

const isOnItsWay = (facts) => facts.walking !== null && facts.walking.next !== null && (facts.goal === null || isMeant(facts));

// The rover walks to its goal by itself: it is held, or let go on. part: of the walk, that is under way or next.
function byItself({ state, goal, part: next, waits_for: waits }, { gate, part }) {
  const about = texts.byItself(goal.x, goal.y, part || next, waits);
  if (state !== "held") return thing("loop-hold", holdIt, about, "loop");
  if (gate.state === "sending" && !gate.waiting) return wait(texts.heldPresent(gate.mode === "steps" ? texts.rowEnds : texts.commandsEnd), about, "loop");
  return thing("loop-on", goOnByItself, about, "loop");
}

function underWay({ waiting, why, aborted }, { part }) {
  if (!waiting || aborted) return wait(aborted ? texts.presentRowEnds : texts.underWay(part || texts.commands), texts.aboutUnderWay, "run");
  return why === "step by step" ? thing("run-next", nextRow, "", "run") : thing("run-resume", goOn, texts.aboutGoOn, "run");
}

// The next foot move of a walk that was found, or all that are left. places: that it was planned without, in words: no gait heeds them.
function onward({ walking, places, ready, rest, gait }) {
  const judge = walking.done ? "run" : "walk";
  if (places) return gait ? wait(texts.chooseFree, places, judge) : thing("plan-walk", shared.planWalk, places, judge);
  if (walking.against) return thing("walk-again", fromHere, walking.against, judge);
  const left = walking.of - walking.done;
  const parts = rest ? left : 1;
  if (ready === parts) return thing("arm", armIt, texts.aboutArm, "sequence");
  return thing(rest ? "walk-rest" : "walk-next", makeCommandsOf(partTold(walking, rest)), "", judge);
}

// The next part of a walk, or all that are left: the chassis' last way is no foot move.
function partTold({ done, foot_moves: moves, leg }, rest) {
  if (leg === null) return chassisToItsGoal;
  return rest ? texts.footMovesToGoal(moves - done) : ofWalk(done + 1, moves, leg);
}

// A robot that others described walks as a whole. planned: the plan, not carried out, that commands are to be made of; null: none.
// footfall: the chosen one where no step to it was planned. sees: whether it has cameras.
function asAWhole(facts, { planned, footfall, sees }) {
  const { ground, goal, walk, fits, ready, picking } = facts;
  if (ready) return thing("arm", armIt, texts.aboutArm, "sequence");
  const look = sees ? lookedAt(facts) : null;
  if (look) return look;
  if (!ground) return wait(texts.loadGround, texts.noGround);
  const meant = isMeant(facts);
  if (goal && !(meant && (fits || (walk.plan && planned?.plan !== walk.digest)))) return thing("plan-walk", shared.planWalk, texts.to(goal));
  const judge = meant ? "walk" : "run";
  if (planned) return thing("make-sequence", makeCommandsOf(planned.text), "", judge);
  if (footfall) return thing("plan", planStep, texts.toFootfall(footfall), "");
  const again = sees && !picking ? lookedAgain(facts) : null;
  return again ?? (picking ? { ...PICKS, judge } : thing("walk-to", texts.walkTo, texts.aboutWalkTo, judge));
}

// Ground there must be, of the newest images.
function lookedAt({ ground, look }) {
  if (look && (!ground || look.taken > ground.time)) return thing("build-terrain", build, texts.aboutBuild);
  return ground ? null : thing("take-images", takeImages, texts.noGround);
}

// A goal that no walk was planned for. One that was refused is refused again, until the ground or the goal is another.
function toGoal(facts) {
  const { goal, walking, fits, picking } = facts;
  if (!goal || (isMeant(facts) && walking)) return null;
  if (isGaited(facts)) return picking ? { ...PICKS, judge: "gait" } : thing("walk-to", texts.chooseAnother, texts.aboutGaited, "gait");
  if (!facts.gait && isMeant(facts) && fits) return picking ? { ...PICKS, judge: "walk" } : thing("walk-to", texts.chooseAnother, "", "walk");
  return thing("plan-walk", facts.gait ? shared.planGait : shared.planWalk, texts.to(goal));
}

function lookedAgain({ look, ground, now, walked }) {
  const judge = walked ? "run" : "";
  if (look?.moved) return thing("take-images", texts.lookAgain, texts.since(look.reason.replace(/ since$/, "")), judge);
  if (look && now - ground.seen > OLD) return thing("take-images", takeImages, texts.oldGround, judge);
  return null;
}
