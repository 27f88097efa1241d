// Telemetry: plots, and the table of legs.

import { fixed, metres, percent } from "../figures.js";

export const chosenLeg = "chosen leg";
export const holdPlot = "Hold the telemetry plot";
export const plot = (title) => `Plot: ${title}`;
export const goOn = "Go on";
export const hold = "Hold";
export const held = "Held: what comes is kept for when you go on.";
export const shaded = "Shaded: before this page was loaded.";
export const noEarlier = (why) => `What was before this page was loaded is not shown: ${why}`;
export const hatched = "Stale: nothing heard where it is hatched.";
export const toLimit = (share) => `, ${percent(share)} to limit`;

/** @type {Object<string, {title: string, unit: string, ofLeg: boolean}>} */
export const QUANTITIES = {
  torque: { title: "Joint torques", unit: "N·m", ofLeg: true },
  position: { title: "Joint positions", unit: "°", ofLeg: true },
  error: { title: "Commanded − measured", unit: "°", ofLeg: true },
  force: { title: "Wheel forces, up", unit: "N", ofLeg: false },
  place: { title: "Chassis: place", unit: "m", ofLeg: false },
  lean: { title: "Chassis: roll, pitch, yaw", unit: "°", ofLeg: false },
};
export const PLACE = ["x east", "y north", "z up"];
export const LEAN = ["roll", "pitch", "yaw"];

// -- legs ------------------------------------------------------------------------------------------

export const stale = "Stale: this is how it was when the rover was last heard.";
export const inAir = "▽ in air";
export const stands = "▬ stands";
export const moves = ", moves";
export const torqueOf = (torque, limit) => `${fixed(torque, 0)} of ${fixed(limit, 0)} N·m`;
export const fromHip = (length) => `from the hip; the leg is ${metres(length, 2)} long`;
export const away = (distance, reached) => `${reached ? "✓" : "✕"} ${metres(distance, 2)}`;
