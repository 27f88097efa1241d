// The command palette: every act by its name, with its key, or with the reason why it can't be done now.

import { listed, perform, told } from "./acts.js";
import { $, element } from "./dom.js";
import { ranked } from "./ranking.js";
import * as texts from "./texts/page.js";

const SHOWN = 12;
const KEPT_AS = "footfall.uses";

let found = [];
let chosen = 0;
let back = null; // where focus was
let uses = {}; // text of an act → how often it was chosen here

export function startPalette() {
  try {
    uses = JSON.parse(localStorage.getItem(KEPT_AS)) ?? {};
  } catch { /* a count that can't be read is no loss */ }
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
  uses[one.text] = (uses[one.text] ?? 0) + 1;
  try {
    localStorage.setItem(KEPT_AS, JSON.stringify(uses));
  } catch { /* without storage they count as long as the page */ }
  perform(one);
}

function draw() {
  const typed = $("palette-input").value;
  const named = listed().filter((one, i, all) => !one.quiet && all.findIndex(({ text }) => text === one.text) === i);
  found = ranked(typed, named.map((one) => ({ text: one.text, against: one.refusal(), uses: uses[one.text] ?? 0, one })))
    .slice(0, SHOWN).map(({ one }) => one);
  $("palette-list").replaceChildren(...found.map((one, i) => {
    const against = one.refusal();
    return element("li", { id: `palette-${i}`, role: "option", ariaSelected: String(i === chosen), ariaDisabled: String(Boolean(against)), onclick: () => take(one) },
      element("span", { textContent: one.text }),
      against ? element("small", { textContent: `✕ ${against}` }) : null,
      one.key ? element("kbd", { textContent: told(one.key) }) : null);
  }));
  if (found.length) $("palette-input").setAttribute("aria-activedescendant", `palette-${chosen}`);
  else $("palette-input").removeAttribute("aria-activedescendant");
  $("palette-note").textContent = found.length ? "" : texts.noSuchAct;
  $(`palette-${chosen}`)?.scrollIntoView({ block: "nearest" });
}
