// What the page calls the kinds of products, how planning ended, and how work goes.

import { age } from "../figures.js";

const STATUSES = { no_path: "no way was found", time_limit: "the time limit has passed", off_map: "off the map", unknown_ground: "unknown ground" };

// A name of the server's as words.
export const inWords = (name) => name.replaceAll("_", " ");

// How planning ended; who: what was to go to the goal.
export function statusTold(status, who = "the leg") {
  if (status === "start_invalid") return `${who} cannot start from here`;
  return status === "goal_invalid" ? `${who} cannot stand there` : STATUSES[status] ?? inWords(status);
}

export const ofWalkers = (status) => statusTold(status, "the rover");

// -- a kind by its name, where that is no word of the field ------------------------------------------

export const TITLES = {
  maps: "colours",
  after: "predicted stance",
  what_if: "what-if",
  execution: "prediction of sag",
  shift: "shift of the chassis",
  body_move: "move of the chassis",
  held_move: "chassis move with the pose held",
  held_queue: "queue with the pose held",
  described_maps: "colours",
  described_step: "step of a robot of your own",
  described_walk: "walk of a robot of your own",
  sequence: "commands",
  foot_moves: "commands of foot moves",
};

export const titleOf = (kind) => TITLES[kind] ?? inWords(kind);

// At the beginning of a sentence.
export const namedFirst = (kind) => titleOf(kind).replace(/^./, (letter) => letter.toUpperCase());

// -- what who made one did, from the payload of its event ---------------------------------------------

const MADE = {
  terrain: () => "built the terrain",
  photographs: () => "built the terrain",
  blend: () => "blended terrains",
  clear: () => "cleared ground",
  maps: ({ leg }) => `coloured the ground for leg ${leg}`,
  plan: ({ leg, status }) => `planned the step of leg ${leg}: ${statusTold(status)}`,
  after: () => "went on from the end of a plan",
  what_if: () => "shifted the chassis in a what-if",
  execution: ({ status }) => `predicted the sag: ${inWords(status)}`,
  shift: () => "looked for a shift of the chassis",
  body_move: () => "checked a move of the chassis",
  held_move: () => "predicted the sag of a move of the chassis",
  queue: ({ status }) => (status === "found" ? "queued a plan" : "queued no plan: it does not follow the queue"),
  held_queue: ({ status }) => `predicted the sag of the queue: ${inWords(status)}`,
  walk: ({ status }) => `planned a walk: ${ofWalkers(status)}`,
  gait: ({ status }) => `planned a gait: ${ofWalkers(status)}`,
  route: ({ status }) => `planned a route: ${ofWalkers(status)}`,
  described_maps: ({ leg }) => `coloured the ground for leg ${leg}`,
  described_step: ({ leg, status }) => `planned the step of leg ${leg}: ${statusTold(status)}`,
  described_walk: ({ status }) => `planned a walk: ${statusTold(status, "the robot")}`,
  sequence: () => "made commands",
  foot_moves: () => "made commands of a walk",
  outcome: () => "compared the run with its prediction",
  edit: () => "edited the commands",
  import: () => "read commands from a file",
  export: ({ format }) => `exported the commands as ${format}`,
};

export const madeOf = (payload) => MADE[payload.kind]?.(payload) ?? `made: ${inWords(payload.kind)}`;

// -- work under way, and how it ended ----------------------------------------------------------------

export const cancelJob = "Cancel the running job";
export const noJob = "No job is running.";
export const goToEnded = "Go to what ended last";
export const nothingEnded = "Nothing has ended yet.";
export const images = "images";
export const imagesCame = "Images received";
export const imagesLost = "No images: the link was lost before they came";
export const noImages = "No images received";
export const before = (since) => `, ${age(since)} ago`;
export const more = (count) => `, ${count} more`;
export const underWay = (what, doing, others, since) => `${what}: ${doing}${others}${since}`;
export const imagesLate = "No images yet:";
export const imagesAwaited = "Waiting for images:";
export const awaited = (what, since) => `${what} ${since} s`;
export const failed = (what, why) => `${what} failed: ${why}`;
export const cancelled = (what) => `${what} cancelled`;
export const FOUND = { plan: "Plan found", walk: "Walk found", gait: "Gait found", route: "Route found" };
export const notFound = (what, why) => `No ${what}: ${why}`;
export const commandsReady = "Commands ready: every rule holds";
export const commandsBroken = "Commands ready, but a rule does not hold";
export const ready = (what) => `${what} ready`;

// -- on the page from the beginning -----------------------------------------------------------------

export const jobUnderWay = "Under way";
export const progress = "Progress";
