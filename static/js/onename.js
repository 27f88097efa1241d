// One page, one name: a browser that duplicates a tab copies its name, too, and the conn and all choices go by names. The later
// of two pages takes another one.

import { loadAnew } from "./anew.js";
import { PAGE, forgetName } from "./api.js";

export function startName() {
  const line = new BroadcastChannel("footfall-names");
  const mine = crypto.getRandomValues(new Uint32Array(2)).join("-");
  line.addEventListener("message", ({ data: { name, asks, told } }) => {
    if (name !== PAGE) return;
    if (asks) line.postMessage({ name, told: asks });
    else if (told === mine) {
      forgetName();
      loadAnew();
    }
  });
  line.postMessage({ name: PAGE, asks: mine });
}
