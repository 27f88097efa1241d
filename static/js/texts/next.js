// What comes next for an operator who walks the rover, and the verdict on what was made last.

import { place, seconds } from "../figures.js";
import { rowFirst } from "./shared.js";

export const waitForServer = "Wait for the server";
export const doNext = "Do what comes next";
export const sendNext = "Send or go on, as what comes next says";
export const holdButton = "Hold the button.";
export const changedMeanwhile = "What comes next has changed meanwhile: nothing was sent.";
export const nothingToSend = "There is nothing to send.";
export const named = (what) => `Next: ${what}`;

// -- one thing at a time, and what to know of it -------------------------------------------------------

export const stopped = "A stop is in force";
export const aboutStopped = "Clear it, left of STOP, once it is safe to go on.";
export const notClearedHere = (why) => `It can't be cleared here. ${why}`;
export const aboutSend = (left) => `Armed for ${left} s more. The run holds where the rover does not stand as predicted.`;
export const waitFor = (what) => `Wait for the ${what}`;
export const aboutWait = "Progress and Cancel are in the bar above.";
export const walkTo = "Walk to…";
export const aboutWalkTo = "A click on the ground is the goal, or type how far to go.";
export const click = "Click on the ground";
export const aboutClick = "Or type how far to go, under Goal. Escape leaves.";
export const byItself = (x, y, part, waits) => `By itself to ${place([x, y], 2)}${part ? `: ${part}` : ""}.${waits ? ` Waits for ${waits}.` : ""}`;
export const rowEnds = "row ends";
export const commandsEnd = "commands end";
export const heldPresent = (what) => `Held: the present ${what}`;
export const presentRowEnds = "The present row ends";
export const commands = "commands";
export const underWay = (what) => `Under way: ${what}`;
export const aboutUnderWay = "The run goes on while the rover stands as predicted. Hold and Abort are under Commands.";
export const aboutGoOn = "Sends the rows that are left.";
export const aboutArm = "Look at the ghost first; then there are ten seconds to send.";
export const footMovesToGoal = (count) => `${count} foot move${count === 1 ? "" : "s"} to the goal`;
export const aboutBuild = "The newest images are not in the ground yet.";
export const loadGround = "Load the ground as a file";
export const toFootfall = ({ leg: number, x, y }) => `Leg ${number} to ${place([x, y], 2)}.`;
export const noGround = "There is no ground yet.";
export const chooseAnother = "Choose another goal";
export const aboutGaited = "A gait is only looked at. To walk there, choose free under Gait.";
export const chooseFree = "Choose free under Gait";
export const to = ([x, y]) => `To ${place([x, y], 2)}.`;
export const lookAgain = "Look again: take images";
export const since = (what) => `Since the newest images, ${what}.`;
export const oldGround = "The ground was seen more than an hour ago.";

// -- verdicts --------------------------------------------------------------------------------------

export const outOfDate = (why) => `Out of date: ${why}`;
export const commandsTold = (count, duration, way) => `${count} commands, ${seconds(duration, 0)}, every rule holds. ${way}`;
export const atRow = (row, count) => `${rowFirst(row)} of ${count}`;
export const waitsBefore = (row, count, why) => `Waits before row ${row} of ${count}: ${why}`;
export const notAsPlanned = (run, why) => `Run ${run} did not end as planned: ${why}`;
export const runTold = (run, verdict) => `Run ${run} ${verdict}`;

// -- on the page from the beginning -----------------------------------------------------------------

export const title = "Next";
export const until = "Walk on until {}";
export const aboutUntil = "After each foot move the run checks where the rover stands, and holds where that is not as predicted";
export const theGoal = "the goal";
export const theNextMove = "the next foot move";
