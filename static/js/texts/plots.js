// Plots that the operator makes: their channels, the time that they show, what is read from them.

import { bare, fixed, seconds } from "../figures.js";

export const nameOf = (number) => `Plot ${number}`;

// -- acts ------------------------------------------------------------------------------------------

export const add = "Plots: add a plot";
export const undo = "Plots: undo";
export const nothingToUndo = "There is nothing to take back.";
export const undoes = (done) => `Undo: ${done}`;
export const showWhole = "Plots: show the whole recording";
export const showLast = (span) => `Plots: show the last ${span}`;
export const zoomIn = "Plots: zoom in";
export const zoomOut = "Plots: zoom out";
export const goBack = "Plots: show what was before";
export const goOn = "Plots: show what came after";

export const added = (name) => `${name} was added`;
export const removed = (name) => `${name} was removed`;
export const renamed = (name) => `a plot was called ${name}`;
export const chosenFor = (name) => `channels of ${name} were chosen`;

// -- keys ------------------------------------------------------------------------------------------

export const KEYS = [
  ["+ −", "In a plot: zoom in, zoom out"],
  ["← →", "In a plot: show what was before, what came after"],
  ["Shift+← →", "In a plot: move the moment that is read"],
  ["Home, End", "In a plot: the whole recording, the last ten minutes"],
  ["Delete", "In a plot: remove it"],
];

// -- time ------------------------------------------------------------------------------------------

export const SPANS = [[120, "2 min"], [600, "10 min"], [3600, "1 h"], [21600, "6 h"]];
export const last = (span) => `last ${span}`;
export const whole = "whole recording";
export const between = "as zoomed";
export const shows = (begin, end, length) => `${begin} to ${end} UTC, ${length}`;
export const length = (span) => (span < 120 ? seconds(span) : span < 7200 ? `${fixed(span / 60, 1)} min` : `${fixed(span / 3600, 1)} h`);
export const parts = (span) => `Least and greatest of each ${span < 60 ? seconds(span, 2) : length(span)}; zoom in for every frame.`;
export const reading = (left) => `Reading: ${bare(Math.ceil(left / 1e5) / 10)} MB of the recordings are left.`;
export const notRead = (why) => `The recordings can't be shown: ${why}`;
export const damaged = (names) => `Damaged, shown as far as they can be read: ${names}`;
export const clocksDiffer = (off) => `This computer's clock is ${seconds(Math.abs(off))} ${off > 0 ? "behind" : "ahead of"} the server's; times here are this computer's.`;
export const nothing = "Nothing was recorded in this session yet.";
export const noPlots = "There is no plot yet: add one, then choose its channels.";
export const noChannels = "No channel is chosen: open Channels and find some.";
export const nothingHere = "Nothing was recorded in this time.";
export const otherRobot = (count) => `${count} of its channels are of another robot.`;

// -- one plot --------------------------------------------------------------------------------------

export const about = (name) => `${name}: a plot over time; its channels with their numbers are listed below it`;
export const nameLabel = (name) => `Name of ${name}`;
export const remove = "Remove";
export const removeIt = (name) => `Remove ${name}`;
export const channels = (count) => `Channels (${count})`;
export const find = (name) => `Find a channel for ${name}`;
export const findHint = "torque leg 2 knee, tilt, °, N …";
export const listOf = (name) => `Channels for ${name}`;
export const readOf = (name) => `Numbers of ${name}`;
export const eventOf = (name) => `Event at the moment in ${name}`;
export const more = (count) => `${count} more; type more of the name.`;
export const none = "No channel has such a name.";
export const full = (most) => `A plot holds ${most} channels: add another plot.`;
export const channel = (quantity, name, unit) => `${quantity}: ${name} [${unit}]`;
export const number = (value, unit, digits) => `${fixed(value, digits)} ${unit}`;
export const limits = (low, high, unit) => (low === null ? `at most ${bare(high)} ${unit}` : high === null ? `at least ${bare(low)} ${unit}` : `${bare(low)} … ${bare(high)} ${unit}`);
export const at = (time) => `at ${time}`;
export const event = (sign, time, told) => `${sign} ${time} ${told}`;

// -- on the page from the beginning -----------------------------------------------------------------

export const title = "Plots";
export const addOne = "Add plot";
export const timeShown = "Time that is shown";
export const before = "What was before";
export const closer = "Zoom in";
export const farther = "Zoom out";
export const after = "What came after";
export const timeShownUtc = "Time that is shown, UTC";
