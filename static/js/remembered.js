// What is chosen in a field of the page and outlives a reload of it, in this tab: how much is sent at once must not change by one.

import { $ } from "./dom.js";

// id: of a box to tick, or of a list.
export function remember(id) {
  const [field, name] = [$(id), `footfall-${id}`];
  const what = field.type === "checkbox" ? "checked" : "value";
  const kept = sessionStorage.getItem(name);
  if (kept !== null) field[what] = JSON.parse(kept);
  field.addEventListener("change", () => sessionStorage.setItem(name, JSON.stringify(field[what])));
}
