// Which camera pairs the next terrain is built from: all that there are, but those whose tick was taken away.

import { changed, known } from "./store.js";
import * as texts from "./texts/ground.js";

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

export const notBuildable = () => (!known.summary?.snapshot ? texts.noImagesYet : pairs().length && !pairs().some(isTicked) ? texts.noPairTicked : "");

// What the choice is, in words; "" where all pairs are used.
export const choiceText = () => {
  const left = pairs().filter((pair) => !isTicked(pair));
  return left.length ? texts.pairsChosen(pairs().length - left.length, pairs().length, left.join(", ")) : "";
};
