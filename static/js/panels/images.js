// Images: the pairs of the newest snapshot, one of them large, with plan and grid drawn over it. A click on the ground in it
// chooses the footfall there; ticks choose the pairs for the next terrain.

import { act } from "../acts.js";
import { askAgain, get } from "../api.js";
import { choiceText, isTicked, tick } from "../cameras.js";
import { chooseFootfall } from "../choosing.js";
import { $, asTyped, element, toast } from "../dom.js";
import { clock } from "../events.js";
import { cross, lines } from "../imagelines.js";
import { isShown, reveal } from "../layout.js";
import { loadPicture, pictureAt, retryPicture, shownPicture } from "../picture.js";
import { lacking } from "../rights.js";
import { known, now, subscribe } from "../store.js";
import * as texts from "../texts/images.js";
import { picks, setGoal } from "./goal.js";

const { VIEWS } = texts;
const STEP = 8; // px of the image that an arrow key moves the cross; with Shift one

const whatToDo = () => texts.clickOnGround(picks() ? texts.goalOfWalk : texts.footfallOfLeg);

let list = null; // GET images
let listFor = 0;
let [pair, view] = ["", "left"];
let overlay = null;
let overlayFor = "";
let untold = ""; // why the lines were not told the last time
let acceptedFor = null; // what the footfall was drawn as
let at = null; // of the cross [u, v], while it is moved by keys
let asked = 0;
let goingThere = false;
let picking = false; // whether a click sets the goal of the walk, as what stands there says

export function start() {
  $("image-views").append(...Object.entries(VIEWS).map(([name, text]) => choice(`image-${name}`, text, () => show(pair, name))));
  withArrows($("image-views"));
  withArrows($("image-pairs"));
  for (const name of ["image-plan", "image-grid"]) $(name).addEventListener("change", drawLines);
  const picture = $("picture");
  picture.addEventListener("click", (event) => choose(event.detail === 0 ? at : placeOf(event)));
  picture.addEventListener("keydown", moveCross);
  picture.addEventListener("blur", () => { at = null; drawLines(); });
  $("picture-again").addEventListener("click", () => { retryPicture(); draw(known); });
  act({ text: texts.wideOrNarrow, button: "image-wide", run: widen });
  act({ key: "D", text: texts.title, run: goThere, quiet: true });
  for (const [name, text] of Object.entries(VIEWS)) act({ text: texts.view(text.toLowerCase()), run: () => { reveal("images"); show(pair, name); } });
  say(whatToDo());
  subscribe(draw);
}

// Into the row of pairs, where the arrow keys go through them; it may have to be fetched first.
function goThere() {
  reveal("images");
  goingThere = true;
  draw(known);
}

// Shows one pair, wherever the panel was.
export function showPair(name) {
  reveal("images");
  show(name, view);
}

function show(name, what) {
  [pair, view, at] = [name, what, null];
  say(whatToDo());
  draw(known);
}

const side = () => (view === "right" ? "right" : "left");
const size = () => list.pairs.find(({ name }) => name === pair);

// -- one choice of several, with the arrow keys going through them ------------------------------------------------------

const choice = (id, text, run, ...inside) =>
  element("button", { type: "button", role: "radio", id, ariaLabel: text, onclick: run, tabIndex: -1 }, ...(inside.length ? inside : [text]));

const buttons = (group) => [...group.querySelectorAll("[role=radio]")];
const chosenButton = (group) => buttons(group).find((one) => one.ariaChecked === "true");

function mark(group, id) {
  for (const one of buttons(group)) {
    one.ariaChecked = String(one.id === id);
    one.tabIndex = one.id === id ? 0 : -1;
  }
}

function withArrows(group) {
  group.addEventListener("keydown", (event) => {
    const all = buttons(group);
    const from = all.indexOf(event.target);
    const by = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (from < 0 || !by) return;
    event.preventDefault();
    const to = all[(from + by + all.length) % all.length];
    to.click();
    to.focus();
  });
}

// -- what is shown -------------------------------------------------------------------------------------------------------

function draw({ summary }) {
  if (!summary || !isShown("images")) return;
  if (picks() !== picking) say(whatToDo());
  picking = picks();
  if (summary.heardAt !== listFor) readList(summary);
  $("images-box").hidden = !list?.snapshot;
  $("images-note").hidden = Boolean(list?.snapshot);
  if (!list?.snapshot) {
    $("images-note").textContent = list ? texts.noImages : texts.loadingImages;
    return;
  }
  if (!size()) pair = list.pairs[0].name;
  mark($("image-views"), `image-${view}`);
  drawPairs();
  if (goingThere) chosenButton($("image-pairs")).focus();
  goingThere = false;
  drawAge(summary);
  loadPicture(list.snapshot, pair, view);
  readLines(summary);
}

async function readList(summary) {
  listFor = summary.heardAt;
  try {
    const found = await get("/sessions/current/images");
    const other = found.snapshot !== list?.snapshot;
    list = found;
    if (other) draw(known);
  } catch (error) {
    if (!list) $("images-note").textContent = texts.notListed(error.message);
  }
}

let pairsFor = "";

function drawPairs() {
  const wanted = `${list.snapshot} ${list.pairs.map(({ name }) => name).join(" ")}`;
  if (wanted !== pairsFor) {
    pairsFor = wanted;
    $("image-pairs").replaceChildren(...list.pairs.map(({ name }, i) => choice(`pair-${i}`, name, () => show(name, view),
      element("img", { alt: "", src: pictureAt(list.snapshot, name, "left") }), element("span", { textContent: name }))));
    $("image-ticks").replaceChildren(...list.pairs.map(({ name }, i) => {
      const box = element("input", { type: "checkbox", id: `tick-${i}`, onchange: () => tick(name, box.checked) });
      return element("label", { title: texts.buildWith(name) }, box, element("span", { className: "sr-only", textContent: texts.nextTerrainWith(name) }));
    }));
    $("images-left-out").replaceChildren(...Object.entries(list.left_out).map(([name, reason]) =>
      element("li", { className: "doubt", textContent: texts.notUsable(name, reason) })));
  }
  const chosen = list.pairs.findIndex(({ name }) => name === pair);
  mark($("image-pairs"), `pair-${chosen}`);
  list.pairs.forEach(({ name }, i) => { $(`tick-${i}`).checked = isTicked(name); });
  $("image-choice").textContent = choiceText() || texts.allPairs;
}

function drawAge(summary) {
  const { moved, reason } = list.since;
  const when = list.taken === null ? "" : texts.taken(clock(list.taken), now() - list.taken);
  $("picture-about").textContent = $("picture-about").title = texts.snapshotTold(pair, view, list.snapshot.slice(0, 8), when);
  const box = $("picture-age");
  box.dataset.state = moved ? "stale" : moved === null ? "warn" : "good";
  box.textContent = moved ? texts.stale(reason) : moved === null ? texts.staleUnknown(reason) : texts.asInImages;
  $("picture").classList.toggle("stale", moved === true);
  if (summary.snapshot !== list.snapshot) box.textContent = texts.newerLoading;
}

// -- lines over the image ------------------------------------------------------------------------------------------------

async function readLines(summary) {
  const wanted = JSON.stringify([list.snapshot, pair, side(), summary.dem, summary.plan.digest, summary.footfall]);
  if (accepted() !== acceptedFor) drawLines();
  if (wanted === overlayFor) return;
  overlayFor = wanted;
  if (overlay?.pair !== pair || overlay?.side !== side()) overlay = null;
  drawLines();
  try {
    const found = await get(`/sessions/current/images/${encodeURIComponent(pair)}/${side()}/overlay?of=${list.snapshot}`);
    if (wanted === overlayFor) {
      overlay = found;
      if ($("picture-answer").textContent === untold) say(whatToDo());
    }
  } catch (error) {
    if (wanted === overlayFor) {
      overlay = null; // that of before would be wrong
      untold = texts.notDrawn(error.message);
      say(untold, "no");
      askAgain(() => { if (wanted === overlayFor) overlayFor = ""; });
    }
  }
  drawLines();
}

function drawLines() {
  if (!list?.snapshot) return;
  const { width, height } = size();
  $("picture").style.setProperty("--shape", width / height);
  $("picture-lines").setAttribute("viewBox", `-0.5 -0.5 ${width} ${height}`);
  const drawn = { plan: $("image-plan").checked, grid: $("image-grid").checked };
  acceptedFor = accepted();
  $("picture-lines").replaceChildren(...(overlay ? lines(overlay, acceptedFor, drawn) : []), ...(at ? cross(at) : []));
  const chosen = overlay?.footfall;
  list.pairs.forEach(({ name }, i) => {
    const sees = Boolean(chosen?.seen_by.includes(name));
    $(`pair-${i}`).classList.toggle("sees", sees);
    $(`pair-${i}`).title = sees ? texts.inSightOf(name) : name;
  });
  $("picture-seen").textContent = !chosen ? "" : texts.footfallSeen(chosen.leg, chosen.seen);
  $("line-legend").hidden = !overlay?.path.length || !drawn.plan;
}

// As in the scene: what the plan for the footfall says; without one, what the maps say.
function accepted() {
  const { summary, plan } = known;
  const { footfall } = summary;
  const same = plan && footfall && ["leg", "x", "y"].every((name) => plan.footfall[name] === footfall[name]);
  if (same && plan.provenance.parents.dem === summary.dem) return plan.plan !== null;
  return summary.footfall_answer?.acceptable ?? null;
}

// -- choosing the footfall -----------------------------------------------------------------------------------------------

function placeOf(event) {
  const box = $("picture").getBoundingClientRect();
  const { width, height } = size();
  return [((event.clientX - box.left) / box.width) * width - 0.5, ((event.clientY - box.top) / box.height) * height - 0.5];
}

function moveCross(event) {
  const [du, dv] = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowDown: [0, 1], ArrowUp: [0, -1] }[event.key] ?? [0, 0];
  if (!du && !dv) return;
  event.preventDefault();
  const { width, height } = size();
  const step = event.shiftKey ? 1 : STEP;
  const from = at ?? overlay?.footfall?.at ?? [Math.round(width / 2), Math.round(height / 2)];
  at = [Math.min(width - 1, Math.max(0, from[0] + step * du)), Math.min(height - 1, Math.max(0, from[1] + step * dv))];
  drawLines();
}

function say(text, state = "") {
  $("picture-answer").className = state;
  $("picture-answer").textContent = text;
}

async function choose(place) {
  const against = lacking($("picture"));
  if (against) toast(against);
  if (against || !shownPicture()) return;
  if (!place) {
    say(texts.moveCross);
    return;
  }
  const mine = ++asked;
  const [u, v] = place.map((one, i) => asTyped(Math.min([size().width, size().height][i] - 0.5, Math.max(-0.5, one)), 2));
  try {
    const { point, reason } = await get(`/sessions/current/images/${encodeURIComponent(pair)}/${side()}/at?u=${u}&v=${v}&of=${list.snapshot}`);
    if (mine !== asked) return;
    if (!point) {
      say(reason[0].toUpperCase() + reason.slice(1), "no");
      return;
    }
    if (picks()) {
      if (await setGoal(point[0], point[1]) && mine === asked) say(texts.goalSet(point.slice(0, 2)), "yes");
      return;
    }
    const { leg } = known.summary.view;
    if (!(await chooseFootfall(point[0], point[1], leg))) return;
    if (mine === asked) say(texts.footfallSet(leg, point), "yes");
  } catch (error) {
    if (mine === asked) say(error.message, "no");
  }
}

function widen() {
  const wide = $("side").classList.toggle("wide");
  $("image-wide").setAttribute("aria-pressed", String(wide));
}
