// What is said in fields of the page and outlives a reload of it, in this tab: how much is sent at once, and what plans and
// commands are judged by, must not change by one.

import { $ } from "./dom.js";
import { known, subscribe } from "./store.js";

const whatOf = (field) => (field.type === "checkbox" ? "checked" : "value");

// id: of a box to tick, or of a list.
export function remember(id) {
  const [field, name] = [$(id), `footfall-${id}`];
  const kept = sessionStorage.getItem(name);
  if (kept !== null) field[whatOf(field)] = JSON.parse(kept);
  field.addEventListener("change", () => sessionStorage.setItem(name, JSON.stringify(field[whatOf(field)])));
}

// -- of one session: another begins with what is delivered ------------------------------------------

const KEPT_AS = "footfall-fields";
const fields = [];
let recalled = false;

/** Remembers fields: boxes, lists, and what is typed. */
export function rememberInSession(...ids) {
  for (const id of ids) {
    fields.push($(id));
    $(id).addEventListener("change", keepFields);
  }
}

/** For who changes such a field by program. */
export function keepFields() {
  if (!recalled) return; // what was kept is still to be read
  const said = Object.fromEntries(fields.map((field) => [field.id, field[whatOf(field)]]));
  sessionStorage.setItem(KEPT_AS, JSON.stringify({ session: known.summary.id, said }));
}

/** As they were before a reload; for who fills such fields later than the page begins. */
export function recallFields() {
  if (!recalled) return;
  const kept = JSON.parse(sessionStorage.getItem(KEPT_AS));
  if (kept?.session !== known.summary.id) return;
  for (const field of fields) {
    const said = kept.said[field.id];
    const isOffered = field.type !== "select-one" || [...field.options].some(({ value }) => value === said);
    if (said !== undefined && isOffered) field[whatOf(field)] = said;
  }
}

subscribe(({ summary }) => {
  if (!summary || recalled) return;
  recalled = true;
  recallFields();
});
