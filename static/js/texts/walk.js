// Walks: to a goal, by routes, gaits, on a tether, by itself; their foot moves.

import { age, bare, fixed, metres, newtons, percent, place, seconds, signed } from "../figures.js";
import { ofWalkers } from "./kinds.js";

// -- goal ------------------------------------------------------------------------------------------

export const goalAtFootfall = "Goal of the walk at the chosen footfall";
export const choosePlace = "Choose a place first: click on the ground.";
export const walkTo = "Walk to…: a click on the ground sets the goal";

// -- walk ------------------------------------------------------------------------------------------

export const planToGoal = "Plan the walk, or the gait, to its goal";
export const commandNext = "Commands of the walk's next foot move";
export const commandRest = "Commands of all that is left of the walk";
export const planAgain = "Re-plan the walk from here";
export const noWalk = "There is no walk yet.";
export const keepOffGround = "Keep off the ground around the footfall";
export const chooseWhatToKeepOff = "Choose a footfall first: the ground around it is kept off.";
export const areaTooSmall = (least) => `Ground that is kept off has a radius of at least ${least} m.`;
export const areasSince = "ground to keep off was marked since";
export const forgetPlaces = "Forget forbidden and pinned places";
export const noWalkToCommand = "There is no walk yet: plan one to its goal.";
export const walkOver = "The walk is over.";
export const some = (count, what) => `${count} ${what}`;
export const placesHeeded = (places) => `Places: ${places}. The latest walk heeds them.`;
export const placesTold = (places) => `Places: ${places}. Plan the walk to heed them.`;
export const noGaitOnTether = "No gait hangs on a tether: plan a free walk, or take the tether off.";
export const outOfDate = (why) => `Out of date: ${why}. Plan the walk again.`;
export const chassisToGoal = "the chassis goes to the goal";
export const nextMove = (number, leg) => `foot move ${number} – leg ${leg}`;
export const nextIs = (what) => `Next: ${what}`;
export const nextFootMove = "Next foot move";
export const found = (plan) => `Walk found: ${walkTold(plan)}`;
export const notFound = (status, reason) => `No walk (${ofWalkers(status)}): ${reason}`;
export const comesThisFar = (plan) => `It gets this far: ${walkTold(plan)}`;
export const footMoves = "Foot moves";

export function walkTold(plan) {
  const stood = plan.Ts_site_base.map((T) => [T[0][3], T[1][3], T[2][3]]);
  const way = stood.slice(1).reduce((sum, at, i) => sum + Math.hypot(...at.map((one, axis) => one - stood[i][axis])), 0);
  const goes = `${plan.legs.length} foot move${plan.legs.length === 1 ? "" : "s"}, the chassis goes ${metres(way, 2)}`;
  return plan.margins ? `${goes}, least margin ${metres(Math.min(...plan.margins))}, largest torque ${percent(Math.max(...plan.torques))} of its limit` : goes;
}

// What smoothing changed of the walk as it was found; the same on both sides is said once.
export function smoothed({ before, after, cut_short: cutShort }) {
  const change = (text, of) => (text(before) === text(after) ? of(text(after)) : of(`${text(before)} → ${text(after)}`));
  return `${cutShort ? "Smoothed as far as its time limit allowed, so planned again it may be another" : "Smoothed"}: ${[
    change((one) => String(one.foot_moves), (told) => `${told} foot moves`),
    change((one) => fixed(one.chassis_way, 2), (told) => `${told} m of the chassis' way`),
    change((one) => fixed(one.turning, 1), (told) => `${told} rad of joints' turning`),
    change((one) => fixed(100 * one.largest_torque, 0), (told) => `largest torque ${told} %`),
    change((one) => fixed(100 * one.mean_torque, 0), (told) => `${told} % in the mean of foot moves`),
    change((one) => fixed(one.least_margin, 2), (told) => `least margin ${told} m`),
  ].join(", ")}.`;
}

export const unchecked = (what) => `Not checked: ${what}`;
export const blocked = ({ check_name: check, leg, x, y, count }) => `blocked ${count} times by ${check}${leg === null ? "" : ` of leg ${leg}`}${x === null ? "" : ` at ${place([x, y], 2)}`}`;

// -- one foot move ---------------------------------------------------------------------------------

export const legTo = (leg, at) => `leg ${leg} to ${place(at, 2)}, `;
export const marginOf = (value) => `margin ${metres(value, 2)}`;
export const torqueOf = (share) => `torque ${percent(share)}`;
export const tetherBy = (length) => `, tether ${signed(length, 2)} m `;
export const worst = (text, what) => `${text} (${what})`;
export const worstOfWalk = (what) => `The ${what} of the whole walk`;
export const forbid = "Forbid";
export const forbidPlace = (number) => `Forbid the place of foot move ${number}`;
export const pin = "Pin";
export const move = "Move";
export const movePlace = (number) => `Move the footfall of foot move ${number}`;
export const aboutMove = "Then arrow keys move it, Enter puts it there, Esc leaves it. On the map, drag it.";
export const movingTo = (number, at) => `Foot move ${number} to ${place(at, 2)}: Enter puts it there, Esc leaves it.`;
export const movedTo = (at) => ` → ${place(at, 2)}, not planned yet`;
export const MOVE_KEYS = [
  ["← → ↑ ↓", "On a footfall's Move: move it by 5 cm, with Shift by 1 cm"],
  ["Enter Esc", "A footfall that is moved: put it there; leave it"],
];
export const pinPlace = (number) => `Pin the place of foot move ${number}`;
export const ofWalk = (number, count, leg) => `foot move ${number} of ${count}, leg ${leg}`;
export const chassisToItsGoal = "the chassis to its goal";
export const leastMargin = (value) => `least margin ${metres(value, 2)}`;
export const mostTorque = (share) => `most torque ${percent(share)}`;
export const leastSpare = (value) => (value === null ? "clearance to spare not proven" : `at least ${metres(value, 2)} to spare`);
export const oldestGround = (since) => `oldest ground ${age(since)}`;
export const noTimes = "age of the ground not known";
export const workedOut = "being worked out";
export const strip = (count, worsts) => `${count} foot moves; ${worsts.join("; ")}`;
export const worstIn = (what, where) => `${what} in ${where}`;
export const ghostToMargin = "Ghost to the walk's least margin";
export const ghostToTorque = "Ghost to the walk's largest torque";
export const ghostToSpare = "Ghost to where the walk comes nearest to ground or rover";
export const ghostToAge = "Ghost to the walk's footfall on the oldest ground";
export const noWalkPlayed = "The ghost plays no walk.";

// -- tether ----------------------------------------------------------------------------------------

export const anchorAtFootfall = "Anchor of the tether at the chosen footfall";
export const chooseKnownPlace = "Choose a place on known ground first: click on it.";
export const tetherTold = ({ tether: { free_length: free, most_force: most }, lengths, pulls }) =>
  `Tether: ${fixed(lengths[0], 2)} → ${metres(lengths.at(-1), 2)} of ${metres(free, 1)}, pulled with ${fixed(Math.min(...pulls), 0)} to ${newtons(Math.max(...pulls))} of ${newtons(most)}. No command drives its drum.`;

// -- route -----------------------------------------------------------------------------------------

export const planRoute = "Plan a route to the walk's goal";
export const goalAlongRoute = "Goal of the walk along the route";
export const noRoute = "There is no route yet: plan one to the walk's goal.";
export const routeIsOut = (why) => `The route is out of date: ${why}.`;
export const routeOutOfDate = (why) => `The route is out of date: ${why}. Plan it again.`;
export const partTooShort = (least) => `A part of the route is at least ${bare(least)} m long.`;
export const noRouteFound = (status, reason) => `No route (${ofWalkers(status)}): ${reason}`;
export const alongIsOut = (why) => `The route is out of date: ${why}. Plan it again, or walk straight.`;
export const leadsElsewhere = "The route leads to another goal: plan one to this goal, or walk straight.";
export const routeFound = (length, cost, inParts) =>
  `Route of ${metres(length, 1)}; it costs as much as ${metres(cost, 1)} of the best ground. It has no footfalls: ${inParts ? "walk it in parts" : "plan a walk along it"}.`;

// -- gait ------------------------------------------------------------------------------------------

export const gaitOutOfDate = (why) => `The gait is out of date: ${why}. Plan it again.`;
export const gaitFound = (name, plan) => `Gait ${name}: ${gaitTold(plan)}. Only to look at: it is not commanded.`;
export const noGait = (name, status, reason) => `No ${`gait ${name}`.trim()} (${ofWalkers(status)}): ${reason}`;
export const gaitComes = (walked, plan) => `It gets ${metres(walked, 2)} far: ${gaitTold(plan)}`;

const feet = (groups) => groups.reduce((sum, group) => sum + group.length, 0);
const gaitTold = (plan) => `${plan.groups.length} steps, ${feet(plan.groups)} feet moved, stride ${metres(plan.stride, 2)}, least margin ${metres(Math.min(...plan.margins))}, largest torque ${percent(Math.max(...plan.torques))} of its limit`;

// -- by itself -------------------------------------------------------------------------------------

export const beginLoop = "Walk to the goal by itself";
export const holdLoop = "Hold the walk by itself";
export const heldAlready = "The walk is already held.";
export const cancelLoop = "Cancel the walk by itself";
export const resumeLoop = "Go on with the walk by itself";
export const goesOnAlready = "The walk is already going on.";
export const notByItself = "The rover does not walk by itself.";
export const byItselfAlready = "The rover already walks by itself.";
export const sayGoal = "Set the goal of the walk first, in the card Goal.";
export const noTetherByItself = "No command drives the drum of a tether: take it off.";
export const waitsFor = (what) => `Waits for ${what}.`;
export const decision = (act, reason) => `${act}: ${reason}`;
export const begins = "it begins";
export const held = (decided) => `Held. Decided last: ${decided}`;
export const decided = (what) => `Decided: ${what}`;
export const loopEnded = (outcome, reason) => `By itself to the goal: ${outcome}: ${reason}`;
export const farFrom = (left) => `${metres(left, 2)} from`;
export const onTheWayTo = "On the way to";
export const loopTold = (left, { x, y }, moves, looks, plans) => `${left} ${place([x, y], 2)}; foot moves ${moves}, looks ${looks}, plans ${plans}`;

const WAYS = { wave: "a wave", walk: "the walk planner" };

// How a piece is gone, what it costs, and which check refused a gait before.
export function wayTold({ action, found: isFound, foot_moves: moves, motion, refused }) {
  const no = refused ? `No ${refused.gait}: ${refused.reason}. ` : "";
  const cost = isFound ? `${moves} foot moves, ${seconds(motion, 0)} of motion` : "none is found";
  return `${no}This piece by ${WAYS[action] ?? action}: ${cost}.`;
}

// -- on the page from the beginning -----------------------------------------------------------------

export const byItself = "The walk by itself";
export const clickTheGoal = "⚑ Click on the ground: the goal of the walk. {} leaves.";
export const goalTitle = "{} Goal";
export const title = "{} Walk";
export const aboutGoal = "Where the chassis is to be; without a heading, whichever way it faces. Each foot move is made into commands from where the rover stands, and sent as all commands are. Their mode is that under {}.";
export const go = "Go {} m";
export const toward = "toward {} °";
export const aboutToward = "Angle from where the chassis faces, to the left";
export const orTo = "or to x {} m";
export const heading = "Heading {} °";
export const walkToAt = "Walk to… {}";
export const goalHere = "Goal at the footfall";
export const gait = "Gait {}";
export const aboutGait = "A gait moves its feet in a fixed order. Compare it with the walk; it is not commanded";
export const free = "free: a walk";
export const tripod = "tripod";
export const ripple = "ripple";
export const wave = "wave";
export const routeTo = "Plan route";
export const keepOff = "Keep off around footfall";
export const aboutKeepOff = "No foot is put there, and routes keep the chassis off it, from the next plan on";
export const keepOffRadius = "Radius {} m";
export const aboutRoute = "The cheapest way of the chassis over the ground, without footfalls";
export const onTether = "On a tether";
export const aboutTether = "A rover that hangs on a tether walks down slopes that nothing else holds it on. The tether goes straight from its anchor to the drum on the chassis; no command drives the drum yet.";
export const hangs = "{} The rover hangs on a tether";
export const anchorX = "Anchor x {} m";
export const anchorHere = "Anchor at the footfall";
export const leavesAt = "Leaves the chassis at x {} m";
export const aboutLeaves = "Where the tether leaves the chassis, in the chassis' frame";
export const tetherLength = "Length {} m";
export const pull = "Most pull {} N";
export const part = "The walk's goal {} m along the route";
export const setPart = "Set this goal";
export const alongIt = "{} Walk along the route";
export const aboutAlongIt = "The walk goes along the route, else straight to its goal";
export const forget = "Forget the places";
export const allLeft = "All that is left";
export const fromHere = "Re-plan from here";
export const loopTitle = "By itself";
export const aboutLoop = "To the goal above, over ground that need not be known yet. Before each foot move it decides anew; what it sends passes the same checks as all commands. Forbidden places are heeded.";
export const movesAtOnce = "Foot moves at once {}";
export const aboutAtOnce = "How many foot moves the rover makes between two decisions";
export const lookAfter = "Look after {}";
export const aboutLook = "After how many foot moves the rover takes images; 0: only where it needs them";
export const torqueShare = "Most torque, share {}";
export const aboutTorque = "Share of a joint's torque limit";
export const anew = "Plan anew {}";
export const aboutAnew = "How often the rover plans anew with no foot move between, before it stops";
export const ahead = "Plan ahead [m] {}";
export const aboutAhead = "How far a walk is planned at once; half as far after each that was not found, or where that came in its time";
export const alongRoute = "Along a route {}";
export const aboutAlong = "The route is planned anew before each walk, around ground that is bad, unknown or too high; else it goes straight on";
export const goesBy = "Goes by {}";
export const aboutGoesBy = "How the rover goes each piece. A wave plans faster and moves slower; it is checked whole, and where a check fails the walk planner takes over";
export const byPlanner = "the walk planner";
export const byWave = "a wave where it holds";
export const byTable = "the learned table";
export const walkThere = "Walk there by itself";
export const holdIt = "Hold the walk";
export const goOnByItself = "Go on by itself";
export const cancelIt = "Cancel the walk";
export const decisions = "Latest decisions";
