// The ghost and its slider; the gauge of margins.

import { age, fixed, metres, percent, seconds } from "../figures.js";

export const nothingToPlay = "There is nothing to play yet: plan the step first.";
export const noRows = "What the ghost plays has no rows yet: make its commands.";
export const playOrPause = "Play or pause the ghost";
export const back = "Ghost back";
export const on = "Ghost on";
export const toPartBefore = "Ghost to the row, or the foot move, before";
export const toPartAfter = "Ghost to the row, or the foot move, after";
export const pause = "Pause the ghost";
export const play = "Play the ghost";
export const shareOf = (moment, what) => `${percent(moment)} of the ${what}`;
export const atRow = (share, name, row, count) => `${share}, ${name}, row ${row} of ${count}`;
export const ofWhole = (time) => `of ${seconds(time)}`;

// -- margins ---------------------------------------------------------------------------------------

export const OUTLINES = { plain: "polygon", conservative: "any leg lost", friction: "friction" };
export const ROWS = { now: "Now", ghost: "Ghost", worst: "Worst" };
export const marginOf = (row) => `${row}, margin`;
export const nextOutline = "Margin: to the next outline";
export const toWorst = "Ghost to the worst moment";
export const noMargin = "There is no plan whose margin is known.";
export const withFriction = (friction) => `${OUTLINES.friction} μ ${fixed(friction, 2)}`;
export const asked = (outline, least) => `asked for, to ${outline}: ${metres(least, 2)}`;
export const notKnownYet = "not known yet";
export const noTelemetry = "no telemetry";
export const notMeasured = "not measured: as planned from";
export const stale = (since) => `STALE, ${age(since)} old`;
export const notFromHere = "not from where the rover stands";
export const ofAnotherPlan = "of the commands, which are of another plan";
export const workedOut = "being worked out";
export const inRow = (row, what) => `row ${row}, ${what}`;
export const margin = (value) => metres(value, 2).replace("-", "−");
export const nothingHolds = "nothing holds";

// -- on the page from the beginning -----------------------------------------------------------------

export const marginTo = "Margin to {} {}";
export const whichOutline = "Outline that the margin is measured to";
export const marginStrip = "margin";
export const torqueStrip = "torque";
export const spareStrip = "spare";
export const ageStrip = "age of the ground";
export const title = "Ghost";
export const whatPlays = "What the ghost plays";
export const step = "step";
export const walk = "walk";
export const timeOf = "Time of the ghost [s]";
export const howFast = "How fast the ghost plays";
export const inSix = "in 6 s";
