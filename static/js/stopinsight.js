// STOP stays in sight where a tablet shows a part of the page only: two fingers have made it larger, or its keyboard has pushed
// it up.

import { $ } from "./dom.js";

const GAP = 8; // px of the screen
const WHOLE = 1; // px, and per cent: less is rounding

export function keepStopInSight() {
  const seen = window.visualViewport;
  if (!seen) return;
  const lay = () => {
    const { offsetLeft: left, offsetTop: top, width, scale } = seen;
    const isPart = left > WHOLE || top > WHOLE || scale > 1 + WHOLE / 100;
    const stop = $("stop");
    stop.classList.toggle("adrift", isPart);
    const right = left + width - (stop.offsetWidth + GAP) / scale;
    stop.style.cssText = isPart ? `left:${right}px;top:${top + GAP / scale}px;transform:scale(${1 / scale})` : "";
  };
  for (const type of ["resize", "scroll"]) seen.addEventListener(type, lay);
  lay();
}
