// The command palette: every act by its name, with its key, or with the reason why it can't be done now.

import { listed, perform, told } from "./acts.js";
import { $, element } from "./dom.js";

const SHOWN = 12;

let found = [];
let chosen = 0;
let back = null; // where focus was

export function startPalette() {
  $("palette-input").addEventListener("input", () => { chosen = 0; draw(); });
  $("palette-input").addEventListener("keydown", (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step && found.length) {
      event.preventDefault();
      chosen = (chosen + step + found.length) % found.length;
      draw();
    } else if (event.key === "Enter") {
      event.preventDefault();
      take(found[chosen]);
    } else if (event.key === "Tab") $("palette").close();
  });
  $("palette").addEventListener("close", () => back?.focus?.());
}

export function openPalette() {
  if ($("palette").open) return;
  back = document.activeElement;
  $("palette-input").value = "";
  chosen = 0;
  $("palette").show(); // not modal: stop stays in reach
  $("palette-input").focus();
  draw();
}

function take(one) {
  if (!one || one.refusal()) return; // the list says why
  $("palette").close();
  perform(one);
}

// How well the typed letters fit a name, in their order; lower is better, null where they don't.
export function fit(typed, name) {
  const text = name.toLowerCase();
  let at = -1;
  let score = 0;
  for (const letter of typed.toLowerCase().replaceAll(" ", "")) {
    const next = text.indexOf(letter, at + 1);
    if (next < 0) return null;
    const begins = next === 0 || text[next - 1] === " ";
    score += begins ? 0 : next - at - 1;
    at = next;
  }
  return score + text.length / 1000;
}

function draw() {
  const typed = $("palette-input").value;
  const named = listed().filter((one, i, all) => !one.quiet && all.findIndex(({ text }) => text === one.text) === i);
  // of what fits alike, what can be done comes first
  found = named.map((one) => [fit(typed, one.text), one]).filter(([score]) => score !== null)
    .map(([score, one]) => [score + (one.refusal() ? 0.5 : 0), one])
    .sort(([a], [b]) => a - b).slice(0, SHOWN).map(([, one]) => one);
  $("palette-list").replaceChildren(...found.map((one, i) => {
    const against = one.refusal();
    return element("li", { id: `palette-${i}`, role: "option", ariaSelected: String(i === chosen), ariaDisabled: String(Boolean(against)), onclick: () => take(one) },
      element("span", { textContent: one.text }),
      against ? element("small", { textContent: `✕ ${against}` }) : null,
      one.key ? element("kbd", { textContent: told(one.key) }) : null);
  }));
  if (found.length) $("palette-input").setAttribute("aria-activedescendant", `palette-${chosen}`);
  else $("palette-input").removeAttribute("aria-activedescendant");
  $("palette-note").textContent = found.length ? "" : "No act has such a name.";
  $(`palette-${chosen}`)?.scrollIntoView({ block: "nearest" });
}
