// A 3-D mouse, read by WebHID where the browser has it: pushed, pulled and turned, it moves the view. Nothing of it is ever sent.
// Its reports are those of 3Dconnexion's devices, as free drivers document them; it was tried with a simulated one.

import { act } from "./acts.js";
import { holdCamera, isAtThePage } from "./camerakeys.js";
import { attempt, toast } from "./dom.js";
import { explainKey } from "./keys.js";
import * as texts from "./texts/controller.js";

// Multi-axis controllers of the two names that the maker has had.
const WANTED = [0x046d, 0x256f].map((vendorId) => ({ vendorId, usagePage: 1, usage: 8 }));
const PUSHED = 100; // of 350, where it counts
// Report 1: to the right, toward the hand, down; in newer devices three turns behind them, as in report 2: tilted toward the
// hand, to the side, clockwise from above. A key of the scene's camera each way, less and more.
const SHIFTS = [["KeyA", "KeyD"], ["KeyW", "KeyS"], ["KeyE", "KeyQ"]];
const TURNS = [["ArrowDown", "ArrowUp"], null, ["ArrowLeft", "ArrowRight"]];

let device = null;
let keys = { shifts: [], turns: [] };

/** @type {() => any} what the browser has of WebHID; undefined where it has none */
const hid = () => /** @type {any} */ (navigator).hid;

export function startPuck() {
  act({ text: texts.connectPuck, run: () => attempt(choose), refusal: () => (hid() ? "" : texts.noHid) });
  explainKey(texts.puck, texts.aboutPuck);
  hid()?.addEventListener("connect", () => attempt(recall));
  hid()?.addEventListener("disconnect", (event) => { if (event.device === device) leave(); });
  if (hid()) attempt(recall);
}

// One that this page was allowed to read before.
async function recall() {
  if (!device) await open((await hid().getDevices())[0]);
}

async function choose() {
  await open((await hid().requestDevice({ filters: WANTED }))[0]);
}

async function open(found) {
  if (!found || device === found) return;
  if (!found.opened) await found.open();
  device = found;
  device.addEventListener("inputreport", hear);
  toast(texts.puckConnected(device.productName));
}

function leave() {
  device = null;
  keys = { shifts: [], turns: [] };
  holdCamera("puck", new Set());
}

function hear({ reportId, data }) {
  if (reportId === 1) keys.shifts = held(SHIFTS, data, 0);
  if (reportId === 2) keys.turns = held(TURNS, data, 0);
  else if (reportId === 1 && data.byteLength >= 12) keys.turns = held(TURNS, data, 6);
  holdCamera("puck", new Set(isAtThePage() ? [...keys.shifts, ...keys.turns] : []));
}

const held = (axes, data, from) => axes.flatMap((axis, i) => {
  const pushed = data.getInt16(from + 2 * i, true);
  return axis && Math.abs(pushed) > PUSHED ? [axis[pushed < 0 ? 0 : 1]] : [];
});
