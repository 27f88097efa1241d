// One keymap for the whole page. Stop works wherever focus is, inside dialogs and fields too.

import { $, element } from "./dom.js";

const REPEATING = ["[", "]"];
const CAMERA_KEYS = ["W", "A", "S", "D", "Q", "E"]; // as viser has them

const bindings = [];
let lastEscape = 0;

export function bind(key, text, act) {
  bindings.push({ key, text, act });
}

export function listenForKeys(stop) {
  const heard = (event) => {
    if ((event.ctrlKey || event.metaKey) && event.key === ".") {
      event.preventDefault();
      stop();
      return;
    }
    if (event.key === "Escape") {
      const now = performance.now();
      if (now - lastEscape < 700) stop();
      lastEscape = now;
      return;
    }
    const typing = event.target.closest?.("input:not([type=range]):not([type=checkbox]), select, textarea");
    if (event.ctrlKey || event.metaKey) {
      if (event.key.toLowerCase() === "z" && !typing) press(event, "Ctrl+Z");
      return;
    }
    if (typing || event.altKey || $("help").open) return;
    // a key that is held down acts once; the scene's own keys move its camera
    if (event.repeat && !REPEATING.includes(event.key)) return;
    if (event.view !== window && CAMERA_KEYS.includes(event.key.toUpperCase())) return;
    press(event, event.key.length === 1 ? event.key.toUpperCase() : event.key);
  };
  window.addEventListener("keydown", heard, true);
  // The scene is a same-origin frame: keys pressed there count too.
  $("scene").addEventListener("load", () => {
    try {
      $("scene").contentWindow.addEventListener("keydown", heard, true);
    } catch { /* about:blank or a frame that failed to load has no keys */ }
  });
}

function press(event, key) {
  const found = bindings.find((binding) => binding.key === key);
  if (!found) return;
  event.preventDefault();
  found.act();
}

export function showHelp() {
  const rows = [...bindings, { key: "Ctrl+.", text: "Stop request" }, { key: "Esc Esc", text: "Stop request" }];
  $("help-keys").replaceChildren(
    ...rows.map(({ key, text }) => element("tr", {}, element("th", { textContent: key === " " ? "Space" : key }), element("td", { textContent: text }))),
  );
  // Not modal: a modal dialog would put the stop button out of reach.
  $("help").show();
}
