// Whether a product is of how things are now, in words: every panel asks here.

import * as texts from "./texts/plan.js";

/** Why a product is out of date; "" where it is not, or there is none. */
export const outOfDate = (fit) => (fit?.fits === false ? fit.reason : "");

/** Whether a footfall is another than the chosen one. */
export const isOfAnother = (chosen, { leg, x, y }) => chosen.leg !== leg || chosen.x !== x || chosen.y !== y;

/** Whether what is being carried out are foot moves of a walk. */
export const isWalking = ({ summary: { gate, run }, sequence }) =>
  gate.state === "sending" && run?.sequence === sequence?.digest && Boolean(sequence?.foot_moves?.length);

/** Why a walk is out of date; of one whose first foot moves were made, why the next can't begin. Of one that is over, or being walked, nothing. */
export function walkOutOfDate(facts) {
  const { walking, up_to_date: fits } = facts.summary;
  if (walking && (walking.next === null || isWalking(facts))) return "";
  return walking?.done ? walking.against : outOfDate(fits.walk);
}

/** What an operator should know of a product that fits: that the rover is not heard, or that there is a newer map. */
export function reserve(fit, { unheard }) {
  if (!fit?.fits) return "";
  const said = [];
  if (fit.verdict === "unknown") said.push(texts.stanceUnknown(unheard));
  if (fit.ground) said.push(texts.sameGround);
  return said.join("; ");
}
