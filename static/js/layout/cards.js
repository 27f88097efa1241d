// Cards: an area is open to be worked in, or closed to its heading and a line that says how things are there. Where a layout
// follows the job, the card that holds what comes next opens by itself, and closes when the job has gone on.

import { change, closed, follows } from "./kept.js";

const opened = new Map(); // beside what is kept: name → "act", until the page is loaded anew; "job", until it has gone on
let next = ""; // the button of what comes next

export const isOpen = (name) => !closed().includes(name) || opened.has(name);

export function open(name) {
  if (!isOpen(name)) opened.set(name, "act");
}

export function openForGood(name) {
  opened.delete(name);
  if (closed().includes(name)) change({ closed: closed().filter((one) => one !== name) });
}

export function close(name) {
  opened.delete(name);
  if (!closed().includes(name)) change({ closed: [...closed(), name] });
}

export function forget() {
  opened.clear();
  next = "";
}

// What comes next is done by that button, in the area of that name; "" where there is only to wait. inHand: whether the
// operator is at an area. Whether a card opened or closed: once for each thing that comes next, so that one which the
// operator closed stays so.
export function goWithJob(button, name, inHand) {
  if (!follows() || !button) return false;
  const gone = [...opened].flatMap(([one, by]) => (by === "job" && one !== name && !inHand(one) ? [one] : []));
  gone.forEach((one) => opened.delete(one));
  const opens = button !== next && !isOpen(name);
  if (opens) opened.set(name, "job");
  next = button;
  return opens || gone.length > 0;
}
