// The session's recorded events, fetched as they come, and what each is in words.

import { get } from "./api.js";
import { attempt, fixed } from "./dom.js";
import { madeOf } from "./kinds.js";
import { subscribe } from "./store.js";

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

// States of a command as operators call them; the record's own words are those of the rover link.
export const COMMAND_WORDS = { sent: "released", received: "acknowledged", refused: "failed", unsent: "not sent" };

// A text that turns the direction of writing turns its own, not that of what stands behind it.
export const alone = (text) => (/[\u202a-\u202e\u2066-\u2069]/.test(text) ? `\u2068${text}\u2069` : text);

// One line for a person: the type, and what of the payload tells this event from its like.
export function describe({ type, payload }) {
  const state = type.startsWith("command_") ? type.slice("command_".length) : "";
  if (state && rows.has(payload.id)) {
    return `row ${rows.get(payload.id) + 1} ${COMMAND_WORDS[state] ?? state}${payload.reason ? `: ${alone(payload.reason)}` : ""}`;
  }
  const leg = typeof payload.leg === "number" ? `leg ${payload.leg}` : "";
  const row = typeof payload.row === "number" ? `row ${payload.row + 1}` : "";
  const what = [payload.kind, leg, row, payload.status, payload.text, payload.name, payload.format, payload.state, payload.reason];
  const words = what.filter((one) => typeof one === "string" && one && !/^[0-9a-f]{32}$/.test(one)).map(alone);
  const named = type === "product" ? [] : [type.replaceAll("_", " ")];
  const who = typeof payload.by?.name === "string" && payload.by.name !== "local" ? [`by ${payload.by.name}`] : [];
  return [...named, ...new Set(words.map((one) => one.replaceAll("_", " "))), ...who].join(", ");
}

const CHOICES = { footfall: "the footfall", points: "the points for the wheel", plan: "the choice of a plan", edit: "the edit of the commands", stiffness: "the stiffness taken over" };
const DONE = {
  product: madeOf,
  footfall_chosen: ({ leg }) => `chose a footfall for leg ${leg}`,
  points_set: ({ leg, points }) => `set ${points.length} point${points.length === 1 ? "" : "s"} for the wheel of leg ${leg}`,
  plan_chosen: () => "chose another plan",
  stiffness_taken_over: (taken) => `took over joints ${fixed(taken.joint_scale, 2)} × as stiff, before ${fixed(taken.was, 2)} ×`,
  choice_undone: ({ kind }) => `took back ${CHOICES[kind]}`,
  choice_redone: ({ kind }) => `made ${CHOICES[kind]} again`,
  sequence_undone: () => "took back an edit of the commands", sequence_redone: () => "made an edit of the commands again",
  terrain_loaded: () => "loaded terrain", terrain_undone: () => "took back a change of the terrain",
  what_if_ended: () => "ended the what-if", state_frozen: ({ made_so: so }) => (so === undefined ? "froze the rover's state" : "ended the what-if: the rover stands there now"), note: ({ text }) => `noted: ${text}`,
  run_started: () => "began to send commands", run_held: () => "held the commands", run_resumed: () => "sent on", run_aborted: () => "aborted the commands",
  walk_decided: ({ act, reason }) => `walks to a goal: ${act}: ${reason}`,
  conn_changed: ({ act }) => `conn: ${act}`, stop_requested: () => "asked for a stop",
  stop_repeated: () => "asked for the same stop", stop_cleared: () => "cleared the stop",
};

// What somebody did, as "… chose a footfall for leg 3" goes on; "" of what nobody did.
export const saidOf = ({ type, payload }) => (DONE[type] && typeof payload.by?.name === "string" ? DONE[type](payload) : "");

// UTC, as everywhere on the page.
export const clock = (time) => new Date(time * 1000).toISOString().slice(11, 19);

// With the day where that was not today.
export function when(time) {
  const day = (at) => new Date(at * 1000).toISOString().slice(0, 10);
  return day(time) === day(Date.now() / 1000) ? clock(time) : `${day(time).slice(5)} ${clock(time)}`;
}
