// Timeline: the whole session on one line, to scrub through; what was planned, seen, sent and noted can be looked at again.

import { ROOT, get, once, post } from "../api.js";
import { act } from "../acts.js";
import { followCursor, moment, point } from "../cursor.js";
import { $, attempt, element, toast } from "../dom.js";
import { describe, events, subscribeToEvents, when as dated } from "../events.js";
import { signOf } from "../eventsigns.js";
import { KINDS } from "../kinds.js";
import { showMoment } from "../scene.js";
import { known, now as clockNow } from "../store.js";
import * as plan from "../texts/plan.js";
import * as texts from "../texts/record.js";
import * as shared from "../texts/shared.js";
import { WORN, ink } from "../themes.js";
import { timeAxis } from "../timeaxis.js";
import { mark as markOf } from "./plan.js";

const RANGE = 10000; // steps of the slider
const RETRY = 1000; // ms
const NEAR = 0.012; // of the line: a click this close to a sign means that event

let axis = null;
let at = -1; // index of the event that is read out, -1: none
let now = true; // the line's end is shown, and goes on as events come
let sceneAt = null; // number of the event after which the scene shows how things were; null: how they are
/** @type {number | null | undefined} */
let sceneTold = NaN; // of which the server was told; NaN: of nothing yet, undefined: its answer did not come
let telling = false;

export function start() {
  $("timeline-scrub").addEventListener("input", () => scrub(Number($("timeline-scrub").value) / RANGE));
  $("timeline-scrub").addEventListener("click", () => { if (at >= 0 && !now && nearSign() && canShow(events[at])) show(events[at]); });
  const some = () => (events.length ? "" : texts.noEvents);
  act({ key: ",", text: texts.eventBefore, button: "timeline-back", run: () => step(-1), refusal: some });
  act({ key: ".", text: texts.eventAfter, button: "timeline-on", run: () => step(1), refusal: some });
  act({ text: texts.showWhatItWas, button: "timeline-show", run: () => show(events[at]), refusal: () => (at >= 0 && canShow(events[at]) ? "" : texts.chooseEvent) });
  act({ text: texts.sceneThen, button: "timeline-scene", run: () => showInScene(sceneAt === null), refusal: () => (now ? texts.chooseMoment : "") });
  act({ text: texts.backToNow, button: "timeline-now", run: toNow, refusal: () => (isNow() ? texts.isNow : "") });
  act({ key: "Y", text: texts.writeNote, button: "note-open", run: openNote });
  $("note-form").addEventListener("submit", (event) => {
    event.preventDefault();
    writeNote();
  });
  $("note-cancel").addEventListener("click", () => $("note").close());
  subscribeToEvents(() => { lay(); });
  $("scene").addEventListener("load", () => { // another one knows of no past
    sceneTold = NaN;
    tellScene();
  });
  document.addEventListener(WORN, paint);
  followCursor(() => {
    paint();
    $("timeline-now").disabled = isNow();
  });
  new ResizeObserver(paint).observe($("timeline-canvas").parentElement);
}

function lay() {
  axis = timeAxis(events.map(({ time }) => time), events.map(({ type }) => type.startsWith("command_")));
  $("timeline-scrub").disabled = events.length === 0;
  if (now) {
    atItsEnd();
    return;
  }
  $("timeline-scrub").value = String(Math.round(axis.placeOf(moment()) * RANGE));
  paint();
}

function scrub(place) {
  if (place >= 1) {
    toNow();
    return;
  }
  now = false;
  const nearest = events.findLastIndex((_, i) => axis.placeOfKnot(i) <= place + NEAR / 2);
  read(Math.max(0, nearest));
  point(axis.timeAt(place));
}

function step(by) {
  const next = Math.min(events.length - 1, Math.max(0, (at < 0 ? events.length : at) + by));
  now = false;
  $("timeline-scrub").value = String(Math.round(axis.placeOfKnot(next) * RANGE));
  read(next);
  point(events[next].time);
}

// A moment that was pointed at in a plot is shown there until it is left, whatever happens meanwhile.
const isNow = () => now && moment() === null;

function toNow() {
  now = true;
  point(null);
  atItsEnd();
}

function atItsEnd() {
  showInScene(false);
  $("timeline-scrub").value = String(RANGE);
  read(events.length - 1);
  paint();
}

function read(index) {
  at = index;
  const event = events[index];
  const when = now ? texts.nowLatest : event && texts.past(Math.max(0, clockNow() - event.time));
  $("timeline-text").textContent = event ? `${when} ${dated(event.time)} ${describe(event)}` : texts.noEvents;
  $("timeline-text").dataset.state = now ? "none" : "warn";
  $("timeline-scrub").setAttribute("aria-valuetext", $("timeline-text").textContent);
  $("timeline-text").title = $("timeline-text").textContent;
  $("timeline-now").disabled = isNow();
  if (sceneAt !== null) showInScene(true);
  $("timeline-show").disabled = !event || !canShow(event);
}

const nearSign = () => Math.abs(axis.placeOfKnot(at) - Number($("timeline-scrub").value) / RANGE) < NEAR;

function paint() {
  const canvas = $("timeline-canvas");
  const { clientWidth: width, clientHeight: height } = canvas;
  if (!axis || !width) return;
  const scale = window.devicePixelRatio || 1;
  canvas.width = width * scale;
  canvas.height = height * scale;
  const pen = canvas.getContext("2d");
  pen.scale(scale, scale);
  const place = (share) => 8 + share * (width - 16); // the slider's thumb has 16 px
  pen.fillStyle = ink("well");
  pen.fillRect(0, 0, width, height);
  pen.fillStyle = ink("edge");
  pen.font = "11px system-ui, sans-serif";
  pen.textAlign = "center";
  for (const pause of axis.pauses) pen.fillText("//", place(pause), height / 2 + 4);
  events.forEach((event, i) => {
    const sign = signOf(event);
    if (!sign) return;
    pen.fillStyle = ink(sign.colour);
    pen.fillText(sign.sign, place(axis.placeOfKnot(i)), 12 + sign.height * 11);
  });
  const pointed = moment();
  const x = place(pointed === null ? 1 : axis.placeOf(pointed));
  pen.fillStyle = ink("strong");
  pen.fillRect(x - 1, 0, 2, height);
}

// -- the scene as it was ---------------------------------------------------------------------

function showInScene(then) {
  sceneAt = then && at >= 0 ? events[at].seq : null;
  notePast(sceneAt !== null ? texts.sceneIsPast(dated(events[at].time)) : sceneTold === undefined ? texts.sceneMayBePast : "");
  tellScene();
}

function notePast(text) {
  $("past-note").hidden = !text;
  $("past-note").textContent = text;
  $("timeline-scene").setAttribute("aria-pressed", String(sceneAt !== null));
}

// The newest alone: who scrubs asks for many. What is not shown is not said to be; that now is shown is asked for until it is.
async function tellScene() {
  if (telling) return;
  telling = true;
  while (sceneTold !== sceneAt) {
    const wanted = sceneAt;
    try {
      await showMoment(wanted);
      sceneTold = wanted;
      if (sceneAt === null) notePast("");
    } catch (error) {
      sceneTold = undefined;
      if (wanted !== null) toast(error.message);
      if (sceneAt === wanted) sceneAt = null;
      if (sceneAt === null) notePast(texts.sceneMayBePast);
      if (wanted === null) await new Promise((done) => setTimeout(done, RETRY));
    }
  }
  telling = false;
}

// -- what it was -----------------------------------------------------------------------------

const canShow = ({ type, payload }) => type === "note" || type === "snapshot_taken" || (type === "product" && KINDS[payload.kind]?.shown);

const show = (event) => attempt(async () => {
  const { type, payload } = event;
  const body = type === "note" ? [element("p", { textContent: payload.text })]
    : type === "snapshot_taken" ? snapshot(payload)
      : answer(await get(`/sessions/current/${KINDS[payload.kind].shown}/${payload.digest}`));
  $("shown-title").textContent = `${dated(event.time)} ${describe(event)}`;
  $("shown-body").replaceChildren(...body);
  $("shown").show();
  $("shown").focus();
});

const snapshot = ({ digest, pairs }) => [element("ul", { className: "thumbs" }, ...pairs.map((pair) => element("li", {}, element("figure", {},
  element("img", { alt: shared.leftCamera(pair), src: `${ROOT}/sessions/${encodeURIComponent(known.summary.id)}/images/${encodeURIComponent(pair)}/left.png?of=${digest}` }),
  element("figcaption", { textContent: pair })))))];

const answer = ({ status, reason, checks }) => [
  element("p", { className: status === "found" ? "yes" : "no", textContent: plan.ended(status, reason) }),
  element("table", {}, element("caption", { textContent: shared.checks }), element("tbody", {}, ...checks.map((check) => element("tr", {},
    element("td", { className: markOf(check), textContent: check.name }),
    element("td", { textContent: plan.marginOf(check) }),
    element("td", { textContent: check.where }))))),
];

// -- notes -----------------------------------------------------------------------------------

function openNote() {
  $("note").show();
  $("note-text").focus();
}

const writeNote = () => attempt(async () => {
  await post("/sessions/current/notes", { text: $("note-text").value }, once());
  $("note-text").value = "";
  $("note").close();
});
