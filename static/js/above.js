// How the map from above lies in its picture: north up, a place of the site in the middle, so many pixels for a metre. No part
// of the page is needed.

/** @typedef {{x: number, y: number, scale: number}} Lie x, y: what is in the middle [m]; scale: pixels a metre */
/** @typedef {{width: number, height: number}} Size of the picture [px] */

const [LEAST, MOST] = [0.5, 4000]; // pixels a metre
const FILLED = 0.92; // of the picture, by what is fitted in

const within = (scale) => Math.max(LEAST, Math.min(scale, MOST));

/** @type {(lie: Lie, size: Size, at: number[]) => [number, number]} */
export const toPixel = (lie, { width, height }, [east, north]) => [width / 2 + (east - lie.x) * lie.scale, height / 2 - (north - lie.y) * lie.scale];

/** @type {(lie: Lie, size: Size, at: number[]) => [number, number]} */
export const toSite = (lie, { width, height }, [right, down]) => [lie.x + (right - width / 2) / lie.scale, lie.y - (down - height / 2) / lie.scale];

/** @type {(bounds: {west: number, south: number, east: number, north: number}, size: Size) => Lie} */
export const fitted = ({ west, south, east, north }, { width, height }) =>
  ({ x: (west + east) / 2, y: (south + north) / 2, scale: within(FILLED * Math.min(width / (east - west), height / (north - south))) });

// by: times as large. What is at that pixel stays there.
/** @type {(lie: Lie, size: Size, by: number, at: number[]) => Lie} */
export function zoomed(lie, size, by, at) {
  const scale = within(lie.scale * by);
  const [x, y] = toSite(lie, size, at);
  return { x: x + ((lie.x - x) * lie.scale) / scale, y: y + ((lie.y - y) * lie.scale) / scale, scale };
}

// The ground goes along with a hand that moves so many pixels.
/** @type {(lie: Lie, by: number[]) => Lie} */
export const moved = (lie, [right, down]) => ({ ...lie, x: lie.x - right / lie.scale, y: lie.y + down / lie.scale });

// The longest of … 0.5, 1, 2, 5, 10 … m that takes no more than so many pixels [m].
/** @type {(lie: Lie, most: number) => number} */
export function barOf({ scale }, most) {
  const unit = 10 ** Math.floor(Math.log10(most / scale));
  return [5, 2, 1].map((times) => times * unit).find((length) => length * scale <= most) ?? unit / 2; // a logarithm may round up
}
