// What was chosen last on this page: the leg, and its footfall. Whatever is asked for next means these, also before the
// server has told the page of them.

import { post, put } from "./api.js";
import { attempt } from "./dom.js";
import { requireOwn } from "./following.js";
import { known } from "./store.js";
import { refresh } from "./stream.js";
import * as texts from "./texts/page.js";

let waiting = null; // the choices that are on their way: whether the latest was taken

function send(make) {
  const before = waiting ?? Promise.resolve(true);
  const mine = before.then(() => attempt(async () => {
    requireOwn();
    await make();
    await refresh();
    return true;
  })).then((taken) => {
    if (waiting === mine) waiting = null;
    return Boolean(taken);
  });
  waiting = mine;
  return mine;
}

export const chooseLeg = (leg) => send(() => put("/sessions/current/view", { leg }));

// leg: the one that is chosen by then, where none is named.
export const chooseFootfall = (x, y, leg = null) => send(() => post("/sessions/current/footfalls", { leg: leg ?? known.summary.view.leg, x, y }));

// What was chosen is known to the page. Throws where it was refused: nothing is asked for of the choice before it; and
// where another page's choices are shown: these may change before they are asked for.
export async function settled() {
  requireOwn();
  if (waiting && !(await waiting)) throw new Error(texts.choiceRefused);
}
