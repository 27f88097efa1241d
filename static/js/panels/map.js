// Map: two layers side by side, seen from above, with what every layer says of the point under the pointer.

import { act } from "../acts.js";
import { ROOT, get } from "../api.js";
import { chooseFootfall } from "../choosing.js";
import { $, asTyped, attempt, element } from "../dom.js";
import { layerOptions, subscribeToLayers } from "../layers.js";
import { reveal } from "../layout.js";
import { known, subscribe } from "../store.js";
import * as texts from "../texts/ground.js";
import * as shared from "../texts/shared.js";
import { picks, setGoal } from "./goal.js";

const SIDES = ["left", "right"];
const FIRST = { left: "footing", right: "footing_friction" };
const PATIENCE = 120; // ms between two read-outs while the pointer moves

let about = null; // what the server says of the shown maps: geometry, layers
let aboutFor = "";
let groundFor = ""; // digest of the terrain that the stripes are of
let asked = 0; // of the latest read-out that was asked for
let waiting = 0;
let cursor = null; // [x, y] under the pointer [m]

const stripes = { left: null, right: null }; // over them, where newer ground has made them wrong
const pictures = { left: null, right: null };

export function start() {
  for (const side of SIDES) {
    const canvas = $(`map-${side}`);
    $(`map-layer-${side}`).addEventListener("change", () => loadPicture(side));
    canvas.addEventListener("pointermove", (event) => readOut(place(canvas, event)));
    canvas.addEventListener("pointerleave", () => { cursor = null; paint(); });
    canvas.addEventListener("click", (event) => chooseAt(place(canvas, event)));
  }
  subscribeToLayers(() => SIDES.forEach((side) => {
    const shown = $(`map-layer-${side}`).value || FIRST[side];
    $(`map-layer-${side}`).replaceChildren(...layerOptions());
    $(`map-layer-${side}`).value = shown;
  }));
  act({ key: "V", text: texts.showMap, run: toggle });
  $("panel-map").addEventListener("toggle", () => draw(known));
  subscribe(draw);
}

function toggle() {
  $("panel-map").open = !$("panel-map").open;
  if ($("panel-map").open) reveal("footfall");
}

const chooseAt = ([x, y]) => (picks() ? setGoal(x, y) : chooseFootfall(x, y));

/** @returns {[number, number]} */
function place(canvas, event) {
  const box = canvas.getBoundingClientRect();
  const { x0, y0, resolution, rows, cols } = about.geometry;
  return [
    x0 + resolution * (((event.clientX - box.left) / box.width) * cols - 0.5),
    y0 + resolution * ((1 - (event.clientY - box.top) / box.height) * rows - 0.5),
  ];
}

async function draw({ summary }) {
  if (!summary || !$("panel-map").open) return;
  const leg = summary.view.leg;
  const fit = summary.up_to_date.maps[leg];
  const wanted = fit?.fits || fit?.partly ? summary.maps[leg] : "";
  const partly = wanted && fit.partly;
  $("map-note").hidden = Boolean(wanted && !partly);
  $("map-note").textContent = partly ? texts.mapStriped(leg, fit.reason) : fit && !wanted ? texts.mapHidden(leg, fit.reason) : texts.noMap(leg);
  $("map-sides").hidden = !wanted;
  if (wanted !== aboutFor) {
    aboutFor = wanted;
    groundFor = summary.dem;
    about = wanted ? await attempt(() => get(`/sessions/current/maps/${wanted}`)) : null;
    if (about) SIDES.forEach(loadPicture);
  } else if (about && summary.dem !== groundFor) {
    groundFor = summary.dem;
    SIDES.forEach(loadStripes);
  }
  paint();
}

function loadPicture(side) {
  const layer = $(`map-layer-${side}`).value || FIRST[side];
  pictures[side] = null;
  if (!about?.layers[layer]) {
    paint();
    return;
  }
  loadStripes(side);
  load(`${layer}.png`, (image) => { pictures[side] = image; });
}

function loadStripes(side) {
  stripes[side] = null;
  if (known.summary.dem === about.parents.dem) return;
  const layer = $(`map-layer-${side}`).value || FIRST[side];
  load(`changed.png?layer=${encodeURIComponent(layer)}&ground=${groundFor}`, (image) => { stripes[side] = image; });
}

function load(file, taken) {
  const image = new Image();
  image.onload = () => {
    taken(image);
    paint();
  };
  image.src = `${ROOT}/sessions/${encodeURIComponent(known.summary.id)}/maps/${about.digest}/${file}`;
}

function paint() {
  if (!about) return;
  const { rows, cols } = about.geometry;
  for (const side of SIDES) {
    const canvas = $(`map-${side}`);
    canvas.width = cols;
    canvas.height = rows;
    const pen = canvas.getContext("2d");
    const stale = known.summary.dem !== about.parents.dem && !stripes[side]; // where it holds is not there yet
    if (pictures[side] && !stale) {
      pen.drawImage(pictures[side], 0, 0, cols, rows);
      if (stripes[side]) pen.drawImage(stripes[side], 0, 0, cols, rows);
    } else if (!pictures[side]) {
      pen.fillStyle = "#e8edf3";
      pen.font = `${Math.round(cols / 16)}px system-ui, sans-serif`;
      pen.fillText(shared.notComputed, cols / 20, rows / 2);
    }
    if (known.summary.footfall) mark(pen, [known.summary.footfall.x, known.summary.footfall.y], "#ffffff");
    if (cursor) mark(pen, cursor, "#ffc94d");
  }
}

function mark(pen, [x, y], color) {
  const { x0, y0, resolution, rows, cols } = about.geometry;
  const u = (x - x0) / resolution + 0.5;
  const v = rows - ((y - y0) / resolution + 0.5);
  const size = cols / 40;
  for (const [width, style] of [[cols / 120, "#000000"], [cols / 240, color]]) {
    pen.lineWidth = width;
    pen.strokeStyle = style;
    pen.beginPath();
    pen.moveTo(u - size, v);
    pen.lineTo(u + size, v);
    pen.moveTo(u, v - size);
    pen.lineTo(u, v + size);
    pen.stroke();
  }
}

function readOut(at) {
  cursor = at;
  paint();
  clearTimeout(waiting);
  waiting = setTimeout(async () => {
    const mine = ++asked;
    const [x, y] = at;
    const answer = await attempt(() => get(`/sessions/current/maps/${about.digest}/at?x=${asTyped(x, 4)}&y=${asTyped(y, 4)}`));
    if (answer && mine === asked) showPoint(answer);
  }, PATIENCE);
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
