// Which camera pairs the next terrain is built from: all that there are, but those whose tick was taken away.

import { changed, known } from "./store.js";

const unticked = new Set();

export const isTicked = (pair) => !unticked.has(pair);

export function tick(pair, on) {
  if (on) unticked.delete(pair);
  else unticked.add(pair);
  changed();
}

const pairs = () => known.summary?.pairs ?? [];

// Names for the settings of a build; empty where all are used.
export const chosenPairs = () => {
  const ticked = pairs().filter(isTicked);
  return ticked.length === pairs().length ? [] : ticked;
};

export const notBuildable = () => (!known.summary?.snapshot ? "There are no images yet: take images first." : pairs().length && !pairs().some(isTicked) ? "No camera pair is ticked for it: see Images." : "");

// What the choice is, in words; "" where all pairs are used.
export const choiceText = () => {
  const left = pairs().filter((pair) => !isTicked(pair));
  return left.length ? `The next terrain is built from ${pairs().length - left.length} of ${pairs().length} camera pairs, without ${left.join(", ")}.` : "";
};
