// Ground: images, terrain, the colouring for the chosen leg, and which layer is shown.

import { act } from "../acts.js";
import { askAgain, get, post, put } from "../api.js";
import { choiceText, chosenPairs, notBuildable } from "../cameras.js";
import { chooseLeg, settled } from "../choosing.js";
import { $, attempt, element, toast } from "../dom.js";
import { outOfDate, reserve } from "../fits.js";
import { layerNames, layerOptions, subscribeToLayers } from "../layers.js";
import { pictureAt } from "../picture.js";
import { rememberInSession } from "../remembered.js";
import { isAthletes } from "../robot.js";
import { freeze } from "../stance.js";
import { alive, known, now, subscribe } from "../store.js";
import * as texts from "../texts/ground.js";
import * as shared from "../texts/shared.js";
import { showPair } from "./images.js";
import { weights } from "./suggest.js";
import { awaitImages } from "./work.js";

const OLD_GROUND = 3600; // s: what was seen longer ago is marked

const KEYED = 6; // legs from here on have no key: 6 to 9 are the layouts'

let legendFor = "";
let imagesFor = "";

export function start() {
  subscribeToLayers(() => {
    $("layer").replaceChildren(element("option", { value: "", textContent: texts.whatCamerasSaw }), ...layerOptions());
    $("layer").value = known.summary?.view.layer ?? "";
  });
  $("layer").addEventListener("change", () => attempt(() => put("/sessions/current/view", { layer: $("layer").value || null })));
  $("legs").append(
    ...known.robot.legs.map((leg) =>
      element("button", { type: "button", role: "radio", ariaLabel: shared.legFirst(leg), title: known.robot.leg_names[leg], id: `leg-${leg}`, onclick: () => chooseLeg(leg) },
        shared.legFirst(leg), element("small", { textContent: leg < KEYED ? texts.key(leg) : "" })),
    ),
  );
  $("terrain-file").addEventListener("change", loadFile);
  known.robot.legs.forEach((leg) => act({ key: leg < KEYED ? `${leg}` : "", text: texts.chooseLeg(leg), run: () => chooseLeg(leg) }));
  act({ key: "I", text: texts.takeImages, button: "take-images", run: takeImages, refusal: () => (known.summary?.link.connected ? "" : shared.noRover) });
  act({ key: "T", text: texts.buildTerrain, button: "build-terrain", run: buildTerrain, refusal: notBuildable });
  act({ key: "M", text: texts.whereLegStands, button: "compute-maps", run: computeMaps, refusal: () => (known.summary?.dem ? "" : texts.buildOrLoad) });
  act({
    key: "U", text: texts.undoTerrain, button: "undo-terrain", run: undoTerrain,
    refusal: () => (known.summary?.can_undo_terrain ? "" : texts.terrainUnchanged),
  });
  act({ key: "C", text: texts.clearTerrain, button: "clear-terrain", run: clearTerrain, refusal: notClearable });
  act({ key: "L", text: texts.nextLayer, run: nextLayer });
  rememberInSession("conservative", "friction-aware", "friction", "gravity", "payload", "tilt", "uphill");
  subscribe(draw);
}

const takeImages = () => attempt(async () => {
  const before = known.summary.snapshot;
  await post("/sessions/current/images", {});
  awaitImages(before);
});
const buildTerrain = () => attempt(() => post("/sessions/current/terrains", { source: "images", settings: { pairs: chosenPairs() } }));

const undoTerrain = () => attempt(() => post("/sessions/current/terrains/undo", {}));

const notClearable = () => {
  if (!known.summary?.terrain) return shared.noTerrain;
  return known.summary.footfall ? "" : texts.chooseWhatToClear;
};

const clearTerrain = () => attempt(async () => {
  await settled();
  const chosen = known.summary.footfall;
  await post("/sessions/current/terrains/clear", { center: [chosen.x, chosen.y], radius: Number($("clear-radius").value) });
});

const RADIANS = Math.PI / 180;

// What balance is judged by. The tilt asks "what if the whole site were tilted so that it rises toward there" (0° east, 90° north).
export const balance = () => ({
  friction: Number($("friction").value),
  gravity: Number($("gravity").value),
  payload_mass: $("payload").value === "" ? null : Number($("payload").value),
  slope: Number($("tilt").value) * RADIANS,
  uphill: Number($("uphill").value) * RADIANS,
});

export const computeMaps = () => attempt(async () => {
  await settled();
  await freeze();
  const friction = isAthletes() && $("friction-aware").checked;
  const settings = { conservative: $("conservative").checked, friction, balance: balance(), quality: { weights: weights() } };
  await post("/sessions/current/maps", { leg: known.summary.view.leg, ...(isAthletes() ? { settings } : {}) });
  await put("/sessions/current/view", { layer: friction ? "footing_friction" : "footing" });
});

function nextLayer() {
  const names = ["", ...layerNames()];
  $("layer").value = names[(names.indexOf($("layer").value) + 1) % names.length];
  $("layer").dispatchEvent(new Event("change"));
}

const loadFile = () => attempt(async () => {
  const files = [...$("terrain-file").files];
  if (!files.length) return;
  const file = files.find(({ name }) => !BESIDE.test(name)) ?? files[0];
  const form = new FormData();
  form.append("file", file);
  for (const other of files) if (other !== file) form.append("beside", other);
  const stated = scanOptions();
  const scan = Object.keys(stated).length > 0 || ONLY_SCANS.test(file.name);
  if (scan) form.append("options", JSON.stringify(stated));
  const { true_north_deg: north } = await post(`/sessions/current/terrains${scan ? "/scans" : ""}`, form);
  if (north && Math.abs(north[0]) > 0.05) {
    toast(texts.trueNorth(north[0]));
  }
  $("terrain-file").value = "";
});

// What may lie beside a terrain file and says how to read it.
const BESIDE = /(\.(msk|aux|ovr|prj|qpj|tfw|tifw|tiffw|wld|pgw|pngw|asw|ascw|tab|rpb|hdr|stx|clr|xml)|_rpc\.txt)$/i;
const ONLY_SCANS = /\.(pcd|las|laz|xyz|csv|txt|vtk)$/i;

/** What is stated of a scan; nothing where its file is to say. */
const scanOptions = () => Object.fromEntries(
  [["unit", $("scan-unit").value], ["up", $("scan-up").value]].filter(([, value]) => value));

function draw({ summary }) {
  if (!summary) return;
  const { view } = summary;
  if (document.activeElement !== $("layer")) $("layer").value = view.layer ?? "";
  $("compute-maps").textContent = texts.whereThisStands(view.leg);
  for (const leg of known.robot.legs) {
    const button = $(`leg-${leg}`);
    button.setAttribute("aria-checked", String(leg === view.leg));
  }
  drawGround(summary);
  drawLegend(summary);
  drawImages(summary);
  $("next-terrain").textContent = choiceText();
}

function drawGround(summary) {
  const terrain = summary.terrain;
  const box = $("status-ground");
  $("left-out").replaceChildren(...Object.entries(terrain?.left_out ?? {}).map(([pair, reason]) =>
    element("li", { className: "doubt", textContent: texts.leftOut(pair, reason) })));
  if (!terrain) {
    box.dataset.state = "warn";
    box.textContent = texts.none;
    $("ground-text").textContent = texts.takeAndBuild;
    return;
  }
  const seconds = now() - terrain.seen;
  box.dataset.state = !alive() ? "stale" : seconds > OLD_GROUND ? "warn" : "good";
  box.textContent = alive() ? texts.old(seconds) : texts.oldAtLeast(seconds);
  const fit = summary.up_to_date.maps[summary.view.leg];
  const maps = colours(fit, summary.up_to_date);
  $("ground-text").textContent =
    texts.terrainTold(terrain, seconds, summary.view.leg, maps);
}

function colours(fit, all) {
  if (!fit) return texts.notColoured;
  if (fit.partly) return texts.partlyColoured(outOfDate(fit));
  if (!fit.fits) return texts.coloursOutOfDate(outOfDate(fit));
  const but = reserve(fit, all);
  return but ? texts.colouredBut(but) : texts.coloured;
}

async function drawLegend(summary) {
  const maps = summary.maps[summary.view.leg];
  const fit = summary.up_to_date.maps[summary.view.leg];
  const shown = maps && (fit?.fits || fit?.partly) && summary.view.layer;
  $("legend-striped").hidden = !(shown && fit.partly);
  $("legend-outdated").hidden = Boolean(!maps || shown || !summary.view.layer);
  const wanted = shown ? `${maps}/${summary.view.layer}` : "";
  if (wanted === legendFor) return;
  legendFor = wanted;
  const about = wanted ? await get(`/sessions/current/maps/${maps}`).catch(() => null) : { layers: {}, not_lifted: "" };
  if (wanted !== legendFor) return;
  if (!about) {
    $("legend").replaceChildren(); // that of another layer would be wrong
    askAgain(() => { if (wanted === legendFor) legendFor = ""; });
    return;
  }
  const layer = wanted ? about.layers[summary.view.layer] : { legend: [] };
  const rows = layer?.legend ?? [{ text: texts.frictionNotComputed, rgb: [134, 150, 178] }];
  $("legend").replaceChildren(
    ...rows.map(({ text, rgb }) => {
      const swatch = element("i", { ariaHidden: "true" });
      swatch.style.background = `rgb(${rgb.join(" ")})`;
      return element("li", {}, swatch, element("span", { textContent: text }));
    }),
    ...(about.not_lifted ? [element("li", { className: "no", textContent: texts.notLifted(about.not_lifted) })] : []),
  );
}

function drawImages(summary) {
  const wanted = summary.snapshot || "";
  if (wanted === imagesFor) return;
  imagesFor = wanted;
  $("images").replaceChildren(
    ...(summary.pairs || []).map((pair) =>
      thumbnail(pair, pictureAt(wanted, pair, "left"))),
  );
}

function thumbnail(pair, url) {
  return element("li", {}, element("figure", {},
    element("button", { type: "button", title: texts.showInImages(pair), onclick: () => showPair(pair) },
      element("img", { alt: shared.leftCamera(pair), src: url })),
    element("figcaption", { textContent: pair })));
}
