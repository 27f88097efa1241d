// What is in hand: the footfall, a point for the wheel or the chassis, moved by arrow keys here or by its handle in the scene.
// While it is moved, what there is to say of the place is read out; nothing is chosen until it rests, or Enter is pressed.

import { act } from "../acts.js";
import { post, put, request } from "../api.js";
import { $, attempt, element } from "../dom.js";
import { explainKey, heardFirst } from "../keys.js";
import { lacking } from "../rights.js";
import { isAthletes } from "../robot.js";
import { known, subscribe } from "../store.js";
import { refresh, tell } from "../stream.js";
import * as texts from "../texts/footfall.js";
import { isThisPage, whoIs } from "../who.js";
import { computeMaps } from "./ground.js";

const PAUSE = 900; // ms without a key, after which what was moved is chosen
const CALM = 700; // ms without a move, after which the place is read to those who can't see it
const CELLS = 10; // with Shift
const WAYS = { ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowUp: [1, 1], ArrowDown: [1, -1], PageUp: [2, 1], PageDown: [2, -1] };

let taken = null; // {what, index} that this page took in hand
let wanted = null; // the newest place, not yet sent
let sending = null; // the promise that ends when nothing is left to send
let setting = Promise.resolve(); // the latest choice that is on its way
let pausing = 0;
let calming = 0;
let drawn = "";

export function start() {
  act({ key: "A", text: texts.takeInHand, run: next, refusal: () => lacking($("hand-footfall")) || (things().length ? "" : texts.nothingToMove) });
  act({ text: texts.moveFootfall, button: "hand-footfall", run: () => take({ what: "footfall", index: 0 }), refusal: () => (known.summary?.footfall ? "" : texts.chooseFirst) });
  act({ text: texts.previewMove, button: "hand-chassis", run: () => take({ what: "chassis", index: 0 }), refusal: () => (known.summary?.state && known.summary.dem ? "" : texts.nothingToPlanFrom) });
  act({ text: texts.setInHand, button: "hand-set", run: () => attempt(settled), refusal: notMine });
  act({ text: texts.putBack, button: "hand-back", run: putBack, refusal: notMine });
  explainKey(texts.arrowKeys, texts.aboutArrows);
  explainKey(texts.enterEscape, texts.aboutEnter);
  heardFirst(heard);
  subscribe(draw);
}

const hand = () => known.summary?.hand ?? null;
const isSame = (one, other) => Boolean(one && other) && one.what === other.what && one.index === other.index;
const notMine = () => (taken ? "" : texts.nothingInHand);

function things() {
  const summary = known.summary;
  if (!summary) return [];
  return [
    ...(summary.footfall ? [{ what: "footfall", index: 0 }] : []),
    ...(summary.points?.points ?? []).map((_, index) => ({ what: "point", index })),
    ...(summary.state && summary.dem && isAthletes() ? [{ what: "chassis", index: 0 }] : []),
  ];
}

function next() {
  const all = things();
  const at = all.findIndex((one) => isSame(one, taken));
  if (at === all.length - 1) putBack();
  else take(all[at + 1]);
}

export const take = (thing) => attempt(async () => {
  await settled();
  tell({ hand: (await put("/sessions/current/hand", thing)).hand });
  taken = thing;
  draw(known);
  $("hand").focus({ preventScroll: true }); // Enter is its own there, not that of the button that was pressed
});

function heard(event) {
  if (!taken || event.target.closest?.("input, [role=radiogroup], #picture")) return false;
  if (event.key === "Escape") {
    putBack();
    return true;
  }
  if (event.key === "Enter" && !event.target.closest?.("button, a, summary")) {
    attempt(settled);
    return true;
  }
  const isElsewhere = event.target.closest?.("[data-moves], .plot-lines"); // arrow keys there are that one's
  const way = isElsewhere ? undefined : WAYS[event.key];
  const place = wanted ?? hand()?.place;
  if (!way || event.ctrlKey || event.metaKey || event.altKey || !place || way[0] >= place.length) return false;
  const step = known.summary.terrain.resolution * (event.shiftKey ? CELLS : 1);
  wanted = place.map((at, axis) => at + (axis === way[0] ? way[1] * step : 0));
  send();
  clearTimeout(pausing);
  pausing = setTimeout(() => attempt(settled), PAUSE);
  return true;
}

// Only the newest place is sent while one is under way: moving never queues up.
function send() {
  sending ??= attempt(async () => {
    while (wanted) {
      const place = wanted;
      const { hand: told } = await put("/sessions/current/hand", { ...taken, place });
      if (wanted === place) wanted = null;
      if (taken) tell({ hand: told });
    }
  }).finally(() => {
    sending = null;
    wanted = null; // where it was refused, what is in hand is where the server has it
  });
}

// What was moved here is chosen: by Enter, after a pause, and before anything that would look at the choice. One after the
// other: Enter at the end of the pause would choose the same place twice, and take two undos.
export function settled() {
  clearTimeout(pausing);
  setting = setting.catch(() => {}).then(set); // whoever asked before was told of its failure
  return setting;
}

async function set() {
  await sending;
  if (!taken || !hand()?.moved) return;
  const { what } = taken;
  try {
    tell({ hand: (await post("/sessions/current/hand/commit", {})).hand });
  } catch (error) {
    await refresh();
    if (!hand()?.refused) throw error; // that is read out where it is in hand
    return;
  }
  await refresh();
  if (what === "chassis") await computeMaps(); // the colours follow the chassis
}

const putBack = () => attempt(async () => {
  clearTimeout(pausing);
  wanted = null;
  taken = null;
  await sending;
  tell({ hand: (await request("DELETE", "/sessions/current/hand")).body.hand });
});

function draw({ summary }) {
  if (!summary) return;
  const now = hand();
  // put down or taken over by somebody, or there is no such thing any more
  if (taken && !(isSame(taken, now) && isThisPage(now.by))) taken = null;
  const key = JSON.stringify([now, Boolean(taken)]);
  if (key === drawn) return;
  drawn = key;
  $("hand").hidden = !now;
  $("hand-acts").hidden = !taken;
  if (!now) return;
  const { read } = now;
  const mood = read.good === null ? "doubt" : read.good ? "yes" : "no";
  const whose = taken ? texts.inHand : texts.moves(whoIs(now.by));
  $("hand-title").textContent = texts.handTold(whose, now.what === "point" ? texts.point(now.index + 1) : now.what, now.moved ? texts.notSetYet : "");
  $("hand-read").replaceChildren(
    ...(now.refused ? [element("p", { className: "no", textContent: texts.refused(now.refused) })] : []),
    element("p", { className: mood, textContent: read.text }),
    ...read.reasons.map((reason) => element("p", { className: mood === "yes" ? "" : mood, textContent: reason })),
  );
  $("hand-layers").hidden = read.lines.length === 0;
  $("hand-lines").replaceChildren(...read.lines.map((line) => element("li", { textContent: line })));
  clearTimeout(calming);
  calming = setTimeout(() => { $("hand-said").textContent = [now.refused, read.text, ...read.reasons].filter(Boolean).join(". "); }, CALM);
}
