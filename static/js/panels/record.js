// Record: what happened, newest first, and the session bundles that can be opened or taken away.

import { ROOT, get, once, post } from "../api.js";
import { $, attempt, element } from "../dom.js";
import { subscribe } from "../store.js";

const SHOWN = 60;
let lastSeen = -1;
let fetching = false;

export function start() {
  $("open-recording").addEventListener("click", () => attempt(async () => {
    const [kind, name] = JSON.parse($("recordings").value);
    await post("/sessions", { [kind]: name }, once());
    location.reload(); // every panel starts anew on the session that is now current
  }));
  attempt(async () => {
    const { samples, sessions, current } = await get("/sessions");
    const choice = (kind, name, text) => element("option", { value: JSON.stringify([kind, name]), textContent: text });
    const earlier = sessions.filter((one) => one.id !== current && !one.problem);
    $("recordings").append(
      element("optgroup", { label: "Samples" }, ...samples.map((name) => choice("sample", name, name))),
      element("optgroup", { label: "Earlier sessions" }, ...earlier.map((one) => choice("session", one.id, `${one.name}, ${one.id}`))),
    );
  });
  subscribe(draw);
}

// One line for a person: the type, and what of the payload tells this event from its like.
function describe({ type, payload }) {
  const what = [payload.kind, payload.status, payload.text, payload.name, payload.format, payload.state, payload.reason];
  return [type.replaceAll("_", " "), ...new Set(what.filter((one) => typeof one === "string" && one))].join(", ");
}

async function draw({ summary }) {
  if (!summary) return;
  $("download-bundle").href = `${ROOT}/recordings/${encodeURIComponent(summary.id)}.zip`;
  if (fetching || summary.events - 1 <= lastSeen) return;
  fetching = true;
  try {
    const events = (await get(`/sessions/current/log?since=${lastSeen}`)).events;
    for (const event of events) {
      lastSeen = event.seq;
      const time = new Date(event.time * 1000).toISOString().slice(11, 19);
      $("log").prepend(element("li", { value: event.seq, textContent: `${time} ${describe(event)}` }));
    }
    while ($("log").children.length > SHOWN) $("log").lastChild.remove();
  } finally {
    fetching = false;
  }
}
