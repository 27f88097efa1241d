// Everything that the operator can do, each once: its name, its key, its button, and what stands against it at the moment.
// Buttons, keys and the palette all go through here.

import { $, toast } from "./dom.js";
import { actWhenHeld } from "./holding.js";
import { lacking } from "./rights.js";
import { notFor } from "./robot.js";
import { subscribe } from "./store.js";
import * as texts from "./texts/page.js";

const acts = [];
const listeners = [];

// text: what it does, for people. key: as keys.js writes them. button: id of its button. refusal: says why it can't be done
// now, "" where it can. quiet: neither key list nor palette needs it twice. held: its button acts when it is held.
export function act({ text, run, key = "", button = "", refusal = () => "", quiet = false, held = false }) {
  const taken = key && acts.find((one) => one.key === key);
  if (taken) throw new Error(texts.keyTaken(key, taken.text));
  const made = { text, key, run, button, refusal: () => lacking($(button)) || notFor($(button)) || refusal(), quiet };
  acts.push(made);
  if (button) wire($(button), made, held);
  listeners.forEach((listener) => listener());
  return made;
}

function wire(button, made, held) {
  const about = button.title || made.text;
  if (held) actWhenHeld(button, () => perform(made));
  else button.addEventListener("click", () => perform(made));
  const draw = () => {
    const against = made.refusal();
    button.disabled = Boolean(against);
    button.title = against || (made.key ? `${about} (${told(made.key)})` : about);
  };
  if (made.key) button.setAttribute("aria-keyshortcuts", made.key === " " ? texts.space : made.key.replace("Ctrl", "Control"));
  subscribe(draw);
  draw();
}

// What can't be done is said with its reason, whichever way it was asked for.
export function perform(made) {
  const against = made.refusal();
  if (against) toast(texts.against(made.text, against));
  else made.run();
}

export const listed = () => acts;

export const actOfKey = (key) => acts.find((one) => one.key === key);

export const actOfButton = (button) => acts.find((one) => one.button === button);

export const told = (key) => (key === " " ? texts.space : key);
