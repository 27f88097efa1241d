// The plan that the operator asked for last: what is made of a plan is made of that one, also while it is being made.

import { get } from "./api.js";
import { attempt } from "./dom.js";
import { known } from "./store.js";
import { refresh } from "./stream.js";
import * as texts from "./texts/page.js";

const LOOK_AGAIN = 100; // ms
let asked = null; // the job of the plan asked for last, undefined where that was refused; null once its answer was used
let id = "";

const isOpen = (job) => job?.state === "queued" || job?.state === "running";

// ask: asks the server for it, and returns its job.
export function askForPlan(ask) {
  id = "";
  const mine = attempt(ask);
  asked = mine;
  mine.then((job) => { if (asked === mine) id = job?.id ?? ""; });
}

// Whether its answer is not there yet.
export const awaited = () => asked !== null && (!id || isOpen(known.jobs.get(id)));

// The job once it has ended, as it should: throws where it was refused or cancelled.
export async function jobEnded(job) {
  while (isOpen(job)) {
    await new Promise((done) => setTimeout(done, LOOK_AGAIN));
    job = await get(`/jobs/${job.id}`);
  }
  if (job.state !== "done") throw new Error(job.error?.message ?? job.text);
  return job;
}

// The page knows the answer to it. Throws where there will be none: nothing is made of the plan before it.
export async function answered() {
  const mine = asked;
  if (!mine) return;
  try {
    let job = await mine;
    if (job) job = await get(`/jobs/${job.id}`);
    while (isOpen(job)) {
      await new Promise((done) => setTimeout(done, LOOK_AGAIN));
      job = await get(`/jobs/${job.id}`);
    }
    if (job?.state !== "done") throw new Error(texts.planNotMade);
    await refresh();
  } finally {
    if (asked === mine) asked = null;
  }
}
