// What robot the session is about: its legs and joints, by what its steps and walks are planned, and what it has not. GET robot
// says it; no other module knows how a robot is built.

import { element } from "./dom.js";
import { known } from "./store.js";
import * as texts from "./texts/robot.js";

// Numbers of a posture that are a leg's own.
export const jointsOf = (leg) => known.robot.leg_joints[leg];

export const slides = (joint) => known.robot.joint_units[joint] === "m";

// Whether it has ATHLETE's legs; else others described it.
export const isAthletes = () => known.robot.athletes_build;

// Whether it has cameras to see the ground with.
export const sees = () => known.robot.cameras.length > 0;

// A length that is in proportion to the robot's size, as so many of its longest legs [m].
export const legsLong = (legs) => legs * known.robot.longest_leg;

// By what its "step" or "walk" is planned: {kind, folder}.
export const plannedBy = (what) => known.robot.planned_by[what];
export const orders = (what) => `/sessions/current/${plannedBy(what).folder}`;

// Why a part of the page is not for this robot, "" where it is. The markup says with data-alone what the robot lacks; a button
// whose part says so is not for it either.
export function notFor(part) {
  const lack = part?.closest("[data-alone]")?.dataset.alone;
  return lack && known.robot && !isAthletes() && !(lack === "cameras" && sees()) ? texts.ALONE[lack] : "";
}

// Takes out of sight what is not for this robot. An area, or a group of several things, keeps its heading and says why; a single
// thing goes without a word: its button says why, where it is asked for by key or name.
export function leaveOut() {
  if (isAthletes()) return;
  for (const part of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-alone]"))) {
    if (!notFor(part)) continue;
    if (part.matches("button, label, a, p")) {
      part.classList.add("alone");
      continue;
    }
    for (const child of part.children) if (!child.matches("h2, summary, .tools, .state")) child.classList.add("alone");
    part.append(element("p", { className: "hint", textContent: notFor(part) }));
  }
}
