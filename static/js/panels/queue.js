// The queue: what was planned one after another is listed, taken from its end, and becomes one command list.

import { act } from "../acts.js";
import { get, once, post, put } from "../api.js";
import { $, attempt, element, fixed } from "../dom.js";
import { answered, jobEnded } from "../planning.js";
import { known, subscribe } from "../store.js";
import { refresh } from "../stream.js";
import * as texts from "../texts/queue.js";
import { wayOfMove } from "./commands.js";

let drawn = "";

export function start() {
  const refusal = () => (queue() ? "" : texts.noQueue);
  act({ text: texts.queueStep, button: "queue-add", run: () => attempt(addStep), refusal: () => (known.summary?.plan.status === "found" ? "" : texts.noPlanToQueue) });
  act({ text: texts.makeOfQueue, button: "queue-make", run: make, refusal: () => (queue()?.carried_out ? texts.carriedOut : refusal()) });
  act({ text: texts.fromQueuesEnd, button: "queue-on", run: goOn, refusal });
  act({ text: texts.emptyQueue, button: "queue-empty", run: () => shorten(null), refusal });
  subscribe(draw);
}

const queue = () => known.summary?.queue ?? null;

// From where moves of the chassis are planned: the digest of the queue whose end that is, undefined for the rover.
export const plannedAfter = () => (queue()?.goes_on ? queue().digest : undefined);

async function addStep() {
  await answered();
  await add(known.summary.plan.digest);
}

// A planned step or move joins the queue; the next is planned from its end.
export async function add(plan) {
  const job = await jobEnded(await post("/sessions/current/queues", { plan }));
  const answer = await get(`/sessions/current/queues/${job.result}`);
  if (answer.status !== "found") throw new Error(texts.refused(answer.reason));
  await put("/sessions/current/what-if/after", { after: answer.digest });
  await refresh();
}

const make = () => attempt(async () => {
  await post("/sessions/current/sequences", { plan: queue().digest, ...wayOfMove() }, once());
  await refresh();
});

const goOn = () => attempt(async () => {
  await put("/sessions/current/what-if/after", { after: queue().digest });
  await refresh();
});

const shorten = (to) => attempt(async () => {
  await put("/sessions/current/queues/current", { to });
  await refresh();
});

function draw({ summary }) {
  if (!summary) return;
  const now = summary.queue;
  const key = JSON.stringify(now);
  if (key === drawn) return;
  drawn = key;
  $("queue-box").hidden = !now;
  $("queue").tBodies[0].replaceChildren(...(now?.entries ?? []).map(entryRow));
  if (!now) return;
  const count = now.entries.length;
  $("queue-total").textContent = `${texts.total(now.entries)}. ${texts.leastMargin(now.entries)}`;
  $("queue-state").textContent = now.carried_out ? texts.carriedOut : now.goes_on ? texts.planningFromEnd(count) : texts.notFromEnd(count);
  $("queue-on").hidden = now.goes_on || now.carried_out;
}

function entryRow({ number, leg, duration, margin, before }, at, entries) {
  const remove = element("button", { type: "button", textContent: "✕", ariaLabel: texts.remove(number), onclick: () => shorten(before) });
  return element("tr", {},
    element("td", { textContent: String(number) }),
    element("td", { textContent: texts.what(leg) }),
    element("td", { textContent: texts.legOf(leg) }),
    element("td", { textContent: fixed(duration, 1) }),
    element("td", { textContent: margin === null ? "–" : fixed(margin, 3) }),
    element("td", {}, ...(at === entries.length - 1 ? [remove] : [])));
}
