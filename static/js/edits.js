// Edits of the sequence. Each is checked by the server at once, and can be undone.

import { request } from "./api.js";
import { attempt } from "./dom.js";
import { refresh } from "./stream.js";
import { known } from "./store.js";

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

const step = (way) => inTurn(async () => {
  await request("POST", `/sequences/${known.sequence.digest}/${way}`, {}, ofThisVersion());
  await refresh();
});

export const undo = () => step("undo");
export const redo = () => step("redo");
