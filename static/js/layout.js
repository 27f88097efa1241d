// Which work areas are in sight, and where: named layouts, each remembered as the operator leaves it. An area is a card at the
// side, docked below the scene, or floats over it. And which theme is worn.

import { act } from "./acts.js";
import { $, element } from "./dom.js";
import * as cards from "./layout/cards.js";
import * as floats from "./layout/floats.js";
import * as kept from "./layout/kept.js";
import { stateOf } from "./layout/states.js";
import { changed, subscribe } from "./store.js";
import * as texts from "./texts/layout.js";
import * as page from "./texts/page.js";
import { THEMES, theme, wear } from "./themes.js";

/** @type {{name: string, title: string, panel: HTMLElement, home: string, tools: Record<string, HTMLElement>}[]} as the page has them */
let areas = [];

export const isShown = (name) => kept.shown().includes(name) && cards.isOpen(name);

export function startLayout() {
  kept.recall();
  $("layout").append(...Object.keys(kept.LAYOUTS).map((name) => element("option", { value: name, textContent: name })));
  $("layout").addEventListener("change", () => choose($("layout").value));
  areas = [...document.querySelectorAll(".panel")].map(areaOf);
  for (const [name, { key }] of Object.entries(kept.LAYOUTS)) act({ key, text: texts.layout(name), run: () => choose(name) });
  act({ text: texts.layoutAsDelivered, run: () => { cards.forget(); kept.deliver(); redraw(); } });
  act({ text: texts.undoLayout, run: () => { kept.undo(); redraw(); }, refusal: () => (kept.canUndo() ? "" : texts.nothingChanged) });
  act({ key: "F6", text: texts.nextArea, run: next });
  floats.listen(redraw);
  new ResizeObserver(draw).observe(floats.scene()); // what floats stays inside
  subscribe(drawStates);
  startThemes();
  draw();
}

// -- one area --------------------------------------------------------------------------------------

function areaOf(panel) {
  const name = panel.id.replace("panel-", "");
  const heading = panel.querySelector("h2");
  const title = heading.lastChild.textContent.trim();
  const area = { name, title, panel, home: panel.parentElement.id, tools: {} };
  const button = element("button", { type: "button", id: `area-${name}`, textContent: title, onclick: () => { cards.openForGood(name); reveal(name); } });
  button.setAttribute("aria-controls", panel.id);
  $("area-buttons").append(button);
  act({ text: texts.goTo(title), run: () => reveal(name) });
  heading.tabIndex = -1;
  heading.addEventListener("click", () => { if (!cards.isOpen(name)) fold(area); });
  area.tools = {
    grip: floats.makeMovable(panel, name, title, redraw),
    fold: tool("fold", "", "", () => fold(area)),
    float: tool("float", "❐", texts.float(title), () => put(area, isAt(area, "scene") ? area.home : "scene")),
    dock: tool("to-dock", "⤓", texts.dock(title), () => put(area, isAt(area, "dock") ? "side" : "dock")),
    hide: tool("hide", "–", texts.hide(title), () => conceal(name)),
  };
  area.tools.fold.setAttribute("aria-controls", panel.id);
  const tools = element("div", { className: "tools" }, ...Object.values(area.tools));
  tools.dataset.needs = "viewer"; // who may do nothing else may still look where it suits
  heading.after(tools, element("p", { className: "state", hidden: true }));
  return area;
}

const tool = (className, textContent, title, onclick) => element("button", { type: "button", className, textContent, title, ariaLabel: title, onclick });

const placeOf = ({ name, home }) => kept.placed()[name]?.at ?? home;
const isAt = (area, place) => placeOf(area) === place;

function fold({ name }) {
  if (cards.isOpen(name)) cards.close(name);
  else cards.openForGood(name);
  redraw();
}

function put({ name, home }, place) {
  if (place === "scene") cards.openForGood(name);
  const at = place === "scene" ? { at: place, ...floats.firstBox() } : { at: place };
  kept.change({ placed: { ...kept.placed(), [name]: place === home ? undefined : at } });
  redraw();
}

// Over the whole scene, or back to where it belongs.
export function enlarge(name) {
  reveal(name);
  const isLarge = placeOf(areas.find((area) => area.name === name)) === "scene";
  kept.change({ placed: { ...kept.placed(), [name]: isLarge ? undefined : { at: "scene", ...floats.wholeRoom() } } });
  redraw();
}

// -- themes ----------------------------------------------------------------------------------------

function startThemes() {
  $("theme").append(...THEMES.map((name) => element("option", { value: name, textContent: name })));
  $("theme").addEventListener("change", () => dress($("theme").value));
  for (const name of THEMES) act({ text: page.theme(name), run: () => dress(name) });
  $("theme").value = theme();
}

function dress(name) {
  wear(name);
  $("theme").value = name;
}

// -- what is in sight ------------------------------------------------------------------------------

function choose(name) {
  cards.forget();
  kept.choose(name);
  redraw();
}

// Opens the card of an area, in sight or not; focus stays where it is.
export function unfold(name) {
  if (cards.isOpen(name)) return;
  cards.open(name);
  queueMicrotask(redraw); // panels may be drawing
}

// Brings an area into sight, wherever it was, and focus with it.
export function reveal(name) {
  cards.open(name);
  if (!kept.shown().includes(name)) kept.change({ shown: [...kept.shown(), name] });
  redraw();
  focus(areas.find((area) => area.name === name));
}

function focus(area) {
  if (!isAt(area, "scene")) area.panel.scrollIntoView({ block: "start" });
  area.panel.querySelector("h2").focus({ preventScroll: true });
}

function conceal(name) {
  kept.change({ shown: kept.shown().filter((one) => one !== name) });
  redraw();
  $(`area-${name}`).focus();
}

function next() {
  const inSight = [...document.querySelectorAll(".panel:not([hidden])")];
  const at = inSight.findIndex((panel) => panel.contains(document.activeElement));
  if (inSight.length) focus(areas.find(({ panel }) => panel === inSight[(at + 1) % inSight.length]));
}

// What comes next is done by that button: where the layout follows, the card that holds it opens.
export function goWithJob(button) {
  const area = areas.find(({ panel }) => panel.contains($(button)));
  if (!area || area.panel.hidden || !cards.goWithJob(button, area.name, isInHand)) return;
  queueMicrotask(() => { // not while panels draw
    redraw();
    if (!$("side").matches(":hover")) bringIn(area.panel);
  });
}

// Scrolls the side alone, so far that a panel in it begins in sight.
function bringIn(panel) {
  const [side, box] = [$("side"), panel.getBoundingClientRect()];
  const { top, bottom } = side.getBoundingClientRect();
  if (side.contains(panel) && (box.top < top || box.bottom > bottom)) side.scrollTop += box.top - top;
}

function isInHand(name) {
  const { panel } = areas.find((area) => area.name === name);
  return panel.matches(":hover") || panel.contains(document.activeElement);
}

function redraw() {
  draw();
  changed(); // panels that were out of sight draw what they hold
}

function draw() {
  $("layout").value = document.body.dataset.layout = kept.chosen();
  const focused = document.activeElement;
  for (const area of areas) drawArea(area);
  if (focused instanceof HTMLElement && focused !== document.activeElement) focused.focus({ preventScroll: true }); // what is put elsewhere loses it
  for (const place of ["side", "dock"]) $(place).hidden = !areas.some((area) => !area.panel.hidden && isAt(area, place));
  const numbers = areas.flatMap(({ panel }) => (panel.hidden ? [] : [...panel.querySelectorAll("h2 > span")]));
  numbers.forEach((number, i) => { number.textContent = String(i + 1); });
  drawStates();
}

function drawArea(area) {
  const { name, title, panel, tools } = area;
  const isOpen = cards.isOpen(name);
  const floating = isAt(area, "scene");
  panel.hidden = !kept.shown().includes(name);
  settle(area);
  panel.classList.toggle("closed", !isOpen);
  panel.classList.toggle("afloat", floating);
  $(`area-${name}`).setAttribute("aria-expanded", String(!panel.hidden));
  const told = isOpen ? texts.close(title) : texts.open(title);
  Object.assign(tools.fold, { textContent: isOpen ? "▾" : "▸", title: told, ariaLabel: told });
  tools.fold.setAttribute("aria-expanded", String(isOpen));
  tools.float.setAttribute("aria-pressed", String(floating));
  tools.dock.setAttribute("aria-pressed", String(isAt(area, "dock")));
  tools.grip.hidden = !floating;
  if (floating && !panel.hidden) floats.draw(panel, kept.placed()[name]);
  else panel.removeAttribute("style");
}

// Where it belongs, in the page's order.
function settle(area) {
  const place = placeOf(area) === "scene" ? floats.scene() : $(placeOf(area));
  if (area.panel.parentElement === place) return;
  const after = areas.slice(areas.indexOf(area) + 1).find(({ panel }) => panel.parentElement === place);
  place.insertBefore(area.panel, after?.panel ?? null);
}

function drawStates() {
  for (const { name, panel } of areas) {
    const state = /** @type {HTMLElement} */ (panel.querySelector(":scope > .state"));
    const text = floats.isMoved(name) ? texts.moving : cards.isOpen(name) ? "" : stateOf(name);
    state.hidden = !text;
    if (state.textContent !== text) state.textContent = text;
  }
}
