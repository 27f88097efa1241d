// Which work areas are in sight: named layouts, each remembered as the operator leaves it; and which theme is worn.

import { act } from "./acts.js";
import { $, element } from "./dom.js";
import { changed } from "./store.js";
import * as texts from "./texts/page.js";
import { THEMES, theme, wear } from "./themes.js";

const KEPT_AS = "footfall.layout";
const LAYOUTS = {
  [texts.planAStep]: { key: "7", shown: ["ground", "footfall", "plan", "execution", "commands"] },
  execute: { key: "8", shown: ["legs", "telemetry", "commands"] },
  plots: { key: "", shown: ["plots"] },
  review: { key: "9", shown: ["legs", "telemetry", "sessions", "record"] },
};

let kept = { chosen: texts.planAStep, shown: {} }; // shown: layout → names of panels, where they differ from the delivered

/** @returns {HTMLElement[]} */
const panels = () => [...document.querySelectorAll(".panel")].map((panel) => /** @type {HTMLElement} */ (panel));
const nameOf = (panel) => panel.id.replace("panel-", "");
const titleOf = (panel) => panel.querySelector("h2").lastChild.textContent.trim();
const shown = () => kept.shown[kept.chosen] ?? LAYOUTS[kept.chosen].shown;
export const isShown = (name) => shown().includes(name);

export function startLayout() {
  try {
    const found = JSON.parse(localStorage.getItem(KEPT_AS));
    if (found?.chosen in LAYOUTS && typeof found.shown === "object") kept = found;
  } catch { /* a layout that can't be read is no loss */ }
  $("layout").append(...Object.keys(LAYOUTS).map((name) => element("option", { value: name, textContent: name })));
  $("layout").addEventListener("change", () => choose($("layout").value));
  for (const panel of panels()) {
    const [name, title] = [nameOf(panel), titleOf(panel)];
    const button = element("button", { type: "button", id: `area-${name}`, textContent: title, onclick: () => reveal(name) });
    button.setAttribute("aria-controls", panel.id);
    $("area-buttons").append(button);
    const heading = panel.querySelector("h2");
    heading.tabIndex = -1;
    const hide = element("button", { type: "button", className: "hide", textContent: "–", title: texts.hide(title), onclick: () => conceal(name) });
    hide.setAttribute("aria-label", texts.hide(title));
    heading.after(hide);
    act({ text: texts.goTo(title), run: () => reveal(name) });
  }
  for (const [name, { key }] of Object.entries(LAYOUTS)) act({ key, text: texts.layout(name), run: () => choose(name) });
  act({ text: texts.layoutAsDelivered, run: restore });
  act({ key: "F6", text: texts.nextArea, run: next });
  startThemes();
  draw();
}

function startThemes() {
  $("theme").append(...THEMES.map((name) => element("option", { value: name, textContent: name })));
  $("theme").addEventListener("change", () => dress($("theme").value));
  for (const name of THEMES) act({ text: texts.theme(name), run: () => dress(name) });
  $("theme").value = theme();
}

function dress(name) {
  wear(name);
  $("theme").value = name;
}

function keep(names) {
  kept.shown[kept.chosen] = names;
  save();
}

function save() {
  try {
    localStorage.setItem(KEPT_AS, JSON.stringify(kept));
  } catch { /* without storage the layout lasts as long as the page */ }
  draw();
  changed(); // panels that were out of sight draw what they hold
}

function choose(name) {
  kept.chosen = name;
  save();
}

function restore() {
  delete kept.shown[kept.chosen];
  save();
}

// Brings a panel into sight, wherever it was, and focus with it.
export function reveal(name) {
  if (!isShown(name)) keep([...shown(), name]);
  const panel = $(`panel-${name}`);
  panel.scrollIntoView({ block: "start" });
  panel.querySelector("h2").focus({ preventScroll: true });
}

function conceal(name) {
  keep(shown().filter((one) => one !== name));
  $(`area-${name}`).focus();
}

function next() {
  const inSight = panels().filter((panel) => !panel.hidden);
  const at = inSight.findIndex((panel) => panel.contains(document.activeElement));
  if (inSight.length) reveal(nameOf(inSight[(at + 1) % inSight.length]));
}

function draw() {
  $("layout").value = kept.chosen;
  for (const panel of panels()) {
    panel.hidden = !isShown(nameOf(panel));
    $(`area-${nameOf(panel)}`).setAttribute("aria-expanded", String(!panel.hidden));
  }
  $("side").hidden = panels().every((panel) => panel.hidden || !$("side").contains(panel));
  $("dock").hidden = panels().every((panel) => panel.hidden || !$("dock").contains(panel));
}
