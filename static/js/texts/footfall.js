// The footfall: chosen, suggested, moved by hand; points for the wheel to pass on its way there.

import { degrees, fixed, metres, percent, place } from "../figures.js";

export const typeFootfall = "Type the footfall";
export const judged = ({ footing, leg, x, y, z, margin, slope }) => `${footing ?? "Not judged yet"}: leg ${leg} at ${place([x, y, z])}`
  + (margin === null ? "" : `, margin ${metres(margin)}`)
  + (slope === null ? "" : `, slope ${degrees(slope)}`);

// -- suggested -------------------------------------------------------------------------------------

export const suggest = "Suggest footfalls";
export const onceMade = (leg, share) => `The colours for leg ${leg} are being made, ${percent(share)} so far: footfalls are suggested once they are there.`;
export const at = (x, y) => place([x, y], 2);
export const apart = (measure) => ` ${measure ?? "like the others in all that is measured"}`;
export const scored = (share, weakest) => `; ${fixed(100 * share, 1)} of 100, ${weakest}`;
export const reasons = "why";
export const rankedOtherwise = "Weights or direction are others now: suggest again.";

// -- in hand ---------------------------------------------------------------------------------------

export const takeInHand = "Take in hand: the footfall, then each point, then the chassis";
export const nothingToMove = "There is nothing to move: choose a footfall first.";
export const moveFootfall = "Move the footfall by hand";
export const chooseFirst = "Choose a footfall first.";
export const previewMove = "Preview a chassis move";
export const nothingToPlanFrom = "There is no terrain, or no state to plan from.";
export const setInHand = "Set what is in hand where it is";
export const putBack = "Put back what is in hand";
export const arrowKeys = "Arrow keys";
export const aboutArrows = "Move what is in hand by a cell (Shift: ten); Page up, down: higher, lower";
export const enterEscape = "Enter, Esc";
export const aboutEnter = "Set what is in hand where it is; put it back";
export const nothingInHand = "This page has nothing in hand.";
export const inHand = "In hand";
export const moves = (who) => `${who} moves`;
export const point = (number) => `point ${number}`;
export const notSetYet = ", not set yet";
export const refused = (why) => `Put back: ${why}`;
export const handTold = (whose, what, state) => `${whose}: ${what}${state}`;

// -- points for the wheel --------------------------------------------------------------------------

export const addPoint = "Add a point at the ghost for the wheel to pass";
export const noGhost = "There is no plan whose ghost could show a place: plan the step first.";
export const removePoints = "Remove all points for the wheel to pass";
export const noPoints = "There are no points.";
export const axisOfPoint = (axis, number) => `${axis} of point ${number}`;
export const moveByHand = "Move by hand";
export const movePoint = (number) => `Move point ${number} by hand`;
export const remove = "Remove";
export const removePoint = (number) => `Remove point ${number}`;

// -- on the page from the beginning -----------------------------------------------------------------

export const everyLayer = "Every layer here";
export const setHere = "Set here {}";
export const back = "Put back {}";
export const title = "{} Footfall";
export const clickOrType = "Click on the ground, or type a place.";
export const choose = "Choose";
export const keyF = "The key F leads to these fields";
export const toward = "Toward {}";
export const anywhere = "anywhere";
export const east = "east";
export const north = "north";
export const west = "west";
export const south = "south";
export const weights = "Weights of the suggestions";
export const suggested = "Suggested footfalls";
export const lead = "Lead the wheel through points (key J)";
export const aboutLead = "Wheel centre, site frame [m]; the arrow keys move a point by 5 cm, ✥ takes it in hand. The rest is planned anew and checked whole.";
export const addOne = "Add a point at the ghost";
export const removeAll = "Remove all";
