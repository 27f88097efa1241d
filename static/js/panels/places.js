// What the operator says of the ground for the next plan: places that are forbidden or pinned, ground to keep off, and footfalls
// of the shown walk that a hand moves.

import { act } from "../acts.js";
import { footfallsIn, footfallsOf } from "../abovemarks.js";
import { settled } from "../choosing.js";
import { $, attempt, toast } from "../dom.js";
import { walkOutOfDate } from "../fits.js";
import { areAmong, areHeeded, meantOf, metBy, movedTo, withMoves } from "../footfallmoves.js";
import { explainKey, heardFirst } from "../keys.js";
import { changed, known, subscribe } from "../store.js";
import * as texts from "../texts/walk.js";

const KEPT_AS = "footfall-places";
const LEAST_AREA = 0.05; // m, the radius of ground that is kept off
let said = { forbidden: [], pinned: [] };
let moves = []; // footfalls of the shown walk that a hand moved
let held = null; // the move of the footfall in hand; null: none

export function start() {
  act({ text: texts.keepOffGround, button: "keep-off", run: keepOff, refusal: () => (known.summary?.footfall ? "" : texts.chooseWhatToKeepOff) });
  act({ text: texts.forgetPlaces, button: "walk-places-clear", run: () => say({ forbidden: [], pinned: [] }) });
  for (const [keys, text] of texts.MOVE_KEYS) explainKey(keys, text);
  heardFirst(press);
  subscribe(draw);
}

const keepOff = () => attempt(async () => {
  await settled();
  const radius = Number($("keep-off-radius").value);
  if (!(radius >= LEAST_AREA)) throw new Error(texts.areaTooSmall(LEAST_AREA));
  const { x, y } = known.summary.footfall;
  addPlaces({ forbidden: [{ x, y, radius }], pinned: [] });
});

// What is said of places counts with the next plan.
function say(wanted) {
  said = wanted;
  moves = [];
  tellPlaces();
}

export function addPlaces({ forbidden, pinned }) {
  said = { forbidden: [...said.forbidden, ...forbidden], pinned: [...said.pinned, ...pinned] };
  tellPlaces();
}

// What was moved is of the walk before: it stays said, by its places.
export function settleMoves() {
  recall();
  held = null;
  say(placesSaid());
}

// Pinned places of the shown walk that have had their foot, once so many foot moves of it are made, are not asked for again.
export function forgetMet(made) {
  const met = metBy(known.walk?.provenance.settings?.pinned ?? [], footfallsIn(known.walk?.plan), made);
  const pinned = said.pinned.filter((pin) => !areAmong([pin], met));
  if (pinned.length === said.pinned.length) return;
  said = { ...said, pinned };
  tellPlaces();
}

function tellPlaces() {
  sessionStorage.setItem(KEPT_AS, JSON.stringify({ session: known.summary?.id, said: placesSaid() }));
  markMoved();
  changed();
}

// What was said in this session outlives a reload of the page.
let recalled = false;
function recall() {
  if (recalled) return;
  recalled = true;
  const kept = JSON.parse(sessionStorage.getItem(KEPT_AS));
  if (kept?.session === known.summary.id) said = kept.said;
}

function draw({ summary }) {
  if (!summary) return;
  recall();
  const told = held ? texts.movingTo(held.number + 1, held.to) : placesTold();
  $("walk-places").hidden = !told;
  if ($("walk-places-text").textContent !== told) $("walk-places-text").textContent = told;
}

function placesTold() {
  const told = Object.entries(placesSaid()).filter(([, of]) => of.length).map(([what, of]) => texts.some(of.length, what)).join(", ");
  return told && (areSaidHeeded() ? texts.placesHeeded : texts.placesTold)(told);
}

const areSaidHeeded = () => areHeeded(placesSaid(), known.walk?.provenance.settings);

// What was said of places, in words, as long as the walk was planned without; else "".
export const unheededPlaces = () => (areSaidHeeded() ? "" : placesTold());

// What was said: { forbidden: [{x, y, …}], pinned: [{x, y, leg}] }.
export const placesSaid = () => withMoves(said, moves);

// -- footfalls moved by hand -----------------------------------------------------------------------

// Those that are moved, with the one in hand where it is now.
export const movesShown = () => (held ? movedTo(moves, held) : moves);

// The footfalls of the shown walk, where they are to be.
export const footfallsMeant = () => meantOf(footfallsOf(known), movesShown());

export function takeFootfall({ number, leg, from, at }) {
  held = { number, leg, from, to: at };
  carryFootfall(at);
}

// That of a foot move, and whether there is one: of a walk that is out of date none is moved.
export function takeFootfallOf(number) {
  const found = footfallsMeant()[number];
  if (found) takeFootfall(found);
  else toast(texts.outOfDate(walkOutOfDate(known)));
  return Boolean(found);
}

export function carryFootfall(to) {
  if (!held) return;
  held = { ...held, to };
  changed();
}

// keep: it stays where it was put, and counts with the next plan; else it goes back.
export function letFootfallGo(keep) {
  if (!held) return;
  if (keep) moves = movedTo(moves, held);
  held = null;
  tellPlaces();
}

const [MOVED, MOVED_FINELY] = [0.05, 0.01]; // m a key
const STEPS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

// Keys of a footfall: on its button arrows move it, Enter puts it there; Escape lets go of one in any hand.
function press(event) {
  if (event.key === "Escape" && held) {
    letFootfallGo(false);
    return true;
  }
  const button = event.target.closest?.("[data-moves]");
  if (!button) return false;
  if (event.key === "Enter" && held) {
    letFootfallGo(true);
    return true;
  }
  if (!(event.key in STEPS)) return false;
  const number = Number(button.dataset.moves);
  if (held?.number !== number && !takeFootfallOf(number)) return true;
  const far = event.shiftKey ? MOVED_FINELY : MOVED;
  carryFootfall(held.to.map((one, i) => one + far * STEPS[event.key][i]));
  return true;
}

function markMoved() {
  for (const [number, told] of [...$("walk-answer").querySelectorAll("[data-moved]")].entries()) {
    const move = moves.find((one) => one.number === number);
    told.textContent = move ? texts.movedTo(move.to) : "";
  }
}
