// What happened: the session's events in words, the timeline, notes.

import { age, fixed } from "../figures.js";
import { inWords, madeOf } from "./kinds.js";
import { leg, row } from "./shared.js";
import { wayTold } from "./walk.js";

// States of a command as operators call them; the record's own words are those of the rover link.
export const COMMAND_WORDS = { sent: "released", received: "acknowledged", refused: "failed", unsent: "not sent" };

// A text that turns the direction of writing turns its own, not that of what stands behind it.
export const alone = (text) => (/[\u202a-\u202e\u2066-\u2069]/.test(text) ? `\u2068${text}\u2069` : text);

// What became of a command: its row, from 0.
export const commandTold = (number, state, reason) => `${row(number + 1)} ${COMMAND_WORDS[state] ?? state}${reason ? `: ${alone(reason)}` : ""}`;

// One line for a person: the type, and what of the payload tells this event from its like.
export function eventTold({ type, payload }) {
  const whose = typeof payload.leg === "number" ? leg(payload.leg) : "";
  const where = typeof payload.row === "number" ? row(payload.row + 1) : "";
  const what = [payload.kind, whose, where, payload.status, payload.text, payload.name, payload.format, payload.state, payload.reason];
  const words = what.filter((one) => typeof one === "string" && one && !/^[0-9a-f]{32}$/.test(one)).map(alone);
  const named = type === "product" ? [] : [inWords(type)];
  const who = typeof payload.by?.name === "string" && payload.by.name !== "local" ? [`by ${payload.by.name}`] : [];
  return [...named, ...new Set(words.map(inWords)), ...who].join(", ");
}

// -- what somebody did, as "… chose a footfall for leg 3" goes on ------------------------------------

const CHOICES = { footfall: "the footfall", points: "the points for the wheel", plan: "the choice of a plan", queue: "the change of the queue", edit: "the edit of the commands", stiffness: "the stiffness taken over" };

export const DONE = {
  product: madeOf,
  footfall_chosen: ({ leg: whose }) => `chose a footfall for leg ${whose}`,
  points_set: ({ leg: whose, points }) => `set ${points.length} point${points.length === 1 ? "" : "s"} for the wheel of leg ${whose}`,
  plan_chosen: () => "chose another plan",
  queue_shortened: ({ digest }) => (digest ? "took plans from the end of the queue" : "emptied the queue"),
  stiffness_taken_over: (taken) => `took over joints ${fixed(taken.joint_scale, 2)} × as stiff, before ${fixed(taken.was, 2)} ×`,
  choice_undone: ({ kind }) => `took back ${CHOICES[kind]}`,
  choice_redone: ({ kind }) => `made ${CHOICES[kind]} again`,
  sequence_undone: () => "took back an edit of the commands", sequence_redone: () => "made an edit of the commands again",
  terrain_loaded: () => "loaded terrain", terrain_undone: () => "took back a change of the terrain",
  what_if_ended: () => "ended the what-if", state_frozen: ({ made_so: so }) => (so === undefined ? "froze the rover's state" : "ended the what-if: the rover stands there now"), note: ({ text }) => `noted: ${text}`,
  run_started: () => "began to send commands", run_held: () => "held the commands", run_resumed: () => "went on sending", run_aborted: () => "aborted the commands",
  way_chosen: (chosen) => `walks to a goal: ${wayTold(chosen)}`,
  walk_decided: ({ act, reason }) => `walks to a goal: ${act}: ${reason}`,
  session_renamed: ({ name }) => `called the session ${alone(name)}`,
  conn_changed: ({ act }) => `conn: ${act}`, stop_requested: () => "asked for a stop",
  stop_repeated: () => "asked for the same stop", stop_cleared: () => "cleared the stop",
};

// -- timeline and notes ----------------------------------------------------------------------------

export const noEvents = "No events yet.";
export const eventBefore = "Timeline: event before";
export const eventAfter = "Timeline: event after";
export const showWhatItWas = "Timeline: show what it was";
export const chooseEvent = "Choose an event on the timeline first.";
export const sceneThen = "Timeline: show the scene as it was";
export const chooseMoment = "Choose a moment on the timeline first.";
export const sceneIsPast = (time) => `The scene shows the past, after the event of ${time}. The rover stands as it was planned from then; clicks choose nothing.`;
export const sceneMayBePast = "The scene may show the past still: the server has not answered.";
export const backToNow = "Timeline: back to now";
export const isNow = "The timeline shows now.";
export const writeNote = "Write a note";
export const nowLatest = "Now. Latest:";
export const past = (since) => `Past, ${age(since)} ago:`;

// -- on the page from the beginning -----------------------------------------------------------------

export const timeline = "Timeline";
export const before = "Event before";
export const place = "Place in the session";
export const after = "Event after";
export const whatOthersDid = "What others did";
export const show = "Show";
export const now = "Now";
export const inScene = "In the scene";
export const note = "Note";
export const title = "Events";
export const whereNoteGoes = "It goes into the session's record, with the time";
export const write = "Write it down";
