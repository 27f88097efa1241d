// Moves the scene's camera as if its own keys were held. The events have no key, so no other part of the page takes them.

import { $ } from "./dom.js";

/** @type {Map<string, Set<string>>} */
const asked = new Map(); // who asks → the keys that it wants held
let held = new Set();

// Whether the operator is at this page, or in its scene: nothing else moves a view.
export const isAtThePage = () => document.hasFocus() || document.activeElement === $("scene");

export function holdCamera(who, keys) {
  asked.set(who, keys);
  const wanted = new Set([...asked.values()].flatMap((one) => [...one]));
  const inside = $("scene").contentDocument;
  const tell = (type, code) => inside?.dispatchEvent(new KeyboardEvent(type, { code, bubbles: true }));
  for (const code of held) if (!wanted.has(code)) tell("keyup", code);
  for (const code of wanted) if (!held.has(code)) tell("keydown", code);
  held = wanted;
}
