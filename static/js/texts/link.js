// The status bar and the stop: server, rover link, mode, whether the plan matches the rover, stop requests.

import { age, signed } from "../figures.js";

// -- server and link -------------------------------------------------------------------------------

export const lineBroke = "The line to the server broke.";
export const connected = "connected";
export const silentFor = (seconds) => `silent for ${age(seconds)}`;
export const notWritten = (count) => `connected, ${count} events NOT WRITTEN`;
export const onTheWay = (seconds) => ` + ${age(seconds)} on the way`;
export const telemetryOnly = (old, light) => `telemetry only, can't be commanded, ${age(old)} old${light}`;
export const noRoverYet = "no rover";
export const lost = (old) => `LOST, last heard ${age(old)} ago`;
export const noTelemetryYet = "no telemetry yet";
export const stale = "STALE ";
export const heard = (mark, old, light, counts) => `${mark}${age(old)} old${light}${counts}`;
export const counted = (count, what) => `, ${count} ${count === 1 ? what.replace(/s$/, "") : what}`;
export const was = (mode) => `was ${mode}`;
export const lightTime = (telemetry, commands) => `Light time: telemetry ${telemetry} s, commands ${commands} s.`;
export const kindOfFaults = (kind, count) => `${kind}: ${count}`;
export const faults = (count, kinds, latest) => `${count} faults (${kinds}), the latest: ${latest}`;

// -- a message that is on its way ------------------------------------------------------------------

export const arrivesIn = (seconds) => `reaches the rover in ${age(seconds)}, `;
export const shouldBeThere = "should be there, ";
export const answerIn = (seconds) => `acknowledgement in ${age(seconds)} at the earliest`;

// -- plan and rover --------------------------------------------------------------------------------

export const notKnownFor = (seconds) => `not known for ${age(seconds)}`;
export const onOlderGround = "planned on older ground";
export const nearEnough = "near enough to start";
export const startsHere = "plan starts where the rover is";
export const jointOfLeg = (leg, joint) => `leg ${leg} ${joint}`;
export const jointOff = (joint, degrees) => `${joint} off ${signed(degrees, 1)}°`;
export const slideOff = (joint, difference) => `${joint} off ${signed(difference)} m`;
export const ofRows = (count) => ` of ${count}`;
export const waitingBefore = "waiting before";
export const executing = "executing";
export const atRow = (doing, row, of, way) => `${doing} row ${row}${of}${way}`;

// -- stop ------------------------------------------------------------------------------------------

export const clearStop = "Clear the stop";
export const noStop = "No stop is in force.";
export const notConfirmed = (why) => `The stop request is not confirmed: ${why} Use another way to stop the rover.`;
export const stopSending = "Stop request is being sent…";
export const stopFailed = "STOP NOT CONFIRMED: no answer, still asking. Use another way to stop the rover.";
export const nothingToStop = "NO STOP WAS SENT: no session was open, and no rover linked. Use another way.";
export const standsStopped = "The rover is STOPPED; clear the stop to move it.";
export const noSafetyStop = "Stop request. Not a safety-rated stop.";
export const acknowledgedBefore = ", acknowledged by the rover";
export const notAcknowledgedBefore = ", NOT YET ACKNOWLEDGED";
export const stopBefore = (seconds, acknowledged) => `Stop in force ${age(seconds)} ago${acknowledged}; the server has been silent since.`;
export const stopAcknowledged = "STOPPED, acknowledged by the rover.";
export const stopOnItsWay = (way) => `Stop sent: ${way}. NOT YET ACKNOWLEDGED.`;
export const stopNotAcknowledged = "Stop sent, NOT YET ACKNOWLEDGED by the rover.";
export const stopWithoutRover = "Stop in force, but NO ROVER IS CONNECTED: it is told when it connects.";

// -- on the page from the beginning -----------------------------------------------------------------

export const status = "Status";
export const session = "Session";
export const roverLink = "Rover link";
export const noLink = "no link";
export const mode = "Mode";
export const ground = "Ground";
export const planAndRover = "Plan and rover";
export const whatIf = "What if";
export const notAsItStands = "not how the rover stands";
export const conn = "Conn";
export const user = "User";
export const server = "Server";
export const connecting = "connecting";
export const clearIt = "Clear stop";
export const stop = "STOP";
export const aboutStop = "Sends a stop request at once (Escape twice, or Ctrl+.)";
