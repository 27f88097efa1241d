// A button that acts when it is held long enough to be meant, by pointer, touch, Enter or Space. Let go early: nothing.

import { toast } from "./dom.js";
import * as texts from "./texts/page.js";

export const HOLD = 800; // ms

// run: called once when it was held. Nothing moves meanwhile: the button must not slip away under the pointer.
export function actWhenHeld(button, run) {
  let waiting = 0; // the timer while it is held
  let key = ""; // that holds it
  const begin = (by) => {
    if (waiting || button.disabled) return;
    key = by;
    button.classList.add("held");
    waiting = setTimeout(() => {
      end();
      if (!button.disabled) run();
    }, HOLD);
  };
  const end = () => {
    clearTimeout(waiting);
    waiting = 0;
    key = "";
    button.classList.remove("held");
  };
  button.classList.add("to-hold");
  button.style.setProperty("--hold", `${HOLD}ms`);
  button.addEventListener("pointerdown", (event) => { if (event.button === 0) begin("pointer"); });
  for (const type of ["pointerup", "pointerleave", "pointercancel", "blur"]) button.addEventListener(type, end);
  button.addEventListener("contextmenu", (event) => { if (waiting) event.preventDefault(); }); // a finger that rests opens it
  button.addEventListener("keydown", (event) => {
    if (event.key === "Escape" || event.key === "Tab") end();
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault(); // no click when it is let go
    if (!event.repeat) begin(event.key);
  });
  button.addEventListener("keyup", (event) => {
    if (event.key === " ") event.preventDefault();
    if (event.key === key) end();
  });
  // a click without pointer or key comes from a tool that can't hold
  button.addEventListener("click", (event) => {
    if (event.detail === 0) toast(texts.hold(HOLD / 1000));
  });
}
