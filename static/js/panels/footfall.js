// Footfall: the chosen place and what is known about it, in words.

import { act } from "../acts.js";
import { chooseFootfall } from "../choosing.js";
import { $, asTyped, element } from "../dom.js";
import { reveal } from "../layout.js";
import { subscribe } from "../store.js";
import * as texts from "../texts/footfall.js";

let drawn = "";

export function start() {
  $("footfall-form").addEventListener("submit", (event) => {
    event.preventDefault();
    chooseFootfall(Number($("footfall-x").value), Number($("footfall-y").value));
  });
  act({ key: "F", text: texts.typeFootfall, run: () => { reveal("footfall"); $("footfall-x").focus(); } });
  subscribe(draw);
}

function draw({ summary }) {
  const answer = summary?.footfall_answer;
  const text = JSON.stringify(answer ?? null);
  if (text === drawn) return;
  drawn = text;
  if (!answer) {
    $("footfall-answer").replaceChildren();
    return;
  }
  if (!$("footfall-form").contains(document.activeElement)) {
    // never write over what the operator is typing
    $("footfall-x").value = asTyped(answer.x);
    $("footfall-y").value = asTyped(answer.y);
  }
  $("footfall-answer").replaceChildren(
    element("p", {
      className: { true: "yes", false: "no", null: "doubt" }[answer.acceptable],
      textContent: texts.judged(answer),
    }),
    ...answer.reasons.map((reason) => element("p", { textContent: reason })),
  );
}
