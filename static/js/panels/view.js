// What the scene shows beside rover and ground, and where it is looked at from: this page's.

import { act } from "../acts.js";
import { put } from "../api.js";
import { $, attempt, element } from "../dom.js";
import { lacking } from "../rights.js";
import { changed, known, subscribe } from "../store.js";
import { refresh } from "../stream.js";
import * as texts from "../texts/scene.js";

const { LOOKS, SWITCHES } = texts;
const KEYS = { tape: "Z" };

const asked = new Map(); // switch → as it was set here, while that is on its way

export function start() {
  $("view-looks").append(...Object.entries(LOOKS).map(([look, text]) => element("button", { type: "button", id: `look-${look}`, textContent: text })));
  for (const [look, text] of Object.entries(LOOKS)) act({ text: texts.look(text.toLowerCase()), button: `look-${look}`, run: () => change({ look }) });
  for (const [name, text] of Object.entries(SWITCHES)) {
    const box = element("input", { type: "checkbox", id: `shown-${name}`, onchange: () => set(name, box.checked) });
    $("view-shown").append(element("label", {}, box, text));
    act({ key: KEYS[name] ?? "", text: texts.onOrOff(text), run: () => set(name, !isOn(name)), refusal: () => lacking(box) });
  }
  $("view-opacity").addEventListener("input", sendOpacity);
  act({ key: "-", text: texts.whatItShows, run: toggle });
  subscribe(draw);
}

const change = (view) => attempt(() => put("/sessions/current/view", view));

// What is drawn before the server has answered must not take the switch back under the operator's hand.
const set = (name, on) => attempt(async () => {
  asked.set(name, on);
  try {
    // a tape that is put away is empty when it is taken out again
    await put("/sessions/current/view", { shown: { [name]: on }, ...(name === "tape" ? { tape: [] } : {}) });
    await refresh();
  } finally {
    if (asked.get(name) === on) asked.delete(name);
    changed();
  }
});

const isOn = (name) => asked.get(name) ?? known.summary.view.shown[name];

// Only the newest is sent while one is under way: an older one that arrives later would win.
let fading = false;
async function sendOpacity() {
  readOpacity();
  if (fading) return;
  fading = true;
  for (let sent = NaN, wanted = opacity(); sent !== wanted; sent = wanted, wanted = opacity()) await change({ opacity: wanted });
  fading = false;
}

const opacity = () => Number($("view-opacity").value) / 100;
const readOpacity = () => { $("view-opacity-read").textContent = texts.opacity($("view-opacity").value); };

function toggle() {
  $("view").open = !$("view").open;
  if ($("view").open) $("view").querySelector("summary").focus();
}

function draw({ summary }) {
  if (!summary) return;
  const { look, tape } = summary.view;
  for (const name of Object.keys(SWITCHES)) {
    const box = $(`shown-${name}`);
    box.checked = isOn(name);
    box.disabled = Boolean(lacking(box));
    box.title = lacking(box);
  }
  for (const name of Object.keys(LOOKS)) $(`look-${name}`).setAttribute("aria-pressed", String(look === name));
  if (!fading && document.activeElement !== $("view-opacity")) {
    $("view-opacity").value = String(Math.round(100 * summary.view.opacity));
    readOpacity();
  }
  $("view-tape").hidden = !isOn("tape");
  $("view-tape").textContent = measured(tape);
}

function measured(points) {
  if (points.length < 2) return points.length ? texts.otherEnd : texts.twoPoints;
  const [x, y, z] = [0, 1, 2].map((i) => points[1][i] - points[0][i]);
  return texts.measured(Math.hypot(x, y, z), Math.hypot(x, y), z);
}
