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

const KEEP_ROWS = ["duration", "joint"]; // edits after which every row has the number that it had
let alike = new Set(); // versions whose rows have the same numbers, as only such edits of this page lie between

const areAlike = (one, other) => one === other || (alike.has(one) && alike.has(other));

// Whether it was made. change: the edit, or a function that gives it in its turn. of: the version in whose list the row was
// pointed at; where its number is another row's by now, nothing is done.
export const edit = (change, of = null) => inTurn(async () => {
  const before = known.sequence.digest;
  if (of !== null && !areAlike(of, before)) throw new Error(texts.rowsHaveMoved);
  const meant = typeof change === "function" ? change() : change;
  const { body } = await request("PATCH", `/sequences/${before}`, { edit: meant }, ofThisVersion());
  if (KEEP_ROWS.includes(meant.kind)) alike = new Set([...(alike.has(before) ? alike : [before]), body.digest]);
  await refresh();
  return true;
});

// The change that was typed into a field, by the number that stands there. Empty is no zero: it changes nothing, and what was
// there before comes back.
export function editTyped(field, before, change, of) {
  if (field.value !== "") return edit(change(Number(field.value)), of);
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
