// Follows the session: one event stream, and a fresh summary after everything that changed it.

import { ROOT, get, request } from "./api.js";
import { changed, known } from "./store.js";

let fetching = false;
let again = false;

// Messages come in bursts; one summary at a time, and one more if something came meanwhile.
export async function refresh() {
  if (fetching) {
    again = true;
    return;
  }
  fetching = true;
  try {
    do {
      again = false;
      const summary = await get("/sessions/current");
      await refreshProducts(summary);
      known.summary = summary;
      known.heardAt = performance.now();
    } while (again);
  } finally {
    fetching = false;
  }
  changed();
}

async function refreshProducts(summary) {
  const { digest } = summary.plan;
  if (!digest) known.plan = null;
  else if (known.plan?.digest !== digest) known.plan = await get(`/sessions/current/plans/${digest}`);
  if (!summary.sequence) known.sequence = null;
  else if (known.sequence?.digest !== summary.sequence) {
    const { body, response } = await request("GET", `/sequences/${summary.sequence}`);
    known.sequence = { ...body, etag: response.headers.get("ETag") };
  }
}

export async function follow() {
  await refresh();
  const source = new EventSource(`${ROOT}/sessions/current/events?since=${known.summary.events - 1}`);
  source.addEventListener("open", () => { known.connected = true; refresh(); });
  source.addEventListener("error", () => { known.connected = false; changed(); });
  source.addEventListener("event", () => refresh());
  source.addEventListener("view", () => refresh());
  source.addEventListener("link", () => refresh());
  source.addEventListener("job", (message) => {
    const job = JSON.parse(message.data);
    known.jobs.set(job.id, job);
    known.heardAt = performance.now();
    changed();
  });
  source.addEventListener("telemetry", (message) => {
    known.frame = { ...JSON.parse(message.data), heardAt: performance.now() };
    known.heardAt = performance.now();
    changed();
  });
}
