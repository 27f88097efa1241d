// Whether this page shows its own choices (leg, layer, ghost, footfall, points, goal), or those of whoever holds the conn.

import { PAGE } from "./api.js";
import { known } from "./store.js";
import * as texts from "./texts/conn.js";

export const follows = () => Boolean(known.summary?.view.follows) && known.summary.conn.holder?.page !== PAGE;

// Why nothing is chosen, or asked for of what is chosen, on this page; "" where nothing is in the way.
export const notOwn = () => (follows() ? texts.notOwn : "");

export function requireOwn() {
  if (follows()) throw new Error(notOwn());
}
