// What the rover does, as it is told while commands are sent. No part of the page is needed.

const BETWEEN = 2000; // ms

// Between two rows of a run the rover is idle for a moment: that is told only where it lasts. since: it was last seen moving [ms].
/** @type {(mode: string, gate: {state: string, waiting: boolean}, since: number) => string} */
export function steadyMode(mode, { state, waiting }, since) {
  const between = mode === "idle" && state === "sending" && !waiting && since < BETWEEN;
  return between ? "moving" : mode;
}
