// What the rover said before this page was loaded, as the server kept it; asked for once for each plot and time span.

import { get } from "./api.js";
import { changed } from "./store.js";
import { heardFrom, scaleOf } from "./samples.js";
import { QUANTITIES } from "./texts/telemetry.js";

const MOMENTS = 300; // parts of a plot, which is about as many points wide

const answers = new Map(); // what was asked for → { times and numbers, why there are none }

// Times and numbers of channels of one quantity, oldest first, as "since" of samples.js has them; span: of the plot [s].
export function earlier(channels, span) {
  const now = Date.now() / 1000;
  const until = now - heardFrom();
  const [{ quantity, nth }] = channels;
  const question = `quantity=${quantity}&first=${nth}&count=${channels.length}&since=${span}`;
  if (!answers.has(question)) {
    if (!(until < span)) return { found: [[], ...channels.map(() => [])], why: "" };
    answers.set(question, { found: [[], ...channels.map(() => [])], why: "" });
    ask(question, until, scaleOf(QUANTITIES[quantity].unit));
  }
  return answers.get(question);
}

async function ask(question, until, scale) {
  const answer = answers.get(question);
  const asked = Date.now() / 1000;
  try {
    const { ages, numbers } = await get(`/sessions/current/telemetry/past?${question}&until=${until}&parts=${MOMENTS}`);
    const now = (asked + Date.now() / 1000) / 2; // the answer was made between
    const before = ages.filter((age) => now - age < heardFrom()).length;
    if (before) answer.found = [ages.slice(0, before).map((age) => now - age), ...numbers.map((column) => column.slice(0, before).map((one) => one * scale))];
  } catch (error) {
    answer.why = error.message;
  }
  changed();
}
