// The session's recorded events, fetched as they come, and what each is in words.

import { get } from "./api.js";
import { attempt } from "./dom.js";
import { subscribe } from "./store.js";

export const events = []; // oldest first

const listeners = [];
let fetching = false;

export function startEvents() {
  subscribe(({ summary }) => { if (summary && !fetching && summary.events > events.length) attempt(read); });
}

export function subscribeToEvents(listener) {
  listeners.push(listener);
}

async function read() {
  fetching = true;
  try {
    let page;
    do {
      page = await get(`/sessions/current/log?since=${events.length - 1}`);
      events.push(...page.events);
      if (page.events.length) listeners.forEach((listener) => listener(page.events));
    } while (page.next);
  } finally {
    fetching = false;
  }
}

// One line for a person: the type, and what of the payload tells this event from its like.
export function describe({ type, payload }) {
  const leg = typeof payload.leg === "number" ? `leg ${payload.leg}` : "";
  const row = typeof payload.row === "number" ? `row ${payload.row + 1}` : "";
  const what = [payload.kind, leg, row, payload.status, payload.text, payload.name, payload.format, payload.state, payload.reason];
  const words = what.filter((one) => typeof one === "string" && one && !/^[0-9a-f]{32}$/.test(one));
  const named = type === "product" ? [] : [type.replaceAll("_", " ")];
  return [...named, ...new Set(words.map((one) => one.replaceAll("_", " ")))].join(", ");
}

export const clock = (time) => new Date(time * 1000).toISOString().slice(11, 19);
