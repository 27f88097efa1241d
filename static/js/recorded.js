// What the rover said in the whole session, as the server reads it from the recordings. An answer tells what is read so far;
// while more is to be read it is asked for again.

import { get } from "./api.js";
import { scaleOf } from "./samples.js";
import { changed } from "./store.js";

const PARTS = 400; // of a plot, each with a least and a greatest number
const KEPT = 24; // answers
const LATER = 2000; // ms: of what goes on at the moment more is asked for after this long
const MUCH_LATER = 30000; // ms: the same where nothing seems to go on
const RETRY = 5000; // ms
const CLOCKS_DIFFER = 0.5; // s

/** @typedef {{found: any[][], silences: number[][], begin: number?, end: number?, unread: number, damaged: string[], off: number, why: string, asking: boolean, at: number}} Answer */

/** @type {Map<string, Answer>} */
const answers = new Map();
let latestOff = 0; // s by which the server's clock is ahead of this computer's
let latest = { begin: null, end: null };

// From when to when anything was recorded, as far as it is known; by this page's clock, null where nothing was.
export const recordedSpan = () => latest;

// How long one of the parts is into which a plot is cut [s].
export const partOf = (begin, end) => (end - begin) / PARTS;

/**
 * Channels between two times; null: from the first or to the last frame. Times and numbers are as "since" of samples.js
 * has them, by this page's clock. What is not answered yet is empty, or what was answered before.
 * @param {any[]} channels
 * @param {number?} begin
 * @param {number?} end
 * @param {boolean} goesOn whether more is recorded there at the moment
 */
export function recorded(channels, begin, end, goesOn) {
  const key = JSON.stringify([channels.map(({ id }) => id), begin, end]);
  let answer = answers.get(key);
  if (!answer) {
    answer = { found: [[], ...channels.map(() => [])], silences: [], begin: null, end: null, unread: 0, damaged: [], off: 0, why: "", asking: false, at: -Infinity };
    answers.set(key, answer);
    if (answers.size > KEPT) answers.delete(answers.keys().next().value);
  }
  const wait = answer.why ? RETRY : answer.unread ? 0 : goesOn ? LATER : MUCH_LATER;
  if (!answer.asking && performance.now() - answer.at >= wait) ask(answer, channels, begin, end);
  return answer;
}

async function ask(answer, channels, begin, end) {
  answer.asking = true;
  const from = Date.now() / 1000;
  const limits = Object.entries({ begin: begin === null ? null : begin + latestOff, end: end === null ? null : end + latestOff }).filter(([, at]) => at !== null);
  const question = [...channels.map(({ id }) => ["channel", id]), ...limits, ["parts", PARTS]].map(([name, value]) => `${name}=${value}`).join("&");
  try {
    const told = await get(`/sessions/current/telemetry/recorded?${question}`);
    const until = Date.now() / 1000;
    latestOff = told.now - (from + until) / 2; // it was made between
    if (Math.abs(latestOff) < Math.max(CLOCKS_DIFFER, until - from)) latestOff = 0; // as far as can be told they agree
    const own = (time) => (time === null ? null : time - latestOff);
    const scaled = told.numbers.map((column, j) => column.map((one) => (one === null ? null : one * scaleOf(channels[j].unit))));
    Object.assign(answer, {
      found: [told.times.map(own), ...scaled], silences: told.silences.map((pair) => pair.map(own)), begin: own(told.begin), end: own(told.end),
      unread: told.unread, damaged: told.damaged, off: latestOff, why: "",
    });
    latest = { begin: answer.begin, end: answer.end };
  } catch (error) {
    answer.why = error.message;
  }
  answer.at = performance.now();
  answer.asking = false;
  changed();
}

