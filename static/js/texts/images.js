// Images: the pairs, their views, lines over them, a place chosen in one.

import { age, fixed, metres, percent, place } from "../figures.js";

export const VIEWS = { left: "Left", right: "Right", disparity: "Disparity", mask: "Rover mask" };
const SEEN = { hidden: "hidden behind ground or the rover", outside: "outside of this image" };

export const goalOfWalk = "goal of the walk";
export const footfallOfLeg = "footfall of the leg";
export const allPairs = "The next terrain is built from all pairs.";
export const clickOnGround = (what) => `Click on the ground in the image: it becomes the ${what}.`;
export const wideOrNarrow = "Images wide or narrow";
export const title = "Images";
export const view = (name) => `Image: ${name}`;
export const noImages = "No images yet: Take images (key I) asks the rover for them.";
export const loadingImages = "The images are loading.";
export const notListed = (why) => `The images can't be listed: ${why}`;
export const buildWith = (pair) => `Build the next terrain with ${pair}`;
export const nextTerrainWith = (pair) => `Next terrain with ${pair}`;
export const notUsable = (pair, reason) => `${pair} came, but can't be used: ${reason}`;
export const taken = (time, since) => `, taken ${time} UTC, ${age(since)} ago`;
export const snapshotTold = (pair, shown, digest, when) => `${pair}, ${shown}: snapshot ${digest}${when}`;
export const stale = (why) => `STALE: ${why}`;
export const staleUnknown = (why) => `Whether the rover has moved since is not known: ${why}`;
export const asInImages = "The rover stands as in the images.";
export const newerLoading = "Newer images are loading.";
export const notDrawn = (why) => `Plan and grid can't be drawn over the image: ${why}`;
export const inSightOf = (pair) => `${pair}: the footfall is in sight`;
export const footfallSeen = (leg, seen) => `Footfall of leg ${leg}: ${SEEN[seen] ?? "in sight"}.`;
export const moveCross = "Move the cross with the arrow keys first.";
export const goalSet = (at) => `Goal of the walk set at ${place(at)}.`;
export const footfallSet = (leg, at) => `Footfall of leg ${leg} chosen at ${place(at)}.`;

// -- the large image -------------------------------------------------------------------------------

export const matching = "Matching the pairs; for the first of a snapshot this takes some seconds.";
export const loading = "Loading.";
export const imageFailed = "The image did not come.";
export const robotShare = (share) => `the rover, ${some(share)} of the image`;
export const rimShare = (share) => `▨ may be the rover, ${some(share)}: left out of the terrain too`;
export const pairNotUsable = (why) => `This pair can't be used: ${why}`;
export const ramp = (far, near) => `${fixed(far.disparity, 1)} px = ${metres(far.depth, 2)} … ${fixed(near.disparity, 1)} px = ${metres(near.depth, 2)}`;
export const notMatched = (share) => `? not matched, ${some(share)}`;
export const usedShare = (share) => `${some(share)} of the image is ground for a terrain: matched, and not the rover`;
const some = (share) => percent(share, share < 0.01 ? 1 : 0);

// -- on the page from the beginning -----------------------------------------------------------------

export const whichPair = "Camera pair";
export const buildWithThese = "Build the next terrain with";
export const notUsed = "Pairs that can't be used";
export const whichView = "View";
export const plan = "{} plan";
export const grid = "{} grid, 0.5 m";
export const wide = "Wide";
export const choose = "Choose the footfall in the image";
export const again = "Load again";
export const colours = "Colours of the picture";
export const lines = "The wheel's way: dashes lift, line swing, dots lower; white points are waypoints, amber squares points that it is led through.";
export const byKeys = "With the image in focus, arrow keys move a cross (Shift: by one pixel), and Enter chooses the ground there. ◎ marks the pairs that see the footfall.";
