// Ground: images, terrain, the colouring for a leg, maps from above.

import { age, bare, degrees, percent, place } from "../figures.js";
import { notComputed } from "./shared.js";

export const whatCamerasSaw = "What the cameras saw";
export const key = (name) => `key ${name}`;
export const chooseLeg = (leg) => `Choose leg ${leg}`;
export const takeImages = "Take images";
export const buildTerrain = "Build terrain from the images";
export const whereLegStands = "Show where the leg can stand";
export const whereThisStands = (leg) => `Show where leg ${leg} can stand`;
export const buildOrLoad = "There is no terrain yet: build it or load a file.";
export const undoTerrain = "Undo the latest change of the terrain";
export const terrainUnchanged = "The terrain has not been changed.";
export const clearTerrain = "Clear the terrain around the footfall";
export const chooseWhatToClear = "Choose a footfall first: the ground around it is cleared.";
export const nextLayer = "Next layer";
// angle: in degrees, as the file has it.
export const trueNorth = (angle) => `True north is turned ${degrees((angle * Math.PI) / 180)} clockwise from this map's y; x runs along its rows.`;
export const leftOut = (pair, reason) => `${pair} left out: ${reason}`;
export const none = "none";
export const takeAndBuild = "No terrain yet: take images and build it, or load a file.";
export const old = (since) => `${age(since)} old`;
export const oldAtLeast = (since) => `${old(since)}, newer not known`;
export const terrainTold = ({ name, cols, rows, resolution, known }, since, leg, maps) =>
  `${name}: ${cols} × ${rows} cells of ${resolution} m, ${percent(known)} known, ${old(since)}. Leg ${leg}: ${maps}.`;
export const notColoured = "not coloured";
export const partlyColoured = (why) => `▲ colours hold in part, and are striped where they may be wrong: ${why}`;
export const coloursOutOfDate = (why) => `▲ colours are OUT OF DATE and hidden: ${why}`;
export const colouredBut = (reserve) => `coloured; ${reserve}`;
export const coloured = "coloured";
export const frictionNotComputed = `${notComputed}: show where the leg can stand with friction`;
export const notLifted = (why) => `⊘ ${why}`;
export const showInImages = (pair) => `${pair}: show in Images`;

// -- which pairs -----------------------------------------------------------------------------------

export const noImagesYet = "There are no images yet: take images first.";
export const noPairTicked = "No camera pair is ticked for it: see Images.";
export const pairsChosen = (count, of, without) => `The next terrain is built from ${count} of ${of} camera pairs, without ${without}.`;

// -- the map from above ----------------------------------------------------------------------------

export const showMap = "Show the map from above";
export const mapLarge = "Map: large over the scene, or back";
export const mapCloser = "Map: zoom in";
export const mapFarther = "Map: zoom out";
export const mapWhole = "Map: show the whole ground";
export const mapRover = "Map: show the rover in the middle";
export const MAP_KEYS = [
  ["+ −", "On the map: zoom in, zoom out"],
  ["← → ↑ ↓", "On the map: move it"],
  ["Home", "On the map: show the whole ground"],
];
export const barLength = (length) => `${bare(length)} m`;
export const northSign = "N";
export const mapStriped = (leg, why) => `Striped where the maps of leg ${leg} may be wrong: ${why}. Show where leg ${leg} can stand again.`;
export const mapHidden = (leg, why) => `The maps of leg ${leg} are out of date and hidden: ${why}. Show where leg ${leg} can stand again.`;
export const noMap = (leg) => `There are no maps of leg ${leg} yet. Show where leg ${leg} can stand first.`;
export const verdictAt = (x, y, verdict) => `${place([x, y], 2)}: ${verdict}`;

// -- on the page from the beginning -----------------------------------------------------------------

export const title = "{} Ground";
export const noTerrainYet = "No terrain yet.";
export const build = "Build terrain";
export const conservative = "{} conservative support";
export const withFriction = "{} with friction";
export const aboutFriction = "Takes seconds longer: equilibrium on the real contact normals, and torques";
export const loadFile = "Load terrain file{}";
export const besideIt = "Choose the files beside it, too: .prj, .msk, .aux.xml, .tfw";
export const ofAScan = "Unit and axis of a scan";
export const unit = "Unit {}";
export const aboutUnit = "Unit of the points that are loaded next, where their file does not say";
export const asFile = "as its file says";
export const m = "m";
export const cm = "cm";
export const mm = "mm";
export const km = "km";
export const ft = "ft";
export const usFt = "us-ft";
export const up = "Up {}";
export const aboutUp = "Which axis of the points points up";
export const plusZ = "z";
export const plusY = "y";
export const plusX = "x";
export const minusZ = "−z";
export const minusY = "−y";
export const minusX = "−x";
export const undoIt = "Undo terrain";
export const clearAround = "Clear around footfall";
export const radius = "Radius {} m";
export const friction = "μ {}";
export const gravity = "Gravity {}";
export const earth = "Earth";
export const mars = "Mars";
export const moon = "Moon";
export const payload = "Payload {} kg";
export const aboutPayload = "Replaces the payload of the rover's description; empty keeps that";
export const asIs = "as is";
export const tilt = "Tilt {} °";
export const rising = "rising toward {} °";
export const pairsLeftOut = "Image pairs left out";
export const mapTitle = "Map";
export const aboutMap = "Seen from above, north up. Drag or scroll to move and zoom it.";
export const large = "Large";
export const closer = "Zoom in";
export const farther = "Zoom out";
export const whole = "Whole";
export const rover = "Rover";
export const two = "{} two layers";
export const left = "Left {}";
export const leftLayer = "Left layer from above";
export const right = "Right {}";
export const rightLayer = "Right layer from above";
export const pointAtMap = "Point at the map to read every layer there; click to choose the footfall.";
