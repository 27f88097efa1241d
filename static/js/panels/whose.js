// Whose choices this page shows: its own, which nobody else changes, or what the holder of the conn shows.

import { act } from "../acts.js";
import { put } from "../api.js";
import { $, attempt } from "../dom.js";
import { follows } from "../following.js";
import { known, subscribe } from "../store.js";
import { refresh } from "../stream.js";
import * as texts from "../texts/conn.js";

export function start() {
  act({ key: "_", text: texts.showOwnOrHolders, button: "whose", run: toggle, refusal: () => (known.summary ? "" : texts.sessionUnknown) });
  subscribe(draw);
}

const toggle = () => attempt(async () => {
  await put("/sessions/current/view", { follows: !known.summary.view.follows });
  await refresh();
});

function draw({ summary }) {
  if (!summary) return;
  const { view, conn } = summary;
  const holder = conn.holder ? texts.holder : texts.noHolder;
  const text = follows() ? texts.holdersChoices(holder) : view.follows ? texts.ownAsHolder : texts.own;
  if ($("whose").textContent !== text) $("whose").textContent = text;
  $("whose").setAttribute("aria-pressed", String(view.follows));
}
