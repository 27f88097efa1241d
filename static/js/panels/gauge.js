// Margin: by how much the centre of mass lies inside what the wheels hold; as the rover stands, where the ghost is, and
// at the worst moment of what is planned.

import { act } from "../acts.js";
import { askAgain, get, put } from "../api.js";
import { $, attempt, element } from "../dom.js";
import { footMoveTold } from "../footmoves.js";
import { walkPlayed } from "../pace.js";
import { isAthletes } from "../robot.js";
import { STALE_AFTER, known, subscribe, telemetryAge } from "../store.js";
import * as texts from "../texts/ghost.js";
import * as shared from "../texts/shared.js";

const KEPT_AS = "footfall.outline";
const { OUTLINES, ROWS } = texts;
const [LOW, HIGH] = [-0.2, 1]; // m, ends of the gauge
const PERIOD = 1000; // ms between two questions about the standing rover
const TURN = 0.002; // rad: less is no noise of a sensor
const SIGNS = { good: "●", warn: "▲", bad: "✕", none: "?" };
const AT_ONCE = 4; // courses kept
const ROOM = 420; // px of the scene's height

let outline = "plain";
let stands = null; // what the server said of the standing rover
let about = ""; // what beside the posture that answer is about
let posture = null; // that it is about
let asking = false;
let askedAt = -Infinity;
const courses = new Map(); // digest of a plan or sequence → its margins; null while they are on their way

export function start() {
  if (!isAthletes()) return;
  try {
    const kept = localStorage.getItem(KEPT_AS);
    if (kept in OUTLINES) outline = kept;
  } catch { /* without storage the choice lasts as long as the page */ }
  $("gauge-outlines").append(...Object.entries(OUTLINES).map(([name, text]) => element("label", {},
    element("input", { type: "radio", name: "outline", value: name, checked: name === outline, onchange: () => choose(name) }),
    element("i", { className: `line ${name}`, ariaHidden: "true" }), element("span", { id: `outline-${name}`, textContent: text }))));
  $("gauge-rows").append(...Object.entries(ROWS).map(([name, text]) => element("div", { id: `gauge-${name}`, className: "gauge-row" },
    name === "worst" ? element("button", { type: "button", id: "gauge-go", textContent: text }) : element("span", { textContent: text }),
    element("span", { className: "meter", role: "meter", "aria-label": texts.marginOf(text), "aria-valuemin": LOW, "aria-valuemax": HIGH },
      element("i", { className: "fill" }), element("i", { className: "zero" }), element("i", { className: "least" })),
    element("output", {}))));
  act({ key: ";", text: texts.nextOutline, run: () => {
    const names = Object.keys(OUTLINES);
    choose(names[(names.indexOf(outline) + 1) % names.length]);
  } });
  act({
    text: texts.toWorst, button: "gauge-go", refusal: () => (worstPlayed() ? "" : texts.noMargin),
    run: () => attempt(() => put("/sessions/current/view", { scrub: worstPlayed().moment, show_ghost: true })),
  });
  $("scrub").addEventListener("input", () => draw(known));
  new ResizeObserver(fold).observe($("gauge").parentElement);
  subscribe(draw);
}

// Where there is little room the ground comes first: folded, the gauge says the two numbers that matter. Opened by hand it stays.
let roomy = true;
/** @param {ResizeObserverEntry[]} sizes */
function fold([{ contentRect }]) {
  if (contentRect.height === 0 || roomy === contentRect.height >= ROOM) return;
  roomy = !roomy;
  $("gauge").open = roomy;
}

function choose(name) {
  outline = name;
  /** @type {HTMLInputElement} */ (document.querySelector(`#gauge-outlines input[value="${name}"]`)).checked = true;
  try {
    localStorage.setItem(KEPT_AS, name);
  } catch { /* as above */ }
  draw(known);
}

function draw({ summary, frame, plan, sequence }) {
  if (!summary) return;
  look(summary, frame);
  const played = [walkPlayed() && summary.walk, plan?.plan && plan.digest, sequence?.digest].find((digest) => digest === summary.played);
  const chosen = sequence?.commands.length && !walkPlayed() ? sequence.digest : played;
  for (const digest of new Set([played, chosen].filter(Boolean))) fetchCourse(digest, summary.id);
  const asked = chosen && courses.get(chosen);
  drawNow(summary, frame);
  drawGhost(courses.get(played), summary);
  drawWorst(asked, summary);
  $("gauge-sum").textContent = ["now", "worst"].map((name) => `${ROWS[name].toLowerCase()} ${$(`gauge-${name}`).dataset.short}`).join(", ");
  const friction = (asked || stands)?.friction;
  $("outline-friction").textContent = friction ? texts.withFriction(friction) : OUTLINES.friction;
  const notes = [stands?.why[outline], asked?.why[outline]].filter(Boolean);
  $("gauge-note").className = notes.length ? "doubt" : "";
  if (asked?.least > 0) notes.push(texts.asked(asked.conservative ? OUTLINES.conservative : OUTLINES.plain, asked.least));
  $("gauge-note").textContent = [...new Set(notes)].join("; ");
}

// The standing rover is asked about when it has moved, or when the ground, its colours or the commands are others: at most once a second.
function look(summary, frame) {
  const now = `${summary.id} ${summary.dem} ${summary.view.leg} ${summary.maps[summary.view.leg]} ${summary.sequence} ${frame ? loaded(frame) : summary.state}`;
  const moved = frame && (!posture || frame.posture.some((q, i) => Math.abs(q - posture[i]) > TURN));
  if (!frame && !summary.state) {
    stands = null;
    return;
  }
  if (asking || document.hidden || performance.now() - askedAt < PERIOD || (now === about && !moved)) return;
  [asking, askedAt, about, posture] = [true, performance.now(), now, frame?.posture ?? null];
  get("/sessions/current/steadiness")
    .then((answer) => { stands = answer; })
    .catch(() => { stands = null; about = ""; }) // unknown is shown, and it is asked again
    .finally(() => { asking = false; draw(known); });
}

const loaded = ({ wheel_forces: forces }) => {
  const weight = forces.reduce((sum, force) => sum + force[2], 0);
  return forces.map((force) => (force[2] > 0.01 * weight ? 1 : 0)).join("");
};

function fetchCourse(digest, session) {
  if (courses.has(digest)) return;
  courses.set(digest, null);
  while (courses.size > AT_ONCE) courses.delete(courses.keys().next().value);
  get(`/sessions/${encodeURIComponent(session)}/steadiness/${digest}`)
    .then((answer) => { courses.set(digest, answer); draw(known); })
    .catch((error) => {
      courses.set(digest, { failed: error.message, why: {}, known: {} });
      askAgain(() => courses.delete(digest));
      draw(known);
    });
}

function drawNow(summary, frame) {
  if (!stands) return show("now", null, frame ? texts.notKnownYet : texts.noTelemetry);
  const sure = stands.known[outline];
  const old = frame && telemetryAge(frame);
  const doubt = !stands.measured ? texts.notMeasured : old > STALE_AFTER ? texts.stale(old) : "";
  return show("now", sure ? stands.margins[outline] ?? -Infinity : null, sure ? "" : shared.notKnown, doubt, courses.get(known.plan?.digest)?.least);
}

function drawGhost(course, summary) {
  if (!course || course.failed) return show("ghost", null, missing(course, summary));
  const moment = Number($("scrub").value) / 1000;
  const [value, row] = valueAt(course, moment);
  return show("ghost", value, value === null ? shared.notKnown : nameOf(course.digest, row), "", course.least);
}

function drawWorst(course, summary) {
  if (!course || course.failed) return show("worst", null, missing(course, summary));
  const worst = course.worst[outline];
  if (!worst) return show("worst", null, shared.notKnown);
  // while it is carried out the rover is on its way
  const elsewhere = summary.plan_matches_rover.ok === false && summary.gate.state !== "sending" ? texts.notFromHere : "";
  const older = summary.commands_of_another_plan && course.digest === known.sequence?.digest ? texts.ofAnotherPlan : "";
  const doubt = [older, elsewhere].filter(Boolean).join("; ");
  return show("worst", worst.margin ?? -Infinity, nameOf(course.digest, worst.row), doubt, course.least);
}

function missing(course, summary) {
  if (course?.failed) return course.failed;
  if (known.plan && known.plan.digest === summary.played && !known.plan.plan) return shared.planRefused;
  return summary.played || summary.sequence ? texts.workedOut : shared.noPlanShort;
}

const worstPlayed = () => courses.get(known.summary?.played)?.worst?.[outline];

// Between two moments margins go straight; [margin (−∞: nothing holds, null: not known), row].
function valueAt({ moments, rows, margins, known: found }, moment) {
  const at = moments.findIndex((one) => one >= moment);
  const i = at < 0 ? moments.length - 1 : at;
  if (!found[outline]) return [null, rows[i]];
  const [before, after] = [margins[outline][Math.max(i - 1, 0)], margins[outline][i]];
  if (after === null || before === null) return [-Infinity, rows[i]];
  const step = i > 0 ? moments[i] - moments[i - 1] : 0;
  return [step > 0 ? before + ((moment - moments[i - 1]) / step) * (after - before) : after, rows[i]];
}

function nameOf(digest, row) {
  if (digest === known.sequence?.digest) {
    const command = known.sequence.commands[row];
    return texts.inRow(row + 1, command?.phase || command?.name || "–");
  }
  const walk = digest === known.walk?.digest ? walkPlayed() : null;
  if (walk) return `${footMoveTold(walk, row + 1)}, ${walk.phases[row + 1]}`;
  return known.plan?.plan?.phases[row + 1] ?? "";
}

// value: [m]; −∞: nothing holds the rover; null: not known. where: what is read beside it; doubt: why it may not be so.
function show(name, value, where, doubt = "", least = 0) {
  const row = $(`gauge-${name}`);
  const level = value === null ? "none" : value < 0 ? "bad" : value < least ? "warn" : "good";
  const number = value === null ? "" : Number.isFinite(value) ? texts.margin(value) : texts.nothingHolds;
  const share = (one) => 100 * ((Math.min(HIGH, Math.max(LOW, one)) - LOW) / (HIGH - LOW));
  row.dataset.level = level;
  row.dataset.short = `${SIGNS[level]} ${number || where}${doubt ? " ▲" : ""}`;
  row.classList.toggle("stale", Boolean(doubt));
  row.classList.toggle("over", value > HIGH);
  const meter = row.querySelector(".meter");
  const [from, to] = value === null ? [0, 0] : [share(0), share(value)].sort((a, b) => a - b);
  meter.querySelector(".fill").style.cssText = `left:${from}%;width:${to - from}%`;
  meter.querySelector(".zero").style.left = `${share(0)}%`;
  meter.querySelector(".least").style.left = `${share(least)}%`;
  meter.setAttribute("aria-valuenow", value === null || !Number.isFinite(value) ? LOW : Math.min(HIGH, Math.max(LOW, value)));
  meter.setAttribute("aria-valuetext", [number || shared.notKnown, where, doubt].filter(Boolean).join(", "));
  row.querySelector("output").textContent = `${SIGNS[level]} ${[number, where].filter(Boolean).join(", ")}`;
  row.title = doubt;
  const told = row.querySelector(".doubt");
  if (told) told.remove();
  if (doubt) row.append(element("small", { className: "doubt", textContent: doubt }));
}
