// How things are in each work area, in a few words: what its card says while it is closed.

import { $ } from "../dom.js";
import { outOfDate, walkOutOfDate } from "../fits.js";
import { notFor } from "../robot.js";
import { known, now, telemetryAge } from "../store.js";
import * as texts from "../texts/layout.js";

// name → words; an area that is not here says nothing.
const STATES = {
  ground: ({ terrain }) => (terrain ? texts.ground(terrain.known, now() - terrain.seen) : texts.noGround),
  images: ({ pairs }) => (pairs?.length ? texts.images(pairs.length) : texts.noImages),
  footfall: ({ footfall }) => (footfall ? texts.footfall(footfall.leg, footfall) : texts.noFootfall),
  plan: ({ plan, up_to_date: fits }) => doubted(fits.plan, planTold(plan)),
  goal: ({ view }) => (view.goal ? texts.goal(view.goal) : texts.noGoal),
  walk: ({ walking }) => (walkOutOfDate(known) ? texts.outOfDate(walkTold(walking, known.walk)) : walkTold(walking, known.walk)),
  loop: ({ walk_loop: loop }) => (!loop || loop.state === "ended" ? texts.noLoop : texts.loop(loop.state === "held")),
  execution: ({ execution, up_to_date: fits }) => doubted(fits.execution, execution.digest ? texts.sag(execution.status === "found") : texts.noSag),
  commands: ({ gate, run }) => (gate.state === "sending" && run ? texts.atRow((gate.row ?? 0) + 1, run.rows.length) : commandsTold(known.sequence)),
  legs: () => (known.frame ? legsTold(known.frame) : texts.noTelemetry),
  telemetry: () => (known.frame ? texts.telemetry(telemetryAge(known.frame)) : texts.noTelemetry),
  sessions: ({ name }) => name,
  record: ({ events }) => texts.record(events),
};

export const stateOf = (name) => (known.summary ? notFor($(`panel-${name}`)) || (STATES[name]?.(known.summary) ?? "") : "");

const doubted = (fit, text) => (outOfDate(fit) ? texts.outOfDate(text) : text);

const planTold = ({ digest, status }) => (!digest ? texts.noPlan : status === "found" ? texts.planFound : texts.planRefused);

function walkTold(walking, walk) {
  if (!walk) return texts.noWalk;
  if (walking?.done) return texts.walkDone(Math.min(walking.done, walk.plan.legs.length), walk.plan.legs.length, walking.next === null);
  return walk.status === "found" ? texts.walkFound(walk.plan.legs.length) : texts.walkRefused;
}

const commandsTold = (sequence) => (sequence ? texts.commands(sequence.commands.length, sequence.duration, sequence.valid) : texts.noCommands);

function legsTold({ wheel_forces: forces }) {
  const up = forces.map((force) => force[2]);
  const weight = up.reduce((sum, one) => sum + one, 0);
  return weight > 0 ? texts.legs(up.flatMap((one, leg) => (one < known.robot.least_load * weight ? [leg] : []))) : texts.noForces;
}
