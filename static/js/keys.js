// One keymap for the whole page. Stop works wherever focus is, inside dialogs and fields too.

import { act, actOfKey, listed, perform, told } from "./acts.js";
import { $, element } from "./dom.js";
import { openPalette } from "./palette.js";
import { STOPS, asksToStop, hearEverywhere, isEscape } from "./stopkeys.js";
import * as texts from "./texts/page.js";
import * as shared from "./texts/shared.js";

const REPEATING = ["[", "]", ",", "."];
const CAMERA_KEYS = ["W", "A", "S", "D", "Q", "E"]; // as viser has them

const explained = []; // keys that a part of the page hears itself, for the list
const first = []; // who hears keys before the keymap does

export const explainKey = (key, text) => explained.push([key, text]);

// listener: (event) → whether the key was its. Not asked about keys for fields, dialogs and stop.
export const heardFirst = (listener) => first.push(listener);

function isTaken(event) {
  if (!first.some((listener) => listener(event))) return false;
  event.preventDefault();
  event.stopPropagation(); // the scene's camera does not hear it
  return true;
}

export function listenForKeys(stop) {
  act({ text: shared.stopRequest, run: stop });
  act({ key: "?", text: texts.listOfKeys, run: showHelp, button: "open-help" });
  act({ key: "Ctrl+K", text: texts.findAct, run: openPalette, button: "open-palette" });
  act({ key: ":", text: texts.findAct, run: openPalette });
  const heard = (event) => {
    if (event.key.length > 1 || event.ctrlKey || event.metaKey) typedIn = null; // as Enter: what was typed is over
    const stopping = asksToStop(event);
    if (stopping) stop();
    if (stopping && !isEscape(event)) {
      event.preventDefault();
      return;
    }
    if (isEscape(event)) {
      /** @type {NodeListOf<HTMLDialogElement>} */
      const open = document.querySelectorAll("dialog[open]");
      for (const dialog of open) dialog.close();
      if (!open.length) isTaken(event);
      return;
    }
    const typing = event.target.isContentEditable
      || event.target.closest?.("input:not([type=range]):not([type=checkbox]):not([type=radio]), select, textarea");
    const graph = event.getModifierState("AltGraph"); // Windows tells it as Ctrl and Alt: it types characters as Shift does
    if ((event.ctrlKey || event.metaKey) && !graph) {
      const asked = `Ctrl+${event.shiftKey ? "Shift+" : ""}${event.key.toUpperCase()}`;
      const key = asked === "Ctrl+Shift+Z" ? "Ctrl+Y" : asked; // as other programs have it, and those of a Mac alone
      // a field's own undo stays its own
      if (!typing || key === "Ctrl+K") press(event, key);
      return;
    }
    if (event.key === "F6") {
      press(event, "F6");
      return;
    }
    if (typing || (event.altKey && !graph) || document.querySelector("dialog[open]") || isLost(event)) return;
    if (isTaken(event)) return;
    // on a button, link or box Space and Enter are that one's
    if ([" ", "Enter"].includes(event.key) && event.target.closest?.("button, a, summary, [role=tab], input:not([type=range])")) return;
    // a key that is held down acts once; the scene's own keys move its camera
    if (event.repeat && !REPEATING.includes(event.key)) return;
    if (event.view !== window && CAMERA_KEYS.includes(event.key.toUpperCase())) return;
    press(event, event.key.length === 1 ? event.key.toUpperCase() : event.key);
  };
  hearEverywhere(heard);
}

// The field that was typed in may go under the hands of who types, as where its answer draws a panel anew: what is typed on
// is meant for it, and chooses or plans nothing, until something is pointed at or focused, or another key than a character comes.
let typedIn = null;
for (const type of ["pointerdown", "focusin"]) addEventListener(type, () => { typedIn = null; }, true);
addEventListener("input", ({ target }) => { typedIn = target; }, true);

const isLost = ({ key, target }) => key.length === 1 && target === document.body && typedIn !== null && (!typedIn.isConnected || typedIn.disabled || !typedIn.checkVisibility());

function press(event, key) {
  const found = actOfKey(key);
  if (!found) return;
  event.preventDefault();
  perform(found);
}

function showHelp() {
  const keyed = listed().filter(({ key }) => key).map(({ key, text }) => [told(key), text]);
  $("help-keys").replaceChildren(...[...keyed, ...explained, ...STOPS].map(([key, text]) =>
    element("tr", {}, element("th", { scope: "row" }, element("kbd", { textContent: key })), element("td", { textContent: text }))));
  // Not modal: a modal dialog would put the stop button out of reach.
  $("help").show();
}
