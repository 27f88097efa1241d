// Whose choices this page shows: its own, which nobody else changes, or what the holder of the conn shows.

import { act } from "../acts.js";
import { put } from "../api.js";
import { $, attempt } from "../dom.js";
import { follows } from "../following.js";
import { known, subscribe } from "../store.js";
import { refresh } from "../stream.js";

export function start() {
  act({ key: "_", text: "Show my own choices, or what the conn holder shows", button: "whose", run: toggle, refusal: () => (known.summary ? "" : "The session is not known yet.") });
  subscribe(draw);
}

const toggle = () => attempt(async () => {
  await put("/sessions/current/view", { follows: !known.summary.view.follows });
  await refresh();
});

function draw({ summary }) {
  if (!summary) return;
  const { view, conn } = summary;
  const holder = conn.holder ? "the conn holder" : "the conn holder (nobody now: what was chosen last)";
  const text = follows() ? `⇄ What ${holder} shows` : view.follows ? "● My own choices, as I hold the conn" : "● My own choices";
  if ($("whose").textContent !== text) $("whose").textContent = text;
  $("whose").setAttribute("aria-pressed", String(view.follows));
}
