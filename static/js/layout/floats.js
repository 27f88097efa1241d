// Areas that float over the scene: moved and resized by the mouse at heading and corner, or by the arrow keys. They stay
// inside the scene, below the legs' bar: nothing beside the scene is ever covered.

import { $, element } from "../dom.js";
import { heardFirst } from "../keys.js";
import { isEscape } from "../stopkeys.js";
import * as texts from "../texts/layout.js";
import { change, placed } from "./kept.js";
import { fitted, moved, stretched } from "./room.js";

const GAP = 8; // px
const STEP = 16; // px for each press of a key
const ARROWS = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, -STEP], ArrowDown: [0, STEP] };
const SIZE = { width: 430, height: 300 };

/** @type {{panel: HTMLElement, grip: HTMLElement, name: string, box: object} | null} what the keys move, and where it is */
let inKeys = null;

export const scene = () => /** @type {HTMLElement} */ (document.querySelector(".scene"));
export const isMoved = (name) => inKeys?.name === name;

function room() {
  const top = $("legs").offsetTop + $("legs").offsetHeight + GAP;
  return { left: GAP, top, width: Math.max(0, scene().clientWidth - 2 * GAP), height: Math.max(0, scene().clientHeight - top - GAP) };
}

// Where an area floats first: at the right end, each a little lower than the one before.
export function firstBox() {
  const others = Object.values(placed()).filter((one) => one?.at === "scene").length;
  return fitted({ left: Infinity, top: room().top + others * 3 * STEP, ...SIZE }, room());
}

// All of the scene that nothing else takes.
export const wholeRoom = () => ({ ...room() });

export function draw(panel, box) {
  const { left, top, width, height } = fitted(box, room());
  Object.assign(panel.style, { left: `${left}px`, top: `${top}px`, width: `${width}px`, height: `${height}px` });
}

const keep = (name, box) => change({ placed: { ...placed(), [name]: { at: "scene", ...fitted(box, room()) } } });

// redraw: what shows the layout anew.
export function makeMovable(panel, name, title, redraw) {
  const grip = element("button", { type: "button", className: "grip", textContent: "✥", title: texts.move(title), ariaLabel: texts.move(title) });
  grip.setAttribute("aria-pressed", "false");
  grip.addEventListener("click", () => (inKeys ? settle(redraw) : take(panel, grip, name, redraw)));
  grip.addEventListener("blur", () => settle(redraw));
  const corner = element("span", { className: "corner", ariaHidden: "true" });
  byMouse(panel.querySelector("h2"), panel, name, moved, redraw);
  byMouse(corner, panel, name, stretched, redraw);
  panel.append(corner);
  return grip;
}

function byMouse(handle, panel, name, by, redraw) {
  handle.addEventListener("pointerdown", (down) => {
    const begin = placed()[name];
    if (begin?.at !== "scene" || down.button !== 0) return;
    down.preventDefault();
    handle.setPointerCapture(down.pointerId); // also over the scene's frame
    const now = (event) => by(begin, [event.clientX - down.clientX, event.clientY - down.clientY]);
    const move = (event) => draw(panel, now(event));
    const up = (event) => keep(name, now(event));
    const end = () => {
      handle.removeEventListener("pointermove", move);
      handle.removeEventListener("pointerup", up);
      redraw();
    };
    handle.addEventListener("pointermove", move);
    handle.addEventListener("pointerup", up);
    handle.addEventListener("lostpointercapture", end, { once: true }); // after it, or where it was broken off
  });
}

// -- by keys ---------------------------------------------------------------------------------------

export function listen(redraw) {
  heardFirst((event) => {
    if (!inKeys) return false;
    if (event.key === "Enter") settle(redraw);
    else if (isEscape(event)) release(redraw); // where it was
    else if (event.key in ARROWS) push(ARROWS[event.key], event.shiftKey);
    else return false;
    return true;
  });
}

function take(panel, grip, name, redraw) {
  inKeys = { panel, grip, name, box: fitted(placed()[name], room()) };
  grip.setAttribute("aria-pressed", "true");
  redraw();
}

function push(by, sized) {
  inKeys.box = fitted((sized ? stretched : moved)(inKeys.box, by), room());
  draw(inKeys.panel, inKeys.box);
}

function release(redraw) {
  inKeys.grip.setAttribute("aria-pressed", "false");
  inKeys = null;
  redraw();
}

function settle(redraw) {
  if (!inKeys) return;
  keep(inKeys.name, inKeys.box);
  release(redraw);
}
