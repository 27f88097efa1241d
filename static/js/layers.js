// The layers of a map as the server names them, grouped for a menu, and the factors of footfall quality.

import { get } from "./api.js";
import { element } from "./dom.js";

let groups = [];
let named = [];
const listeners = [];

export async function loadLayers() {
  ({ groups, factors: named } = await get("/layers"));
  listeners.forEach((listener) => listener());
}

export function subscribeToLayers(listener) {
  listeners.push(listener);
  if (groups.length) listener();
}

export const layerOptions = () => groups.map(({ title, layers }) =>
  element("optgroup", { label: title }, ...layers.map(({ name, title: text }) => element("option", { value: name, textContent: text }))));

export const factors = () => named;

export const layerNames = () => groups.flatMap(({ layers }) => layers.map(({ name }) => name));
