// Small ways of building the page. Text goes in as text: nothing from rover, file or server is read as markup.

export { age, asTyped, fixed, signed } from "./figures.js";

/** @type {(id: string) => any} whatever kind of element has that id */
export const $ = (id) => document.getElementById(id);

export function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name in made) made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

let hiding = 0;
$("toast")?.addEventListener("click", () => { $("toast").hidden = true; });
export function toast(text) {
  const box = $("toast");
  box.textContent = text;
  box.hidden = false;
  clearTimeout(hiding);
  hiding = setTimeout(() => { box.hidden = true; }, 12000);
}

// What was asked for is answered: the request for it goes, whatever else is said by now stays.
export function untoast(text) {
  if ($("toast").textContent === text) $("toast").hidden = true;
}

// Runs an act of the operator; what goes wrong is said, never swallowed.
export async function attempt(act) {
  try {
    return await act();
  } catch (error) {
    toast(error.message);
    return undefined;
  }
}
