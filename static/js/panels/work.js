// Work: what is being made, by how much it is done, and how the latest ended; in sight whichever work areas are.

import { act } from "../acts.js";
import { request } from "../api.js";
import { $, attempt, toast } from "../dom.js";
import { KINDS } from "../kinds.js";
import { reveal } from "../layout.js";
import { alive, known, silent, subscribe } from "../store.js";
import * as texts from "../texts/kinds.js";
import * as shared from "../texts/shared.js";

const LONG = 30; // s after which images that have not come are doubted
const GIVEN_UP = 600; // s
const PATIENCE = 3000; // ms for the answer of a plan that has ended
const OTHERS = { images: "ground", check: "sessions" }; // work that makes no product

let followed = null; // the job that was under way last, as long as how it ended is not told
let seen = 0; // when it was last seen under way, performance.now()
let asked = null; // {before, since}: images that were asked for, and the snapshot that there was
let told = null; // ids of the failed jobs that were told, or had failed before this page opened
let ended = ""; // what the latest work that ended was
let verdict = null; // {of, digest}: the plan, walk, gait, route or sequence that what is said of it judges; null where it judges none

export function start() {
  act({ key: "X", text: texts.cancelJob, button: "job-cancel", run: cancel, refusal: () => (runningJob() ? "" : texts.noJob) });
  act({ text: texts.goToEnded, button: "job-said", run: () => reveal(areaOf(ended)), refusal: () => (ended ? "" : texts.nothingEnded) });
  subscribe(draw);
}

// Images are on their way from the rover: no job, but as much to wait for. before: the snapshot when they were asked for.
export function awaitImages(before) {
  asked = { before, since: performance.now() };
  draw(known);
}

// What is being made of these kinds, or the images that are waited for, in a word; "" where nothing is.
export function waitedFor(kinds) {
  const job = underWay().findLast(({ kind }) => kinds.includes(kind));
  return job ? texts.titleOf(job.kind) : asked ? texts.images : "";
}

const areaOf = (kind) => KINDS[kind]?.area ?? OTHERS[kind] ?? "footfall";

const underWay = () => [...known.jobs.values()].filter(({ state }) => state === "queued" || state === "running");
const runningJob = () => underWay().at(-1);

const cancel = () => attempt(async () => {
  const job = runningJob();
  if (job) await request("DELETE", `/jobs/${job.id}`);
});

function draw({ summary }) {
  if (!summary) return;
  tellFailures();
  const job = runningJob();
  const passed = asked ? (performance.now() - asked.since) / 1000 : 0;
  if (asked && summary.snapshot !== asked.before) arrived("yes", texts.imagesCame);
  else if (asked && !summary.link.connected) arrived("no", texts.imagesLost);
  else if (passed > GIVEN_UP) arrived("no", texts.noImages);
  if (verdict && known[verdict.of]?.digest !== verdict.digest) ended = ""; // taken back, or another is there: it is judged there
  if (job) [followed, seen, ended] = [job.id, performance.now(), ""];
  else if (followed && tellEnd(known.jobs.get(followed))) followed = null;
  $("job").hidden = !job && !asked;
  $("job-said").hidden = Boolean(job || asked) || !ended;
  const past = alive() ? "" : texts.before(silent());
  if (job) show(texts.underWay(texts.namedFirst(job.kind), job.text || job.state, underWay().length > 1 ? texts.more(underWay().length - 1) : "", past), job.fraction, Boolean(past));
  else if (asked) show(texts.awaited(passed > LONG ? texts.imagesLate : texts.imagesAwaited, Math.floor(passed)), null, passed > LONG);
}

function arrived(className, text) {
  asked = null;
  if (!runningJob()) say("images", className, text);
}

// share: null where nobody knows how much is left.
function show(text, share, late = false) {
  if (share === null) $("job-progress").removeAttribute("value");
  else $("job-progress").value = share;
  $("job-text").className = late ? "doubt" : "";
  $("job-text").textContent = $("job-text").title = text;
  $("job-cancel").hidden = share === null;
}

// Whether it was told: what a plan came to is known with the plan.
function tellEnd(job) {
  if (!job) return true;
  const { kind, state } = job;
  const read = KINDS[kind]?.as ?? kind; // of the page's panels
  if (state === "failed") say(kind, "no", texts.failed(texts.namedFirst(kind), job.error?.message ?? shared.noReason));
  else if (state === "cancelled") say(kind, "", texts.cancelled(texts.namedFirst(kind)));
  else if (texts.FOUND[read] && known[read]?.digest === job.result) {
    const { status, reason } = known[read];
    if (status === "found") say(kind, "yes", texts.FOUND[read], { of: read, digest: job.result });
    else say(kind, "no", texts.notFound(texts.titleOf(read), reason), { of: read, digest: job.result });
  } else if (areaOf(kind) === "commands" && known.sequence?.digest === job.result) {
    if (known.sequence.valid) say(kind, "yes", texts.commandsReady, { of: "sequence", digest: job.result });
    else say(kind, "no", texts.commandsBroken, { of: "sequence", digest: job.result });
  } else if ((texts.FOUND[read] || areaOf(kind) === "commands") && performance.now() - seen < PATIENCE) return false;
  else say(kind, areaOf(kind) === "ground" ? "yes" : "", texts.ready(texts.namedFirst(kind))); // of others it is not known here what they found
  return true;
}

function say(kind, className, text, judged = null) {
  [ended, verdict] = [kind, judged];
  Object.assign($("job-said-text"), { className, textContent: text, title: text });
}

// A failed job is told once; cancelled ones were the operator's wish.
function tellFailures() {
  const failed = [...known.jobs.values()].filter((job) => job.state === "failed");
  told ??= new Set(failed.map((job) => job.id));
  for (const job of failed) {
    if (told.has(job.id)) continue;
    told.add(job.id);
    toast(texts.failed(texts.namedFirst(job.kind), job.error?.message ?? shared.noReason));
  }
}
