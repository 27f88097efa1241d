// The scene in its frame. It may be switched off, fail, or die: the rest of the page does not need it, and says so.

import { act } from "./acts.js";
import { PAGE, Problem, get } from "./api.js";
import { $, element } from "./dom.js";
import { clock } from "./events.js";
import { alive, silent, subscribe } from "./store.js";
import * as texts from "./texts/scene.js";
import { WORN, theme } from "./themes.js";

// What goes on without the scene goes on only while the server does.
const goesOn = () => (alive() ? texts.goesOn : silence());
const silence = () => texts.silence(silent());
const LOOK_PERIOD = 20000; // ms
const RETURN_PERIOD = 5000; // ms, while it is gone

// viser's own panel (floating, or docked in a narrow frame) and notices are hidden: the page has its own, and they would
// cover the ground.
const STYLE = "[data-floating-window], .mantine-Notifications-root, .mantine-Paper-root:has(.mantine-ScrollArea-root) { display: none !important; }";

let wanted = true;
let gone = false; // its server, as far as is known
let lookedAt = 0;
let answeredAt = 0; // ms since 1970
let said = { text: texts.loading, failed: false, lasts: false }; // of the scene itself; what goes on is added when it is drawn

export function startScene() {
  const frame = $("scene");
  wanted = new URLSearchParams(location.search).get("scene") !== "off";
  frame.addEventListener("load", loaded);
  act({ text: texts.loadAgain, button: "scene-again", run: load, refusal: () => (wanted ? "" : texts.openedOff) });
  subscribe(() => { draw(); look(); });
  document.addEventListener(WORN, dress);
  new ResizeObserver(fit).observe(frame);
  showFocus(frame);
  frame.tabIndex = wanted ? 0 : -1;
  if (wanted) load();
  else note(texts.off, false, true);
}

// A frame whose page has focus matches no :focus of this one. As elsewhere, only who comes by keyboard is shown it.
function showFocus(frame) {
  let byKey = false;
  addEventListener("keydown", ({ key }) => { byKey = key === "Tab"; }, true);
  for (const type of ["blur", "focus"]) addEventListener(type, () => frame.classList.toggle("focused", byKey && document.activeElement === frame));
}

async function load() {
  note(texts.loading);
  const reason = await unavailable();
  gone = Boolean(reason);
  if (gone) note(texts.notShown(reason), true);
  else {
    await Promise.all([dress(), fit()]);
    $("scene").src = `/scene/?${options()}`;
  }
}

// Its sky, as the page, and how large its frame is: labels have the page's pixels, whatever those of screen and picture are.
// Without an answer the scene keeps what it has: nothing is told by it.
const dress = () => say("theme", { theme: theme() });

async function fit() {
  const { clientWidth: width, clientHeight: height } = $("scene");
  if (width && height) await say("size", { width, height });
}

async function say(what, body) {
  const headers = { "Content-Type": "application/json", "FootFall-Page": PAGE };
  if (wanted) await fetch(`/scene/${what}`, { method: "PUT", headers, body: JSON.stringify(body) }).catch(() => {});
}

// How things were after that event of the session; null: how they are. Throws where the server refuses it.
export async function showMoment(event) {
  const headers = { "Content-Type": "application/json", "FootFall-Page": PAGE };
  const answer = await fetch("/scene/moment", { method: "PUT", headers, body: JSON.stringify({ event }) });
  if (!answer.ok) throw new Problem(answer.status, await answer.json().catch(() => ({})));
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
    if (scene?.available === false) return scene.reason || texts.noScene;
    return (await answers("/scene/")) ? "" : texts.noAnswer;
  } catch (error) {
    return error.message;
  }
}

function loaded() {
  const inside = $("scene").contentDocument;
  if (!inside || inside.URL === "about:blank") return;
  answeredAt = Date.now();
  inside.head.append(element("style", { textContent: STYLE }));
  inside.addEventListener("webglcontextlost", () => note(texts.noGraphics, true), true);
  note("");
}

// The frame can't tell that its server has gone; asking for the page that it shows can. The server opens the scene anew.
async function look() {
  const period = gone ? RETURN_PERIOD : LOOK_PERIOD;
  if (!wanted || (said.text && !gone) || performance.now() - lookedAt < period) return;
  lookedAt = performance.now();
  const reason = await unavailable();
  if (!reason) {
    answeredAt = Date.now();
    if (gone) await load();
  } else if (!said.text) {
    gone = true;
    note(texts.gone(clock(answeredAt / 1000)), true);
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

// lasts: whether it stays so, and what goes on is said with it.
function note(text, failed = false, lasts = failed) {
  said = { text, failed, lasts };
  draw();
}

function draw() {
  const { text, failed, lasts } = said;
  const told = lasts ? `${text} ${goesOn()}` : alive() ? text : `${text} ${silence()}`.trim();
  if ($("scene-note").textContent !== told) $("scene-note").textContent = told;
  $("scene-note").hidden = !told;
  $("scene-note").className = failed || !alive() ? "doubt" : "";
  $("scene-again").hidden = !failed;
  $("scene").classList.toggle("past", failed || !alive()); // what is left of its picture is not how things are
}
