// The page that plays a session alone.

import { fixed, metres, percent, seconds } from "../figures.js";

export const aboutSession = (robot, events, software) => `Recorded session of the rover ${robot}, ${events} events. Written by FootFall ${software}; nothing can be sent from here.`;
export const noStop = "NO STOP WAS SENT: this page plays a recording and reaches no rover. Stop it on the operator's page, or use another way.";
export const eventAt = (time, told) => `${time} ${told}`;
export const chosenEvent = (time, told) => `${time} UTC, ${told}`;

// -- plans -----------------------------------------------------------------------------------------

const inWords = (status) => (status === "goal_invalid" ? "the leg cannot stand there" : status.replaceAll("_", " "));
export const planOf = (event, leg, status) => `event ${event}: leg ${leg}, ${inWords(status)}`;
export const planFound = ({ length, duration, clearance, margin }) => `Found. The wheel travels ${metres(length, 2)} in ${seconds(duration)}; least clearance ${metres(clearance)}, least margin of balance ${metres(margin)}.`;
export const planRefused = (status, reason) => `No plan (${inWords(status)}): ${reason}`;
export const marginOf = (margin, unit) => `${fixed(margin)} ${unit}`;
export const fromAbove = (title) => `From above: east to the right, north up. ${title ? `Ground: ${title}.` : "No map of this leg was made."} White: the wheel's way; cross: the chosen footfall.`;
export const noStepPlanned = "No step was planned. Walks and moves of the chassis are told on the timeline alone.";
export const playIt = "▶ Play";
export const pauseIt = "❚❚ Pause";
export const shareOf = (share) => percent(share);

// -- commands --------------------------------------------------------------------------------------

export const commandsTold = (count, duration, valid, sent) => `${count} commands, ${seconds(duration)}; ${valid ? "every rule holds" : "a rule is broken"}. ${sent ? "State: how far the latest run came." : "None was sent."}`;
export const noCommands = "No commands were made.";
export const stateOf = (state, reason) => (reason ? `${state}: ${reason}` : state);
