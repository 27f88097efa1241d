// Events: what happened, newest first.

import { $, element } from "../dom.js";
import { describe, subscribeToEvents, when } from "../events.js";

const SHOWN = 60;

export function start() {
  subscribeToEvents((fresh) => {
    $("log-note").hidden = true;
    for (const event of fresh.slice(-SHOWN)) {
      $("log").prepend(element("li", { value: event.seq, textContent: `${when(event.time)} ${describe(event)}` }));
    }
    while ($("log").children.length > SHOWN) $("log").lastChild.remove();
  });
}
