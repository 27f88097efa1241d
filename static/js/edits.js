// Edits of the sequence, each checked by the server at once; and undo of edits and choices alike, in their order.

import { post, request } from "./api.js";
import { attempt } from "./dom.js";
import { refresh } from "./stream.js";
import { known } from "./store.js";
import { settled } from "./panels/hand.js";
import { settled as typed } from "./panels/through.js";

const ofThisVersion = () => ({ "If-Match": known.sequence.etag });

// One after the other: each changes the version that the one before left.
let latest = Promise.resolve();
const inTurn = (make) => (latest = latest.then(() => attempt(make)));

// Whether it was made.
export const edit = (change) => inTurn(async () => {
  await request("PATCH", `/sequences/${known.sequence.digest}`, { edit: change }, ofThisVersion());
  await refresh();
  return true;
});

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
