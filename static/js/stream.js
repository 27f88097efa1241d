// Follows the session: one line of events, and a fresh summary after everything that changed it.

import { loadAnew } from "./anew.js";
import { PAGE, ROOT, request } from "./api.js";
import { toast } from "./dom.js";
import { asPanelsRead } from "./legged.js";
import { isAthletes, orders, plannedBy } from "./robot.js";
import { changed, hearClock, known } from "./store.js";
import { buildOrLoad } from "./texts/ground.js";
import * as texts from "./texts/page.js";
import { clickMissed } from "./texts/scene.js";
import { readable } from "./words.js";

const LOOK_PERIOD = 2000; // ms: what no event tells (the rover moved, the server hangs) shows after this long
const PATIENCE = 5000; // ms
const RETRY = 1000; // ms
const NO_ROOM = 1013; // close code: as many listen as may
const OVER = ["done", "failed", "cancelled"];

let fetching = null; // the promise of the summary that is on its way
let again = false;
let newer = {}; // what was told since the summary that is on its way was asked for

// Messages come in bursts; one summary at a time, and one more if something came meanwhile. Whoever waits for this
// has a summary that was asked for after the call.
export function refresh() {
  again = true;
  fetching ??= fetchAll().finally(() => {
    fetching = null;
    if (again) look(); // asked for between the last look and here
  });
  return fetching;
}

async function fetchAll() {
  while (again) {
    again = false;
    newer = {};
    const { body: summary, response } = await request("GET", "/sessions/current", undefined, {}, PATIENCE);
    hearClock(response.headers.get("Date"));
    if (known.summary && summary.id !== known.summary.id) {
      loadAnew(); // another session: every panel starts anew
      return;
    }
    known.heardAt = performance.now();
    await refreshProducts(summary);
    known.summary = Object.assign(summary, newer, { heardAt: known.heardAt });
    takeJobs(summary.jobs);
  }
  changed();
}

// A part of the summary came by itself: it counts more than a summary that was asked for before.
export function tell(part) {
  if (!known.summary) return;
  known.summary = { ...known.summary, ...part };
  known.heardAt = performance.now();
  if (fetching) {
    newer = { ...newer, ...part };
    again = true;
  }
  changed();
}

// The line says what does not arrive; asking again there would only repeat it.
const look = () => refresh().catch(() => changed());

// One that can't be read is said, and keeps no other from being read; the next look asks for it again.
async function refreshProducts(summary) {
  if (!isAthletes()) nameAsPanelsDo(summary);
  const read = { plan: summary.plan.digest, walk: summary.walk, gait: summary.gait, route: summary.route, sequence: summary.sequence };
  for (const [name, digest] of Object.entries(read)) {
    if (!digest) known[name] = null;
    else if (known[name]?.digest !== digest || isToldOtherwise(name, summary)) await readProduct(name, digest, summary).catch((error) => toast(error.message));
  }
  if (!isAthletes()) sayWhatFor(summary);
}

// What is said of commands goes by how the rover is known to sag, and that changes with what is heard of it.
const isToldOtherwise = (name, summary) => name === "sequence" && known.sequence.sags !== sagsBy(summary);
const sagsBy = ({ way_of_commands: way }) => JSON.stringify(way);

async function readProduct(name, digest, summary) {
  const { body, response } = await request("GET", name === "sequence" ? `/sequences/${digest}` : `${FOLDERS[name]()}/${digest}`);
  if (name === "sequence") known[name] = { ...body, etag: response.headers.get("ETag"), sags: sagsBy(summary) };
  else known[name] = isAthletes() || name === "route" ? body : asPanelsRead(body);
}

const FOLDERS = { plan: () => orders("step"), walk: () => orders("walk"), gait: () => "/sessions/current/gaits", route: () => "/sessions/current/routes" };

// Panels read one kind of step and one of walk, whoever described the robot: here those of others get their names.
function nameAsPanelsDo(summary) {
  const [step, walk] = [plannedBy("step").kind, plannedBy("walk").kind];
  Object.assign(summary, { plan: { ...summary.plan, digest: summary[step] }, walk: summary[walk] });
  Object.assign(summary.up_to_date, { plan: summary.up_to_date[step], walk: summary.up_to_date[walk] });
}

// Such answers say neither the footfall nor the goal that they were asked for; the summary does.
function sayWhatFor({ plan, planned_for: { footfall, goal } }) {
  if (known.plan) Object.assign(known.plan, { footfall });
  if (known.plan) Object.assign(plan, { status: known.plan.status, reason: known.plan.reason });
  if (known.walk) Object.assign(known.walk, { goal });
}

// The server's order holds. A job that the line has told the end of does not come back to life.
function takeJobs(jobs) {
  const before = known.jobs;
  known.jobs = new Map(jobs.map((job) => [job.id, OVER.includes(before.get(job.id)?.state) ? before.get(job.id) : job]));
  for (const [id, job] of before) if (!known.jobs.has(id) && !OVER.includes(job.state)) known.jobs.set(id, job);
}

export async function follow() {
  await refresh();
  listen();
  setInterval(() => { if (!fetching) look(); }, LOOK_PERIOD);
}

function listen() {
  const root = `${location.origin.replace(/^http/, "ws")}${ROOT}`;
  const line = new WebSocket(`${root}/sessions/current/events/line?since=${known.summary.events - 1}&ahead=2&page=${PAGE}`);
  line.addEventListener("open", () => { known.connected = true; look(); });
  line.addEventListener("close", ({ code, reason }) => {
    known.connected = false;
    changed();
    if (code === NO_ROOM) toast(reason);
    setTimeout(listen, code === NO_ROOM ? 10 * RETRY : RETRY);
  });
  line.addEventListener("message", (message) => {
    const { type, data } = readable(JSON.parse(message.data));
    (take[type] ?? look)(data);
    // no more is sent than this page can show: what it shows is never old, however slow page or network are
    if (type === "telemetry") line.send(JSON.stringify({ heard: data.number }));
  });
}

// "link", "session", "preview" and "fits" say only that the summary has changed.
const take = {
  // A hand on the ghost's slider, or on what is moved, sends dozens a second: no summary for each of them.
  view: (view) => tell({ view }),
  hand: (hand) => tell({ hand }),
  event({ type, payload }) {
    if (type === "link_fault") toast(texts.linkFault(payload.source === "rover" ? texts.roverSays : "", payload.reason));
    if (type === "log_repaired" || type === "clock_jumped") toast(texts.recordSays(payload.text));
    look();
  },
  // A click in this page's scene; terrain: whether there is any ground that it could have met.
  missed: ({ terrain }) => toast(terrain ? clickMissed : buildOrLoad),
  store({ problem, unrecorded }) {
    toast(problem ? texts.notRecorded(unrecorded, problem) : texts.recordedAgain);
    look();
  },
  job(job) {
    known.jobs.set(job.id, job);
    known.heardAt = performance.now();
    if (OVER.includes(job.state)) look();
    changed();
  },
  telemetry(frame) {
    known.frame = { ...frame, heardAt: performance.now() };
    known.heardAt = performance.now();
    changed();
  },
};
