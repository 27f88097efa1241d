// The plan of a step: asked for, answered, compared with others; what if the chassis stood elsewhere.

import { degrees, fixed, metres, newtons, place } from "../figures.js";
import { statusTold } from "./kinds.js";

export const settingsAsDelivered = "Settings of the plan as delivered";
export const planStep = "Plan the step";
export const nearestInstead = "Step to the nearest good place instead";
export const noGoodPlace = "There is no good place to offer: the footfall is not refused, or none is near.";
export const noPlanYet = "No plan yet: choose a footfall, then plan the step.";
export const found = ({ planner, waypoints }, reason) => `Found${planner ? ` by ${planner}` : ""}: ${waypoints.length} waypoints. ${reason}`;
export const notFound = (status, reason) => `No plan (${statusTold(status)}): ${reason}`;
export const ended = (status, reason) => `${statusTold(status)}. ${reason}`;
export const ofAnother = ({ leg, x, y }) => `This answer is for leg ${leg} at ${place([x, y])}, not for the chosen footfall.`;
export const answerOutOfDate = (why) => `This answer is out of date: ${why}.`;
export const newerGround = "The terrain is newer, but the same where this plan looked. Plan it again to send it: commands are sent only on the terrain that they were planned on.";

// A check's margin in the unit that it has.
export const marginOf = ({ margin, unit }) => (margin === null ? "–" : `${fixed(margin)} ${unit}`);

// A check on one line: what it has to spare, and where that is least.
export const checkTold = ({ name, margin, unit, where }) => {
  const size = margin === null ? "" : `${fixed(Math.abs(margin))} ${unit} ${margin < 0 ? "short" : "to spare"}`;
  return [name + (size && `: ${size}`), where].filter(Boolean).join(size ? ", " : " ");
};

// -- whether it fits how things are now ------------------------------------------------------------

export const stanceUnknown = (why) => `whether the rover still stands so is not known: ${why}`;
export const sameGround = "the terrain is newer, and the same where this looked";

// -- alternatives ----------------------------------------------------------------------------------

export const askAlternatives = "Ask for alternatives of the plan";
export const nextAlternative = "Choose the next of the alternatives";
export const noAlternatives = "There are no alternatives to choose from: ask for them first.";
export const goOn = "Go on from the plan's predicted end";
export const noPlanToGoOn = "There is no plan to go on from: plan the step first.";
export const goesOnFrom = (end) => `Going on starts from the predicted end of ${end}.`;
export const plannedFrom = (end) => `Planned from the predicted end of ${end}. What is made from here can be sent once the rover stands there.`;

const ENDS = { plan: "the plan", execution: "the prediction of sag", queue: "the queue", commands: "the commands" };

// Which of what was made of a step it is, and whether the rover sags there.
export const endOf = ({ of, sags }) => `${ENDS[of]}, ${sags ? "the rover's sag in it" : "the rover taken as rigid"}`;

// -- what if ---------------------------------------------------------------------------------------

export const whatIf = "What if the chassis stood elsewhere";
export const findShift = "Find a chassis shift for the footfall";
export const chooseForShift = "Choose the footfall first that a shift is to make possible.";
export const checkMove = "Check the move of the chassis";
export const noWhatIf = "There is no what-if.";
export const planningThere = (force) => `Planning as if the chassis stood there. Largest wheel force ${newtons(force)}, predicted.`;
export const lookingForShift = "Looking for a shift…";
export const afterStep = "after the planned step";
export const chassisAt = (shift) => `chassis ${shift}`;
export const unmoved = "unmoved";
export const statusOutOfDate = (why) => ` ▲ OUT OF DATE: ${why}`;
export const askAgain = (why) => `▲ Out of date: ${why}. Ask again.`;
export const shiftFound = (shift, reason) => `A shift makes it possible: ${shift}. ${reason}`;
export const moveFound = (shift, count) => `The chassis can go there, ${shift}, through ${count} postures of all legs.`;

/** @type {[string, string, number][]} name, text, how much one of the field is */
export const FIELDS = [
  ["dx", "East [m]", 1], ["dy", "North [m]", 1], ["dz", "Up [m]", 1],
  ["droll", "Roll [°]", Math.PI / 180], ["dpitch", "Pitch [°]", Math.PI / 180], ["dyaw", "Yaw [°]", Math.PI / 180],
];

// A shift by what of it is not nothing.
export const shiftTold = (shift) => FIELDS.filter(([name]) => Math.abs(shift[name]) > 1e-6)
  .map(([name, text, unit]) => `${text.replace(/ \[.*/, "").toLowerCase()} ${unit === 1 ? metres(shift[name]) : degrees(shift[name])}`).join(", ");

// -- on the page from the beginning -----------------------------------------------------------------

export const ifElsewhere = "What if the chassis stood elsewhere? (key W)";
export const feetStay = "The feet stay. East, north, up in metres; roll, pitch, yaw in degrees. Nothing is sent.";
export const showWhatIf = "Show what if";
export const findIt = "Find a shift for the footfall";
export const checkIt = "Check the move";
export const keepReserve = "{} Keep a reserve";
export const aboutReserve = "No leg ends straight or at a joint's limit, from where the next shift would be refused";
export const title = "{} Plan";
export const planner = "Planner {}";
export const seed = "Seed {}";
export const step = "Plan step";
export const stepOf = (what) => `Plan step: ${what}`;
export const settings = "Settings";
export const lift = "Lift [m] {}";
export const raise = "Raise terrain [m] {}";
export const clearance = "Extra clearance [m] {}";
export const leastMargin = "Least margin [m] {}";
export const knee = "Knee at the goal {}";
export const either = "either";
export const kneeUp = "up";
export const kneeDown = "down";
export const posture = "Goal posture {}";
export const aboutPosture = "Which of the postures that stand on the footfall is tried first: all keep every clearance, more room mostly takes a longer motion";
export const shortest = "shortest motion";
export const mostRoom = "most room";
export const friction = "Friction μ {}";
export const rho = "ρ [rad] {}";
export const milestones = "Milestones s {}";
export const epsilon = "ε [rad] {}";
export const grid = "A* grid [m] {}";
export const timeLimit = "Time limit [s] {}";
export const asDelivered = "As delivered";
export const nearest = "Nearest good place";
export const why = "Why this plan";
export const alternatives = "Alternatives";
export const onFromEnd = "Go on from its end";
export const isChosen = "This plan is chosen.";
export const chooseOne = "Alternatives: choose with a click or with key K";
export const plan = "Plan";
export const wheel = "Wheel [m]";
export const time = "Time [s]";
export const clear = "Clearance [m]";
export const margin = "Margin [m]";
