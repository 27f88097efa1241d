// The large image of the Images panel: loaded, explained by its legend, or said why it can't be shown.

import { ROOT, get } from "./api.js";
import { $, element } from "./dom.js";
import { known } from "./store.js";
import * as texts from "./texts/images.js";

const MADE = ["disparity", "mask"]; // by the server, from all pairs of the snapshot

let wanted = "";
let there = "";

// Whether the picture that is asked for is the one in sight.
export const shownPicture = () => there === wanted && wanted !== "";

export async function loadPicture(snapshot, pair, view) {
  const mine = `${snapshot}/${pair}/${view}`;
  if (mine === wanted) return;
  wanted = mine;
  note(MADE.includes(view) ? texts.matching : texts.loading);
  $("picture-legend").replaceChildren();
  let legend = [];
  try {
    if (MADE.includes(view)) {
      legend = legendOf(await get(`/sessions/current/images/${encodeURIComponent(pair)}/views?of=${snapshot}`), view);
    }
  } catch (error) {
    if (mine === wanted) note(error.message, true);
    return;
  }
  if (mine !== wanted) return;
  const image = new Image();
  image.addEventListener("load", () => {
    if (mine !== wanted) return;
    there = mine;
    $("picture-image").src = image.src;
    $("picture-image").alt = `${pair}, ${view}`;
    $("picture-legend").replaceChildren(...legend);
    note("");
  });
  image.addEventListener("error", () => {
    if (mine === wanted) note(texts.imageFailed, true);
  });
  image.src = pictureAt(snapshot, pair, view);
}

export const pictureAt = (snapshot, pair, view) =>
  `${ROOT}/sessions/${encodeURIComponent(known.summary.id)}/images/${encodeURIComponent(pair)}/${view}.png?of=${snapshot}`;

// What failed is tried again when it is asked for again.
export function retryPicture() {
  wanted = "";
}

function note(text, failed = false) {
  $("picture-note").hidden = !text;
  $("picture-note").textContent = text;
  $("picture-note").className = failed ? "no" : "";
  $("picture-again").hidden = !failed;
  $("picture").classList.toggle("empty", Boolean(text)); // never the lines of one image over another
  $("picture").setAttribute("aria-busy", String(Boolean(text) && !failed));
}

const swatch = (rgb) => {
  const made = element("i", { ariaHidden: "true" });
  made.style.background = Array.isArray(rgb[0]) ? `linear-gradient(to right, ${rgb.map((one) => `rgb(${one.join(" ")})`).join(", ")})` : `rgb(${rgb.join(" ")})`;
  return made;
};

const entry = (rgb, text, kind = "") => element("li", { className: kind }, swatch(rgb), element("span", { textContent: text }));

// Raises what is to be said in place of the picture.
function legendOf({ reason, used, disparity, mask }, view) {
  if (view === "mask") {
    return [
      entry(mask.robot, texts.robotShare(mask.robot_share)),
      entry(mask.rim, texts.rimShare(mask.rim_share)),
      element("li", { textContent: mask.legs }),
    ];
  }
  if (!disparity) throw new Error(texts.pairNotUsable(reason));
  const { far, near, known: share } = disparity;
  return [
    entry(disparity.ramp, texts.ramp(far, near), "ramp"),
    entry(disparity.unknown, texts.notMatched(1 - share)),
    element("li", { textContent: texts.usedShare(used) }),
  ];
}
