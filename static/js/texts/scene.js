// The scene: whether it is there, what it shows, from where it is looked at, how old its ground is.

import { age, metres, percent, signed } from "../figures.js";

export const goesOn = "Commands, telemetry and stop go on without it.";
export const silence = (seconds) => `The server has been silent for ${age(seconds)}: commands, telemetry and the scene are as they were then, and a stop is not confirmed.`;
export const loading = "The scene is loading.";
export const loadAgain = "Load the scene again";
export const openedOff = "The page was opened with ?scene=off.";
export const off = "The scene is off (?scene=off).";
export const notShown = (why) => `The scene can't be shown: ${why}.`;
export const noScene = "the server has none";
export const noAnswer = "it does not answer";
export const noGraphics = "The scene has lost its graphics.";
export const gone = (time) => `The scene does not answer any more: its picture is of ${time} UTC, or a little later.`;

// -- what it shows ---------------------------------------------------------------------------------

export const SWITCHES = {
  torques: "joint torques", forces: "wheel forces", support: "support and margin", region: "region with friction", age: "age of the ground", contours: "contour lines", tracks: "wheel tracks", suggestions: "suggested footfalls",
  predicted: "predicted rover in a run", cameras: "camera views", swept: "swept volume", tape: "measuring tape",
};
export const LOOKS = { top: "From above", leg: "Along the leg", wheel: "At its wheel", follow: "Follow chassis" };
export const look = (how) => `Look: ${how}`;
export const onOrOff = (what) => `Scene: ${what} on or off`;
export const whatItShows = "What the scene shows";
export const opacity = (hundredths) => `${hundredths} %`;
export const clickMissed = "The click met no known ground: click where the ground has colours.";
export const otherEnd = "Click on the other end.";
export const twoPoints = "Click on two points of the ground.";
export const measured = (length, level, height) => `${metres(length)}, level ${metres(level)}, height ${signed(height)} m`;

// -- how old its ground is -------------------------------------------------------------------------

export const noAges = "There is no terrain whose age could be shown.";
export const ageUnknown = "? age unknown: this terrain does not say when it was measured";
export const newest = (until) => `no hatching: measured within ${age(until)} of the newest`;
export const between = (after, until) => `${age(after)} to ${age(until)} before`;
export const olderThan = (after) => `more than ${age(after)} before`;
export const band = (words, share) => `${words} (${some(share)})`;
export const someUnknown = (share) => `? age unknown, not hatched (${some(share)})`;
const some = (share) => (share > 0 && share < 0.01 ? "<1 %" : percent(share));

// -- on the page from the beginning -----------------------------------------------------------------

export const title = "Scene";
export const inThree = "Rover and ground in three dimensions";
export const whichLeg = "Leg (its number is its key)";
export const groundShows = "Ground shows";
export const striped = "Striped: the ground has changed since, and the colours there may be wrong.";
export const outdated = "The colours are OUT OF DATE and hidden: show again where the leg can stand.";
export const legend = "Legend";
export const ages = "Age of the ground";
export const view = "View {}";
export const lookFrom = "Look from";
export const shows = "Scene shows";
export const coloursOver = "Colours over images {} {}";
export const wholly = "100 %";
