// The layers of a map as the server names them, grouped for a menu.

import { get } from "./api.js";
import { element } from "./dom.js";

let groups = [];
const listeners = [];

export async function loadLayers() {
  groups = (await get("/layers")).groups;
  listeners.forEach((listener) => listener());
}

export function subscribeToLayers(listener) {
  listeners.push(listener);
  if (groups.length) listener();
}

export const layerOptions = () => groups.map(({ title, layers }) =>
  element("optgroup", { label: title }, ...layers.map(({ name, title: text }) => element("option", { value: name, textContent: text }))));

export const layerNames = () => groups.flatMap(({ layers }) => layers.map(({ name }) => name));
