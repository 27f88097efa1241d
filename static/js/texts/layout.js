// Layouts, and what the card of each work area says while it is closed.

import { age, percent, place, seconds } from "../figures.js";

export const planAStep = "plan a step";
export const layout = (name) => `Layout: ${name}`;
export const layoutAsDelivered = "Layout as delivered";
export const undoLayout = "Undo the latest change of the layout";
export const nothingChanged = "The layout has not been changed since the page was loaded.";
export const nextArea = "Next work area";
export const goTo = (title) => `Go to ${title}`;

// -- what can be done with one area ----------------------------------------------------------------

export const hide = (title) => `Hide ${title}`;
export const close = (title) => `Close ${title} to its heading`;
export const open = (title) => `Open ${title}`;
export const float = (title) => `Float ${title} over the scene`;
export const dock = (title) => `Dock ${title} below the scene`;
export const move = (title) => `Move ${title} by the arrow keys`;
export const moving = "Arrow keys move it, with Shift its size. Enter keeps it there, Escape puts it back.";

// -- how things are --------------------------------------------------------------------------------

export const ground = (known, since) => `${percent(known)} known, ${age(since)} old`;
export const noGround = "no terrain";
export const goal = (at) => `to ${place(at, 2)}`;
export const noGoal = "none";
export const walkFound = (moves) => `found: ${moves} foot moves`;
export const walkDone = (done, of, over) => (over ? `all ${of} foot moves done` : `${done} of ${of} foot moves done`);
export const noWalk = "none planned";
export const walkRefused = "no walk found";
export const loop = (held) => (held ? "held" : "under way");
export const noLoop = "not under way";
export const footfall = (leg, { x, y }) => `leg ${leg} to ${place([x, y], 2)}`;
export const noFootfall = "none chosen";
export const planFound = "found, every check holds";
export const noPlan = "none";
export const planRefused = "refused";
export const outOfDate = (text) => `▲ out of date: ${text}`;
export const ofAnotherFootfall = (text) => `▲ to another footfall: ${text}`;
export const ofAnotherPlan = (text) => `▲ of another plan: ${text}`;
export const carriedOut = (count) => `carried out, ${count} of ${count}`;
export const sag = (found) => (found ? "can be commanded" : "not to be sent");
export const noSag = "not predicted";
export const commands = (count, duration, holds) => `${holds ? "✓" : "✕"} ${count} commands, ${seconds(duration)}`;
export const noCommands = "none";
export const atRow = (row, of) => `▸ row ${row} of ${of}`;
export const images = (pairs) => `${pairs} pairs`;
export const noImages = "none";
export const telemetry = (since, stale) => `${stale ? "▲ STALE, " : ""}${age(since)} old`;
export const wasSo = (since, text) => `▲ ${age(since)} ago: ${text}`;
export const noTelemetry = "none yet";
export const noForces = "no forces are reported";
export const legs = (aloft) => (aloft.length ? `in the air: ${aloft.join(", ")}` : "all stand");

export const record = (count) => `${count} so far`;
