// What the page knows of the session: the server's summary and what came after it. Panels subscribe.

const listeners = [];

export const known = {
  summary: null, // GET sessions/current
  robot: null, // GET robot
  me: null, // GET me: name, role
  frame: null, // latest telemetry message
  heardAt: 0, // when the server was last heard, performance.now()
  connected: false, // the event stream is open
  jobs: new Map(), // id → job, oldest first
  plan: null, // the current PlanResult
  walk: null, // the latest WalkResult
  gait: null, // the latest GaitResult
  route: null, // the latest RouteResult
  sequence: null, // the current Sequence, with its ETag
};

const SILENT_AFTER = 5; // seconds

// How long the server has said nothing [s], and whether it answers.
export const silent = () => (performance.now() - known.heardAt) / 1000;
export const alive = () => known.connected && silent() < SILENT_AFTER;

const UNSURE = 5; // s: answers tell whole seconds, and take their time
let ahead = 0; // s: the server's clock before this computer's

// date: of an answer that has just come, as its header has it; null: none.
export function hearClock(date) {
  const found = date === null ? 0 : (Date.parse(date) - Date.now()) / 1000;
  ahead = Math.abs(found) > UNSURE ? found : 0;
}

// The server's time [s since 1970]: what it says the time of is as old as by its clock, whatever this computer's is.
export const now = () => Date.now() / 1000 + ahead;

export const STALE_AFTER = 2; // s: telemetry that is older says nothing of now; the command gate refuses beyond this, too

// How old a telemetry message is by now [s].
export const telemetryAge = (frame) => frame.age_s + (performance.now() - frame.heardAt) / 1000;

export function subscribe(listener) {
  listeners.push(listener);
}

export function changed() {
  for (const listener of listeners) listener(known);
}
