// Dark, light, or for a screen in the sun: chosen in this browser, and remembered by it. The colours are in css/themes.css.

const KEPT_AS = "footfall.theme";
export const WORN = "footfall-theme"; // said by the document when another theme is worn: a canvas has the colours of before
export const THEMES = ["dark", "light", "sunlight"];

/** The theme that is worn. */
export const theme = () => document.documentElement.dataset.theme ?? THEMES[0];

// What was chosen before; what this page does not know leaves it dark.
export function wearKept() {
  try {
    const kept = localStorage.getItem(KEPT_AS);
    if (THEMES.includes(kept)) document.documentElement.dataset.theme = kept;
  } catch { /* without storage the page is dark at first */ }
}

export function wear(name) {
  document.documentElement.dataset.theme = name;
  document.dispatchEvent(new Event(WORN));
  try {
    localStorage.setItem(KEPT_AS, name);
  } catch { /* without storage a theme lasts as long as the page */ }
}

// A colour of the theme, for what is drawn on a canvas: `ink("quiet")` is `var(--quiet)`.
export const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
