// The session's recorded events, fetched as they come, and what each is in words.

import { get } from "./api.js";
import { attempt } from "./dom.js";
import { now, subscribe } from "./store.js";
import * as texts from "./texts/record.js";

export const events = []; // oldest first

const listeners = [];
const rows = new Map(); // id of a command → its row, from 0
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
      for (const { type, payload } of page.events) if (type === "command_sent") rows.set(payload.id, payload.row);
      if (page.events.length) listeners.forEach((listener) => listener(page.events));
    } while (page.next);
  } finally {
    fetching = false;
  }
}

// One line for a person: the type, and what of the payload tells this event from its like.
export function describe({ type, payload }) {
  const state = type.startsWith("command_") ? type.slice("command_".length) : "";
  if (state && rows.has(payload.id)) return texts.commandTold(rows.get(payload.id), state, payload.reason);
  return texts.eventTold({ type, payload });
}

// What somebody did, as "… chose a footfall for leg 3" goes on; "" of what nobody did.
export const saidOf = ({ type, payload }) => (texts.DONE[type] && typeof payload.by?.name === "string" ? texts.DONE[type](payload) : "");

// UTC, as everywhere on the page.
export const clock = (time) => new Date(time * 1000).toISOString().slice(11, 19);

// With the day where that was not today.
export function when(time) {
  const day = (at) => new Date(at * 1000).toISOString().slice(0, 10);
  return day(time) === day(now()) ? clock(time) : `${day(time).slice(5)} ${clock(time)}`;
}
