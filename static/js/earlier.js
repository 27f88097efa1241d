// What the rover said before this page was loaded, as the server kept it; asked for once for each plot and time span, and
// again where no answer came.

import { get } from "./api.js";
import { changed } from "./store.js";
import { heardFrom, scaleOf } from "./samples.js";

const MOMENTS = 300; // parts of a plot, which is about as many points wide
const RETRY = 5000; // ms

const answers = new Map(); // what was asked for → { times and numbers, why there are none, whether it is asked for, when it failed [ms] }

// Times and numbers of channels of one quantity, oldest first, as "since" of samples.js has them; span: of the plot [s].
export function earlier(channels, span) {
  const now = Date.now() / 1000;
  const until = now - heardFrom();
  const [{ quantity, nth }] = channels;
  const question = `quantity=${quantity}&first=${nth}&count=${channels.length}&since=${span}`;
  const answer = answers.get(question) ?? { found: [[], ...channels.map(() => [])], why: "", asking: false, failed: -Infinity };
  const isWanted = !answers.has(question) || (answer.why && !answer.asking && performance.now() - answer.failed >= RETRY);
  if (isWanted && until < span) {
    answers.set(question, answer);
    ask(answer, question, until, channels.map(({ unit }) => scaleOf(unit)));
  }
  return answer;
}

async function ask(answer, question, until, scales) {
  answer.asking = true;
  const asked = Date.now() / 1000;
  try {
    const { ages, numbers } = await get(`/sessions/current/telemetry/past?${question}&until=${until}&parts=${MOMENTS}`);
    const now = (asked + Date.now() / 1000) / 2; // the answer was made between
    const before = ages.filter((age) => now - age < heardFrom()).length;
    if (before) answer.found = [ages.slice(0, before).map((age) => now - age), ...numbers.map((column, j) => column.slice(0, before).map((one) => one * scales[j]))];
    answer.why = "";
  } catch (error) {
    Object.assign(answer, { why: error.message, failed: performance.now() });
  }
  answer.asking = false;
  changed();
}
