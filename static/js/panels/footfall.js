// Footfall: the chosen place and what is known about it, in words.

import { act } from "../acts.js";
import { chooseFootfall } from "../choosing.js";
import { $, element, fixed } from "../dom.js";
import { reveal } from "../layout.js";
import { subscribe } from "../store.js";

let drawn = "";

export function start() {
  $("footfall-form").addEventListener("submit", (event) => {
    event.preventDefault();
    chooseFootfall(Number($("footfall-x").value), Number($("footfall-y").value));
  });
  act({ key: "F", text: "Type the footfall", run: () => { reveal("footfall"); $("footfall-x").focus(); } });
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
    $("footfall-x").value = fixed(answer.x);
    $("footfall-y").value = fixed(answer.y);
  }
  $("footfall-answer").replaceChildren(
    element("p", {
      className: { true: "yes", false: "no", null: "doubt" }[answer.acceptable],
      textContent: `${answer.footing ?? "Not judged yet"}: leg ${answer.leg} at (${fixed(answer.x)}, ${fixed(answer.y)}, ${fixed(answer.z)}) m`
        + (answer.margin === null ? "" : `, margin ${fixed(answer.margin)} m`)
        + (answer.slope === null ? "" : `, slope ${fixed((answer.slope * 180) / Math.PI, 1)}°`),
    }),
    ...answer.reasons.map((reason) => element("p", { textContent: reason })),
  );
}
