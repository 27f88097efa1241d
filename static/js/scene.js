// The scene in its frame. It may be switched off, fail, or die: the rest of the page does not need it, and says so.

import { act } from "./acts.js";
import { PAGE, get } from "./api.js";
import { $, element } from "./dom.js";
import { clock } from "./events.js";
import { subscribe } from "./store.js";

const GOES_ON = "Commands, telemetry and stop go on without it.";
const LOOK_PERIOD = 20000; // ms
const RETURN_PERIOD = 5000; // ms, while it is gone

// viser's own panel (floating, or docked in a narrow frame) and notices are hidden: the page has its own, and they would
// cover the ground.
const STYLE = "[data-floating-window], .mantine-Notifications-root, .mantine-Paper-root:has(.mantine-ScrollArea-root) { display: none !important; }";

let wanted = true;
let gone = false; // its server, as far as is known
let lookedAt = 0;
let answeredAt = 0; // ms since 1970

export function startScene() {
  const frame = $("scene");
  wanted = new URLSearchParams(location.search).get("scene") !== "off";
  frame.addEventListener("load", loaded);
  act({ text: "Load the scene again", button: "scene-again", run: load, refusal: () => (wanted ? "" : "The page was opened with ?scene=off.") });
  subscribe(look);
  if (wanted) load();
  else note(`The scene is off (?scene=off). ${GOES_ON}`);
}

async function load() {
  note("The scene is loading.");
  const reason = await unavailable();
  gone = Boolean(reason);
  if (gone) note(`The scene can't be shown: ${reason}. ${GOES_ON}`, true);
  else $("scene").src = `/scene/?${options()}`;
}

// As viser reads them from its address: those of this page (?fixedDpr=0.5 keeps software rendering bearable), and where
// it connects to. That names this page: what is done in its scene is done by it.
function options() {
  const made = new URLSearchParams(location.search);
  made.set("websocket", `${location.origin.replace(/^http/, "ws")}/scene?page=${PAGE}`);
  return made;
}

async function unavailable() {
  try {
    const { scene } = await get("/info");
    if (scene?.available === false) return scene.reason || "the server has none";
    return (await answers("/scene/")) ? "" : "it does not answer";
  } catch (error) {
    return error.message;
  }
}

function loaded() {
  const inside = $("scene").contentDocument;
  if (!inside || inside.URL === "about:blank") return;
  answeredAt = Date.now();
  inside.head.append(element("style", { textContent: STYLE }));
  inside.addEventListener("webglcontextlost", () => note(`The scene has lost its graphics. ${GOES_ON}`, true), true);
  note("");
}

// The frame can't tell that its server has gone; asking for the page that it shows can. The server opens the scene anew.
async function look() {
  const period = gone ? RETURN_PERIOD : LOOK_PERIOD;
  if (!wanted || ($("scene-note").textContent && !gone) || performance.now() - lookedAt < period) return;
  lookedAt = performance.now();
  const reason = await unavailable();
  if (!reason) {
    answeredAt = Date.now();
    if (gone) await load();
  } else if (!$("scene-note").textContent) {
    gone = true;
    note(`The scene does not answer any more: its picture is of ${clock(answeredAt / 1000)} UTC, or a little later. ${GOES_ON}`, true);
  }
}

// The page behind an address is large: its head is enough.
async function answers(address) {
  const end = new AbortController();
  try {
    return (await fetch(address, { signal: end.signal })).ok;
  } catch {
    return false;
  } finally {
    end.abort();
  }
}

function note(text, failed = false) {
  $("scene-note").textContent = text;
  $("scene-note").hidden = !text;
  $("scene-note").className = failed ? "doubt" : "";
  $("scene-again").hidden = !failed;
  $("scene").classList.toggle("past", failed); // what is left of its picture is not how things are
}
