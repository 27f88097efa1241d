// Whether a product is of how things are now, in words: every panel asks here.

import * as texts from "./texts/plan.js";

/** Why a product is out of date; "" where it is not, or there is none. */
export const outOfDate = (fit) => (fit?.fits === false ? fit.reason : "");

/** What an operator should know of a product that fits: that the rover is not heard, or that there is a newer map. */
export function reserve(fit, { unheard }) {
  if (!fit?.fits) return "";
  const said = [];
  if (fit.verdict === "unknown") said.push(texts.stanceUnknown(unheard));
  if (fit.ground) said.push(texts.sameGround);
  return said.join("; ");
}
