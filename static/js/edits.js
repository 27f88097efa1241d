// Edits of the sequence, each checked by the server at once; and undo of edits and choices alike, in their order.

import { post, request } from "./api.js";
import { attempt, toast } from "./dom.js";
import { refresh } from "./stream.js";
import { changed, known } from "./store.js";
import * as texts from "./texts/commands.js";
import { settled } from "./panels/hand.js";
import { settled as typed } from "./panels/through.js";

const ofThisVersion = () => ({ "If-Match": known.sequence.etag });

// One after the other: each changes the version that the one before left.
/** @type {Promise<any>} */
let latest = Promise.resolve();
let onTheWay = 0;

// Whether the server has still to answer an edit. Until then what was typed stays in sight, not what was there before.
export const isOnItsWay = () => onTheWay > 0;

function inTurn(make) {
  onTheWay += 1;
  const mine = latest.then(() => attempt(make)).finally(() => {
    onTheWay -= 1;
    queueMicrotask(changed); // what goes wrong there keeps no later edit back
  });
  latest = mine;
  return mine;
}

// Whether it was made.
export const edit = (change) => inTurn(async () => {
  await request("PATCH", `/sequences/${known.sequence.digest}`, { edit: change }, ofThisVersion());
  await refresh();
  return true;
});

// The change that was typed into a field, by the number that stands there. Empty is no zero: it changes nothing, and what was
// there before comes back.
export function editTyped(field, before, change) {
  if (field.value !== "") return edit(change(Number(field.value)));
  toast(texts.noNumber(field.ariaLabel));
  field.value = before;
  return undefined;
}

// Which choice is meant goes along: another one that came since is not taken back unseen.
const turn = (way) => inTurn(async () => {
  await settled(); // what is being moved, or typed, is the latest choice
  await typed();
  const choice = known.summary[way];
  if (!choice) return;
  try {
    await post(`/sessions/current/${way}`, { choice: choice.choice });
  } finally {
    await refresh();
  }
});

export const undo = () => turn("undo");
export const redo = () => turn("redo");
