// How things are in each work area, in a few words: what its card says while it is closed.

import { $ } from "../dom.js";
import { isOfAnother, outOfDate, walkOutOfDate } from "../fits.js";
import { notFor } from "../robot.js";
import { STALE_AFTER, known, now, telemetryAge } from "../store.js";
import * as texts from "../texts/layout.js";


// name → words; an area that is not here says nothing.
const STATES = {
  ground: ({ terrain }) => (terrain ? texts.ground(terrain.known, now() - terrain.seen) : texts.noGround),
  images: ({ pairs }) => (pairs?.length ? texts.images(pairs.length) : texts.noImages),
  footfall: ({ footfall }) => (footfall ? texts.footfall(footfall.leg, footfall) : texts.noFootfall),
  plan: ({ plan, footfall, up_to_date: fits }) => (isAside(footfall) ? texts.ofAnotherFootfall(planTold(plan)) : doubted(fits.plan, planTold(plan))),
  goal: ({ view }) => (view.goal ? texts.goal(view.goal) : texts.noGoal),
  walk: ({ walking }) => (walkOutOfDate(known) ? texts.outOfDate(walkTold(walking, known.walk)) : walkTold(walking, known.walk)),
  loop: ({ walk_loop: loop }) => (!loop || loop.state === "ended" ? texts.noLoop : texts.loop(loop.state === "held")),
  execution: ({ execution, up_to_date: fits }) => doubted(fits.execution, execution.digest ? texts.sag(execution.status === "found") : texts.noSag),
  commands: ({ gate, run }) => (gate.state === "sending" && run ? texts.atRow((gate.row ?? 0) + 1, run.rows.length) : commandsTold(known)),
  legs: () => (known.frame ? ofThen(legsTold(known.frame)) : texts.noTelemetry),
  telemetry: () => (known.frame ? texts.telemetry(telemetryAge(known.frame), isStale()) : texts.noTelemetry),
  sessions: ({ name }) => name,
  record: ({ events }) => texts.record(events),
};

export const stateOf = (name) => (known.summary ? notFor($(`panel-${name}`)) || (STATES[name]?.(known.summary) ?? "") : "");

const doubted = (fit, text) => (outOfDate(fit) ? texts.outOfDate(text) : text);

// Whether the plan is to another footfall than the chosen one.
const isAside = (chosen) => Boolean(chosen && known.plan?.footfall) && isOfAnother(chosen, known.plan.footfall);

const planTold = ({ digest, status }) => (!digest ? texts.noPlan : status === "found" ? texts.planFound : texts.planRefused);

function walkTold(walking, walk) {
  if (!walk) return texts.noWalk;
  if (walking?.done) return texts.walkDone(Math.min(walking.done, walk.plan.legs.length), walk.plan.legs.length, walking.next === null);
  return walk.status === "found" ? texts.walkFound(walk.plan.legs.length) : texts.walkRefused;
}

function commandsTold({ summary, sequence }) {
  if (!sequence) return texts.noCommands;
  if (summary.commands_carried_out) return texts.carriedOut(sequence.commands.length);
  const told = texts.commands(sequence.commands.length, sequence.duration, sequence.valid);
  return summary.commands_of_another_plan ? texts.ofAnotherPlan(told) : doubted(summary.up_to_date.sequence, told);
}

const isStale = () => telemetryAge(known.frame) > STALE_AFTER;
const ofThen = (text) => (isStale() ? texts.wasSo(telemetryAge(known.frame), text) : text);

function legsTold({ wheel_forces: forces }) {
  const up = forces.map((force) => force[2]);
  const weight = up.reduce((sum, one) => sum + one, 0);
  return weight > 0 ? texts.legs(up.flatMap((one, leg) => (one < known.robot.least_load * weight ? [leg] : []))) : texts.noForces;
}
