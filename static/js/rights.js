// What the role of whoever is logged in does not allow. A part of the page says with data-needs which role its buttons
// need; the nearest one counts. This spares vain attempts: the server refuses in any case.

import { known } from "./store.js";
import * as texts from "./texts/page.js";

const ROLES = ["viewer", "planner", "commander", "admin"];

// Why a button (or what stands for it) is not for this user; "" where it is.
export function lacking(part) {
  const needs = part?.closest("[data-needs]")?.dataset.needs;
  if (!needs || !known.me || ROLES.indexOf(known.me.role) >= ROLES.indexOf(needs)) return "";
  return texts.needsRole(needs, known.me.role);
}
