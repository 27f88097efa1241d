// The queue: steps and moves of the chassis, planned one after another, to be commanded together.

import { metres, seconds } from "../figures.js";

export const queueStep = "Queue the step, and plan from where it ends";
export const noPlanToQueue = "There is no step to queue: plan one first.";
export const makeOfQueue = "Make commands of the queue";
export const emptyQueue = "Empty the queue";
export const fromQueuesEnd = "Plan from the queue's end";
export const noQueue = "The queue is empty.";
export const carriedOut = "The queue was carried out: what is queued next begins a new one.";
export const planningFromEnd = (count) => `The next step or move is planned from where entry ${count} ends. What is made from there is sent with the queue.`;
export const notFromEnd = (count) => `The next step or move is not planned from where entry ${count} ends, so it can't be queued.`;
export const refused = (reason) => `Not queued: ${reason}`;
export const total = (entries) => `${entries.length === 1 ? "1 entry" : `${entries.length} entries`}, ${seconds(entries.reduce((sum, one) => sum + one.duration, 0))} if the rover is taken as rigid`;
export const remove = (number) => `Take entry ${number} from the queue`;
export const legOf = (leg) => (leg === null ? "all" : String(leg));
export const what = (leg) => (leg === null ? "move of the chassis" : "step");
export const leastMargin = (entries) => {
  const margins = entries.map((one) => one.margin).filter((one) => one !== null);
  return margins.length ? `Least margin of balance ${metres(Math.min(...margins))}.` : "";
};

// -- on the page from the beginning -----------------------------------------------------------------

export const add = "Queue it, and go on";
export const aboutAdd = "The step joins the queue, and the next is planned from where it ends";
export const list = "Queue: becomes one command list";
export const number = "No.";
export const kind = "What";
export const leg = "Leg";
export const time = "Time [s]";
export const margin = "Margin [m]";
export const make = "Make commands of the queue";
export const empty = "Empty";
export const fromEnd = "Plan from its end";
