// The sign of an event, alike on the timeline and in plots.

import { KINDS } from "./kinds.js";

// kind → sign, colour, height on the timeline (0 top … 2)
const SIGNS = {
  plan: ["◆", "accent", 0], execution: ["◇", "accent", 0], sequence: ["≡", "accent", 0], export: ["⇪", "accent", 0],
  snapshot: ["◉", "text", 1], terrain: ["▦", "text", 1], maps: ["▩", "text", 1], footfall: ["✚", "text", 1],
  command: ["▸", "good", 2], stop: ["■", "bad", 2], fault: ["▲", "warn", 2], note: ["✎", "warn", 0],
  undone: ["↶", "text", 1], redone: ["↷", "text", 1],
};

/** Sign, colour of the theme and height of an event that has a sign; null of others. What was refused is crossed. */
export function signOf(event) {
  const [sign, colour, height] = found(event) ?? [];
  if (!sign) return null;
  const refused = event.payload.status && event.payload.status !== "found";
  return { sign: refused ? "✕" : sign, colour: refused ? "bad" : colour, height };
}

function found({ type, payload }) {
  if (type === "product") return SIGNS[KINDS[payload.kind]?.sign];
  if (type === "snapshot_taken") return SIGNS.snapshot;
  if (type === "terrain_loaded" || type === "terrain_undone") return SIGNS.terrain;
  if (type === "footfall_chosen" || type === "points_set") return SIGNS.footfall;
  if (type === "plan_chosen" || type === "queue_shortened") return SIGNS.plan;
  if (type === "stiffness_taken_over") return SIGNS.execution;
  if (type === "choice_undone" || type === "sequence_undone") return SIGNS.undone;
  if (type === "choice_redone" || type === "sequence_redone") return SIGNS.redone;
  if (type === "note") return SIGNS.note;
  if (type === "command_sent") return SIGNS.command;
  if (type === "command_refused" || type === "command_unknown") return SIGNS.fault;
  if (type.startsWith("stop_")) return SIGNS.stop;
  return /fault|lost|failed/.test(type) ? SIGNS.fault : null;
}
