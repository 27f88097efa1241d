// Map: the ground seen from above, north up, with rover, route and walk; layers of the maps over it, one or two side by side, and
// what every layer says of the point under the pointer.

import { act } from "../acts.js";
import { ROOT, askAgain, get } from "../api.js";
import { fitted, moved, toPixel, toSite, zoomed } from "../above.js";
import { COLOURS, cross, paintMarks, paintScale } from "../abovemarks.js";
import { chooseFootfall } from "../choosing.js";
import { nearest } from "../footfallmoves.js";
import { $, asTyped, attempt, element } from "../dom.js";
import { explainKey, heardFirst } from "../keys.js";
import { layerOptions, subscribeToLayers } from "../layers.js";
import { enlarge, isShown, reveal } from "../layout.js";
import { isAthletes } from "../robot.js";
import { known, subscribe } from "../store.js";
import * as texts from "../texts/ground.js";
import * as shared from "../texts/shared.js";
import { ink } from "../themes.js";
import { picks, setGoal } from "./goal.js";
import { carryFootfall, footfallsMeant, letFootfallGo, movesShown, placesSaid, takeFootfall } from "./places.js";

const SIDES = ["left", "right"];
const FIRST = { left: "footing", right: "footing_friction" };
const PATIENCE = 120; // ms between two read-outs while the pointer moves
const CLOSER = 1.5; // times as large
const WHEEL = 0.0015; // of a power of e for each pixel
const STEP = 40; // px
const CLICK = 4; // px: a hand that moves farther drags the map
const GRASP = 9; // px: a footfall of the walk that is nearer is taken in hand
const CLOSE = 60; // pixels a metre, from which the rover fills a part of the picture

let about = null; // what the server says of the shown maps: geometry, layers
let aboutFor = "";
let groundFor = ""; // digest of the terrain that is shown, and that the stripes are of
let ground = null; // its picture
let asked = 0; // of the latest read-out that was asked for
let waiting = 0;
let cursor = null; // [x, y] under the pointer [m]
let lie = null; // how the map lies in its picture; null: all of the ground is in sight

const stripes = { left: null, right: null }; // over the layers, where newer ground has made them wrong
const pictures = { left: null, right: null };

export function start() {
  for (const side of SIDES) {
    listen($(`map-${side}`));
    $(`map-layer-${side}`).addEventListener("change", () => loadPicture(side));
  }
  subscribeToLayers(() => SIDES.forEach((side) => {
    const shown = $(`map-layer-${side}`).value || FIRST[side];
    $(`map-layer-${side}`).replaceChildren(...layerOptions());
    $(`map-layer-${side}`).value = shown;
  }));
  const some = () => (known.summary?.dem ? "" : shared.noTerrain);
  act({ key: "V", text: texts.showMap, run: () => reveal("map") });
  act({ text: texts.mapLarge, button: "map-large", run: () => enlarge("map") });
  act({ text: texts.mapCloser, button: "map-in", run: () => zoom(CLOSER), refusal: some });
  act({ text: texts.mapFarther, button: "map-out", run: () => zoom(1 / CLOSER), refusal: some });
  act({ text: texts.mapWhole, button: "map-all", run: () => show(null), refusal: some });
  act({ text: texts.mapRover, button: "map-rover", run: toRover, refusal: () => some() || (known.frame ? "" : shared.noTelemetry) });
  $("map-two").addEventListener("change", () => draw(known));
  for (const [keys, text] of texts.MAP_KEYS) explainKey(keys, text);
  heardFirst(press);
  subscribe(draw);
}

// -- how it lies -----------------------------------------------------------------------------------

const sizeOf = ({ clientWidth: width, clientHeight: height }) => ({ width, height });
const lies = (size) => lie ?? fitted(groundBounds(), size);

function show(next) {
  lie = next;
  paint();
}

// About the middle, or about a pixel of a canvas.
function zoom(by, canvas = $("map-left"), at = null) {
  const size = sizeOf(canvas);
  show(zoomed(lies(size), size, by, at ?? [size.width / 2, size.height / 2]));
}

const shift = (by) => show(moved(lies(sizeOf($("map-left"))), by));

function toRover() {
  const { T_site_base: T } = known.frame;
  show({ x: T[0][3], y: T[1][3], scale: Math.max(CLOSE, lies(sizeOf($("map-left"))).scale) });
}

const KEYS = {
  "+": () => zoom(CLOSER), "-": () => zoom(1 / CLOSER), Home: () => show(null),
  ArrowLeft: () => shift([STEP, 0]), ArrowRight: () => shift([-STEP, 0]), ArrowUp: () => shift([0, STEP]), ArrowDown: () => shift([0, -STEP]),
};

function press({ key, target }) {
  if (!(key in KEYS) || !SIDES.some((side) => target === $(`map-${side}`)) || !known.summary?.dem) return false;
  KEYS[key]();
  return true;
}

// -- a hand on it ----------------------------------------------------------------------------------

const pixel = (canvas, event) => {
  const box = canvas.getBoundingClientRect();
  return [event.clientX - box.left - canvas.clientLeft, event.clientY - box.top - canvas.clientTop];
};
const placeAt = (canvas, event) => toSite(lies(sizeOf(canvas)), sizeOf(canvas), pixel(canvas, event));
/** @param {[number, number]} at */
const chooseAt = ([x, y]) => (picks() ? setGoal(x, y) : chooseFootfall(x, y));

// The walk's footfall under a hand; null where there is none.
const footfallAt = (canvas, event) => nearest(footfallsMeant(), (at) => toPixel(lies(sizeOf(canvas)), sizeOf(canvas), at), pixel(canvas, event), GRASP);

function listen(canvas) {
  let down = null; // where a hand took hold, and how the map lay then
  let drags = false;
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || !known.summary?.dem) return;
    down = { at: pixel(canvas, event), lie: lies(sizeOf(canvas)), footfall: footfallAt(canvas, event) };
    drags = false;
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!known.summary?.dem) return;
    if (down) {
      const by = pixel(canvas, event).map((one, i) => one - down.at[i]);
      if (!drags && Math.hypot(...by) > CLICK) {
        drags = true;
        if (down.footfall) takeFootfall(down.footfall);
      }
      if (drags && down.footfall) carryFootfall(placeAt(canvas, event));
      else if (drags) show(moved(down.lie, by));
    } else readOut(placeAt(canvas, event));
  });
  canvas.addEventListener("pointerup", (event) => {
    if (down && !drags) {
      readOut(placeAt(canvas, event)); // a finger points at nothing before
      chooseAt(placeAt(canvas, event));
    }
    if (down?.footfall) letFootfallGo(true);
    down = null;
  });
  canvas.addEventListener("pointercancel", () => {
    if (down?.footfall) letFootfallGo(false);
    down = null;
  });
  canvas.addEventListener("pointerleave", () => { cursor = null; paint(); });
  canvas.addEventListener("wheel", (event) => {
    if (!known.summary?.dem) return;
    event.preventDefault();
    zoom(Math.exp(-WHEEL * event.deltaY), canvas, pixel(canvas, event));
  }, { passive: false });
  new ResizeObserver(paint).observe(canvas);
}

// -- what is shown ---------------------------------------------------------------------------------

async function draw({ summary }) {
  if (!summary || !isShown("map")) return;
  const leg = summary.view.leg;
  const fit = summary.up_to_date.maps[leg];
  const wanted = (fit?.fits || fit?.partly ? summary.maps[leg] : "") ?? "";
  const partly = wanted && fit.partly;
  $("map-note").hidden = Boolean(wanted && !partly);
  $("map-note").textContent = !summary.dem ? texts.buildOrLoad : partly ? texts.mapStriped(leg, fit.reason) : fit && !wanted ? texts.mapHidden(leg, fit.reason) : texts.noMap(leg);
  $("map-sides").hidden = !summary.dem;
  $("map-side-right").hidden = !$("map-two").checked;
  if (summary.dem !== groundFor) loadGround(summary.dem);
  if (wanted !== aboutFor) {
    aboutFor = wanted;
    about = null; // nothing is read or painted of the maps before
    for (const side of SIDES) pictures[side] = null; // each side is painted while the other one loads
    forgetPoint();
    const found = wanted ? await attempt(() => get(`/sessions/current/maps/${wanted}`)) : null;
    if (aboutFor !== wanted) return; // others are asked for by now
    about = found ?? null;
    if (wanted && !about) askAgain(() => { if (aboutFor === wanted) aboutFor = ""; });
    SIDES.forEach(loadPicture);
  }
  paint();
}

function loadGround(dem) {
  groundFor = dem;
  ground = null;
  forgetPoint();
  if (dem) load(`terrains/${dem}/relief.png`, () => groundFor === dem, (image) => { ground = image; });
  if (about) SIDES.forEach(loadStripes);
}

const layerOf = (side) => $(`map-layer-${side}`).value || FIRST[side];

function loadPicture(side) {
  pictures[side] = null;
  const [layer, digest] = [layerOf(side), about?.digest];
  if (!about?.layers[layer]) {
    paint();
    return;
  }
  loadStripes(side);
  load(`maps/${digest}/${layer}.png`, () => about?.digest === digest && layerOf(side) === layer, (image) => { pictures[side] = image; });
}

function loadStripes(side) {
  stripes[side] = null;
  if (known.summary.dem === about.parents.dem) return;
  const [of, digest, layer] = [groundFor, about.digest, layerOf(side)];
  load(`maps/${digest}/changed.png?layer=${encodeURIComponent(layer)}&ground=${of}`,
    () => about?.digest === digest && groundFor === of && layerOf(side) === layer, (image) => { stripes[side] = image; });
}

// isWanted: whether it still is when it has come. What did not come is asked for again.
function load(file, isWanted, taken) {
  const image = new Image();
  image.onload = () => {
    if (isWanted()) taken(image);
    paint();
  };
  image.onerror = () => askAgain(() => { if (isWanted()) load(file, isWanted, taken); });
  image.src = `${ROOT}/sessions/${encodeURIComponent(known.summary.id)}/${file}`;
}

function groundBounds() {
  const [west, south, east, north] = known.summary.terrain.bounds;
  return { west, south, east, north };
}

// The same of a grid whose x0, y0 is the middle of its first cell.
function boundsOf({ x0, y0, resolution, rows, cols }) {
  const [west, south] = [x0 - resolution / 2, y0 - resolution / 2];
  return { west, south, east: west + cols * resolution, north: south + rows * resolution };
}

function paint() {
  if (!known.summary?.terrain || !isShown("map")) return;
  for (const side of SIDES) if ($(`map-${side}`).clientWidth) paintSide(side, $(`map-${side}`));
}

function paintSide(side, canvas) {
  const size = sizeOf(canvas);
  const density = window.devicePixelRatio || 1;
  canvas.width = Math.round(size.width * density);
  canvas.height = Math.round(size.height * density);
  const pen = canvas.getContext("2d");
  pen.scale(density, density);
  pen.imageSmoothingEnabled = false;
  pen.fillStyle = ink("well");
  pen.fillRect(0, 0, size.width, size.height);
  const lying = lies(size);
  const place = (at) => toPixel(lying, size, at);
  const lay = (image, bounds) => {
    const [[left, top], [right, bottom]] = [place([bounds.west, bounds.north]), place([bounds.east, bounds.south])];
    pen.drawImage(image, left, top, right - left, bottom - top);
  };
  if (ground) lay(ground, groundBounds());
  const where = about && boundsOf(about.geometry);
  const stale = about && known.summary.dem !== about.parents.dem && !stripes[side]; // where it holds is not there yet
  if (pictures[side] && !stale) {
    lay(pictures[side], where);
    if (stripes[side]) lay(stripes[side], where);
  } else if (about && !about.layers[layerOf(side)]) {
    pen.fillStyle = ink("text");
    pen.font = "14px system-ui, sans-serif";
    pen.fillText(shared.notComputed, 12, 24);
  }
  paintMarks(pen, place, known, placesSaid(), movesShown());
  if (cursor) cross(pen, place(cursor), COLOURS.pointer);
  paintScale(pen, lying, size);
}

// -- what is read ----------------------------------------------------------------------------------

function readOut(at) {
  cursor = at;
  paint();
  clearTimeout(waiting);
  if (!about || !isAthletes()) return; // of other robots the footfall says what speaks against a place
  waiting = setTimeout(async () => {
    const mine = ++asked;
    const [x, y] = at;
    const answer = about && await attempt(() => get(`/sessions/current/maps/${about.digest}/at?x=${asTyped(x, 4)}&y=${asTyped(y, 4)}`));
    if (answer && mine === asked) showPoint(answer);
  }, PATIENCE);
}

// What was read is of other ground, or of another leg.
function forgetPoint() {
  clearTimeout(waiting);
  asked += 1;
  $("map-read").replaceChildren(element("p", { className: "hint", textContent: texts.pointAtMap }));
}

export function showPoint(answer) {
  $("map-read").replaceChildren(
    element("p", {
      className: answer.refused ? "no" : "yes",
      textContent: texts.verdictAt(answer.x, answer.y, answer.verdict),
    }),
    element("ul", {}, ...answer.lines.map((line) => element("li", { textContent: line }))),
  );
}

// Where a place is in the left picture [px], for whoever drives this page.
export const pixelOf = (at) => toPixel(lies(sizeOf($("map-left"))), sizeOf($("map-left")), at);
