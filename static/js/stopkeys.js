// The keys that ask for a stop, and the keyboard wherever it is: heard in each frame of the page, before anything else.

import * as texts from "./texts/page.js";
import * as shared from "./texts/shared.js";

export const STOPS = [["Ctrl+.", shared.stopRequest], [texts.escapeTwice, shared.stopRequest]];

const TWICE = 700; // ms between two presses of Escape
const LOOK_PERIOD = 1000; // ms

let lastEscape = -Infinity;

// Some layouts have no "." on its key, and while a word is being composed each key is "Process".
const isPeriod = ({ key, code }) => key === "." || (code === "Period" && !/^[ -~]$/.test(key));
export const isEscape = ({ key, code }) => key === "Escape" || (key === "Process" && code === "Escape");

// Whether a keydown asks for a stop. Its own moment counts, by the clock of all frames: a busy page hears late.
export function asksToStop(event) {
  if (!isEscape(event)) return (event.ctrlKey || event.metaKey) && isPeriod(event);
  const now = event.timeStamp + (event.view ?? window).performance.timeOrigin;
  const twice = now - lastEscape < TWICE;
  lastEscape = now;
  return twice;
}

// listener hears each keydown in the page and its frames. To listen once more changes nothing: frames are looked at anew
// whenever one has loaded, goes, or takes the focus, and now and then.
export function hearEverywhere(listener) {
  const soon = () => setTimeout(look);
  const look = () => hear(window);
  function hear(view) {
    view.addEventListener("keydown", listener, true);
    view.addEventListener("blur", soon); // focus may have gone into a frame
    view.addEventListener("pagehide", soon); // what comes in its place is another document
    for (const frame of view.document.querySelectorAll("iframe, frame, object, embed")) hearIn(frame);
  }
  function hearIn(frame) {
    frame.addEventListener("load", soon);
    try {
      if (frame.contentWindow) hear(frame.contentWindow);
    } catch {
      release(frame); // of another origin, or the browser's own page in place of what failed
    }
  }
  look();
  setInterval(look, LOOK_PERIOD);
}

// A frame that can't be listened to must not keep the keyboard.
function release(frame) {
  if (frame.ownerDocument.activeElement !== frame) return;
  frame.blur();
  window.focus();
}
