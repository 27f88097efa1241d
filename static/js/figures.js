// Figures as the page writes them: digits, signs and ages, each in one way. No part of the page is needed.

// A number as it is typed: for a field, an address, a style. "–" where there is none. What rounds to nothing has no sign.
export function asTyped(value, digits = 3) {
  return typeof value === "number" && Number.isFinite(value) ? value.toFixed(digits).replace(/^-(?=0\.?0*$)/, "") : "–";
}

// A number to be read: as typed, with a true minus sign.
export const fixed = (value, digits = 3) => asTyped(value, digits).replace("-", "−");

// A number with the digits that it has, up to six behind the point, as on an axis.
export const bare = (value) => String(Number(asTyped(value, 6))).replace("-", "−");

// Words that were written elsewhere: a hyphen before a number becomes a true minus sign. One inside of a name, a date, a
// range or an exponent stays. Before a number are blanks, brackets, commas and the like.
export const withSigns = (text) => text.replace(/(?<=^|[\s([,;:±<>≤≥…])-(?=\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\.?[\w-]))/g, "−");

// A difference: with its sign either way, without one where it rounds to nothing.
export function signed(value, digits = 3) {
  const told = fixed(value, digits);
  return Number(told) > 0 ? `+${told}` : told;
}

export function age(seconds) {
  if (typeof seconds !== "number") return "–";
  if (seconds < 60) return `${seconds.toFixed(seconds < 10 ? 1 : 0)} s`;
  if (seconds < 3600) return `${Math.floor(seconds / 60)} min`;
  return `${Math.floor(seconds / 3600)} h`;
}

// -- with units, one way for each ------------------------------------------------------------------

export const metres = (value, digits = 3) => `${fixed(value, digits)} m`;
export const millimetres = (value) => `${fixed(1000 * value, 0)} mm`;
export const newtons = (value) => `${fixed(value, 0)} N`;
export const seconds = (value, digits = 1) => `${fixed(value, digits)} s`;
export const radians = (angle, digits = 3) => `${fixed(angle, digits)} rad`;

/** An angle in radians, told in degrees. */
export const degrees = (angle, digits = 1) => `${fixed((angle * 180) / Math.PI, digits)}°`;

/** A share of 1, told in percent. */
export const percent = (share, digits = 0) => `${fixed(100 * share, digits)} %`;

/** A place of the ground, or above it: two or three coordinates. */
export const place = (at, digits = 3) => `(${at.map((one) => fixed(one, digits)).join(", ")}) m`;
