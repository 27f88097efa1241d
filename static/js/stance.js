// From which state of the rover is planned: what it last said, or what the operator asks "what if" of.

import { post } from "./api.js";
import { known } from "./store.js";

// Freezes the rover's state for planning. A what-if stays: it was asked for, and is marked as such.
export async function freeze() {
  if (known.summary.what_if) return;
  await post("/sessions/current/state", {}).catch((error) => {
    // Without a rover the frozen state of the session is what there is to plan from.
    if (!known.summary.state) throw error;
  });
}
