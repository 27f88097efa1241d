// What others did in this session, one quiet line: who, what, when. Their acts are in the timeline as well.

import { $ } from "../dom.js";
import { clock, saidOf, subscribeToEvents } from "../events.js";
import { known } from "../store.js";
import { isThisPage, whoIs } from "../who.js";

const KEPT = 60_000; // ms that the line stays

let from = null; // number of the first event that came while this page was open
let clearing = 0;

export function start() {
  subscribeToEvents((events) => {
    from ??= known.summary.events;
    const theirs = events.filter(({ seq, payload }) => seq >= from && typeof payload.by?.name === "string" && !isThisPage(payload.by));
    const latest = theirs.findLast((event) => saidOf(event));
    if (latest) tell(latest);
  });
}

function tell(event) {
  const text = `${clock(event.time)} ${whoIs(event.payload.by)} ${saidOf(event)}`;
  $("others").textContent = text;
  $("others").title = text;
  clearTimeout(clearing);
  clearing = setTimeout(() => { $("others").textContent = $("others").title = ""; }, KEPT);
}
