// Telemetry: plots, and the table of legs.

import { fixed, metres, percent } from "../figures.js";

export const chosenLeg = "chosen leg";
export const holdPlot = "Hold the telemetry plot";
export const plot = (title) => `Plot: ${title}`;
export const goOn = "Go on";
export const held = "Held: what comes is kept for when you go on.";
export const numbersOf = (time) => `Numbers of ${time}, the moment that was pointed at.`;
export const shaded = "Shaded: before this page was loaded.";
export const noEarlier = (why) => `What was before this page was loaded is not shown: ${why}`;
export const hatched = "Stale: nothing heard where it is hatched.";
export const toLimit = (share) => `, ${percent(share)} to limit`;

// sliding: its unit for a joint that slides.
// onlyRecorded: two frames tell it together, so it is known of recordings and not of the last ten minutes in memory.
/** @type {Object<string, {title: string, unit: string, sliding?: string, ofLeg: boolean, onlyRecorded?: boolean}>} */
export const QUANTITIES = {
  torque: { title: "Joint torques", unit: "N·m", sliding: "N", ofLeg: true },
  position: { title: "Joint positions", unit: "°", sliding: "m", ofLeg: true },
  error: { title: "Commanded − measured", unit: "°", sliding: "m", ofLeg: true },
  force: { title: "Wheel forces, up", unit: "N", ofLeg: false },
  share: { title: "Shares of the weight", unit: "%", ofLeg: false },
  place: { title: "Chassis: place", unit: "m", ofLeg: false },
  lean: { title: "Chassis: roll, pitch, yaw", unit: "°", ofLeg: false },
  tilt: { title: "Chassis: tilt", unit: "°", ofLeg: false },
  interval: { title: "Time between frames", unit: "s", ofLeg: false, onlyRecorded: true },
};
// scale: of the server's numbers, in SI units. digits: behind the point, as they are read.
/** @type {Object<string, {scale: number, digits: number}>} */
export const UNITS = {
  m: { scale: 1, digits: 3 }, s: { scale: 1, digits: 2 }, N: { scale: 1, digits: 0 }, "N·m": { scale: 1, digits: 1 },
  "°": { scale: 180 / Math.PI, digits: 2 }, "%": { scale: 100, digits: 1 },
};
export const PLACE = ["x east", "y north", "z up"];
export const LEAN = ["roll", "pitch", "yaw"];
export const TILT = "from the vertical";
export const INTERVAL = "as they came";

// -- legs ------------------------------------------------------------------------------------------

export const stale = "Stale: this is how it was when the rover was last heard.";
export const inAir = "▽ in air";
export const stands = "▬ stands";
export const noForces = "? no forces";
export const moves = ", moves";
export const torqueOf = (torque, limit, slides) => `${fixed(torque, 0)} of ${limit === null ? "an unknown limit" : fixed(limit, 0)} ${slides ? "N" : "N·m"}`;
export const fromHip = (length) => `from the hip; the leg is ${metres(length, 2)} long`;
export const away = (distance, reached) => `${reached ? "✓" : "✕"} ${metres(distance, 2)}`;

// -- on the page from the beginning -----------------------------------------------------------------

export const legs = "Legs";
export const force = "Force [N]";
export const aboutForce = "Force on the wheel, and its share of all";
export const worstTorque = "Worst torque";
export const toFootfall = "To footfall";
export const aboutToFootfall = "Distance of the footfall from the hip";
export const title = "Telemetry";
export const shows = "Shows";
export const of = "Of";
export const span = "Time span";
export const last30s = "last 30 s";
export const last2min = "last 2 min";
export const last10min = "last 10 min";
export const about = "Plot of the chosen channels over time; the list below has the newest numbers, or those of the moment that was pointed at";
export const series = "Channels, and their values";
