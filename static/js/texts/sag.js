// Sag: what is commanded of a rover that gives way, what is predicted of it, and what came of it.

import { degrees, fixed, metres, percent, seconds } from "../figures.js";

export const predict = "Predict the sag of the planned step";
export const compensate = "Compensate for sag";
export const noPrediction = "There is no prediction that can be commanded: predict the sag of the present plan first.";
export const cancelPrediction = "Cancel the prediction of sag";
export const noPredictionRuns = "No prediction is running.";
export const takeOver = "Take over the measured stiffness of the joints";
export const nothingToTakeOver = "No measured stiffness waits to be taken over.";
export const ofAnotherPlan = "Out of date: this is for another plan than the present one.";
export const outOfDate = (why) => `Out of date: ${why}.`;
export const canBeCommanded = (mode) => `Can be commanded, ${mode}. Every check holds.`;
export const notToBeSent = (mode, reason) => `Not to be sent, ${mode}: ${reason}`;

// -- whether the wheel leaves the ground, the first thing to know of a rover that sags ----------------

const softer = (tolerance) => `with springs ${percent(tolerance)} softer`;
export const stays = (lift, missing) => `The wheel will not leave the ground: lifted by ${metres(lift)}, it is still ${metres(missing)} too low.`;
export const fallsIfSofter = (tolerance) => `The wheel leaves the ground, but ${softer(tolerance)} the rover would not stand.`;
export const staysIfSofter = (tolerance) => `The wheel leaves the ground, but ${softer(tolerance)} it would not.`;
export const leaves = "The wheel leaves the ground.";

// -- figures ---------------------------------------------------------------------------------------

export const lowest = "Lowest in the swing";
export const lowestTold = ({ clearance, clearance_uncertainty: less }, tolerance) => (clearance > 0 ? `${metres(clearance)} above the ground, ` : `${metres(-clearance)} too low, `)
  + (less === null ? `not known ${softer(tolerance)}` : `${metres(Math.abs(less))} ${less < 0 ? "more" : "less"} ${softer(tolerance)}`);
export const commandedLift = "Commanded lift";
export const liftTold = (lift, wanted) => `${metres(lift)}${wanted !== null && lift > wanted ? `, raised from ${metres(wanted)}` : ""}`;
export const touchDown = "Touch-down";
export const touchDownTold = (offset) => (offset === null ? "none: the wheel never touches the ground" : `${metres(offset)} from the planned contact`);
export const frictionUsed = "Friction used";
export const frictionTold = (share) => `${percent(share, 1)} at most`;
export const chassis = "Chassis";
export const chassisTold = (sag, tilt) => `sags ${metres(sag)}, tilts ${degrees(tilt, 2)} at most`;
export const takes = "It takes";
export const takesTold = (time) => seconds(time);
export const assumptionsTold = ({ balance: { friction, gravity, payload_mass: payload }, joint_scale: joints, wheel_scale: wheels }) =>
  `μ ${friction}, ${gravity} m/s², ${payload === null ? "payload as described" : `payload ${payload} kg`}, joints ${fixed(joints, 2)} × and wheels ${fixed(wheels, 2)} × as stiff`;
export const moves = (leg) => `${leg} moves`;

// -- measured --------------------------------------------------------------------------------------

export const measured = (ratio, pauses) => `Measured sag is ${fixed(ratio, 2)} times the predicted, at ${pauses} pauses of the latest run.`;
export const stiffnessAsMeasured = (scale) => `Joints are taken to be ${fixed(scale, 2)} × as stiff as described, as measured.`;
export const stiffnessDiffers = ({ was, now, steps, ratio }) =>
  `Joint stiffness: ${fixed(was, 2)} × is taken, ${fixed(now, 2)} × was measured, by ${steps} step${steps === 1 ? "" : "s"} of mean ratio ${fixed(ratio, 2)}.`;

// -- the wheel in the air ---------------------------------------------------------------------------

export const noTelemetry = "No telemetry yet.";
export const stale = "Telemetry is STALE.";
export const noneAloft = "No wheel is in the air.";
export const asRigid = " (as rigid)";
export const ifSofter = (less) => ` (${fixed(Math.abs(less))} ${less < 0 ? "more" : "less"} if softer)`;
export const clearance = (value, uncertainty, more) => `${fixed(value)} ± ${fixed(uncertainty)}${more ? " or more" : ""}`;
export const pose = "the chassis' pose";
export const map = "the map";
export const groundUnknown = (leg) => `The ground under the wheel of leg ${leg} is not known.`;
export const tooLow = (leg) => `Leg ${leg} is lower than predicted, by more than the uncertainty.`;
export const groundPartlyUnknown = (leg) => `Part of the ground under the wheel of leg ${leg} is not known: it may be higher there.`;
export const leftOut = (what) => `Not in the ±, as nothing tells it: ${what.join(" and ")}.`;

// -- a run beside its prediction -------------------------------------------------------------------

const QUANTITIES = { "touch-down": "Touch-down off", load: "Load", drift: "Chassis drift", sink: "Chassis sink" };
export const quantity = (name, leg, unit) => `${QUANTITIES[name] ?? name}${leg < 0 ? "" : `, leg ${leg}`} [${unit}]`;
export const comparing = "carried out; comparing with the prediction";
export const notCompared = "carried out, not compared";
export const differs = "carried out, not as predicted";
export const asCommanded = "carried out as commanded";
export const asPredicted = "carried out as predicted";
export const leastClearances = (looks, every, missed) => `Least clearance of each wheel while it swung [m]; telemetry was looked at ${looks} time${looks === 1 ? "" : "s"}, `
  + `at most every ${seconds(every)}${missed ? `, and ${missed} time${missed === 1 ? "" : "s"} missed` : ""}`;
export const runTold = (number, reason) => `Run ${number}: ${reason}.`;
export const difference = (text) => `${text}.`;
export const advice = (text) => `Do: ${text}.`;

// -- on the page from the beginning -----------------------------------------------------------------

export const whatCame = "What came of the latest run";
export const against = "Measured beside predicted; ± holds in 95 of 100 cases";
export const offBy = "Off by";
export const measuredWithin = "Measured, ± 95 %";
export const title = "Sag";
export const heading = "{} Sag";
export const mode = "Mode {}";
export const predictIt = "Predict sag";
export const mustKeep = "What the prediction must keep";
export const clearanceOf = "Clearance [m] {}";
export const aboutClearance = "How far the wheel stays above the ground while it swings";
export const largestOffset = "Largest offset [m] {}";
export const leastLoad = "Least load [N] {}";
export const highestLift = "Highest lift [m] {}";
export const aboutLift = "How far the mode as commanded may raise the lift";
export const speed = "Speed, share {}";
export const aboutSpeed = "Share of the joints' speed limits";
export const jointStiffness = "Joint stiffness × {}";
export const aboutJoints = "Joint stiffness, times that of the rover's description";
export const wheelStiffness = "Wheel stiffness × {}";
export const aboutWheels = "Wheel stiffness, times that of the rover's description";
export const progress = "Progress of the execution";
export const loads = "Load on each wheel [N]";
export const least = "Least";
export const most = "Most";
export const checks = "Checks of the prediction";
export const take = "Take over";
export const clearanceNow = "Clearance of the wheel in the air, now [m]";
export const aboutMeasured = "The true clearance is within it, either way, in 95 of 100 cases";
