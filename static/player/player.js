// Plays a recorded session from what the file carries that this is put into. All of it goes in as text.

import { fixed } from "../js/figures.js";
import {
  aboutSession, chosenEvent, commandsTold, eventAt, fromAbove, marginOf, noCommands, noStop, noStepPlanned, pauseIt, planFound, planOf, planRefused, playIt, shareOf, stateOf,
} from "../js/texts/player.js";
import { THEMES, ink, theme, wear, wearKept } from "../js/themes.js";
import { readable } from "../js/words.js";

const story = readable(JSON.parse(document.getElementById("story").textContent));
/** @type {(id: string) => any} whatever kind of element has that id */
const $ = (id) => document.getElementById(id);
const PLAY_SECONDS = 6;

function element(tag, text, className) {
  const made = document.createElement(tag);
  made.textContent = text;
  if (className) made.className = className;
  return made;
}

function row(...cells) {
  const made = document.createElement("tr");
  made.append(...cells);
  return made;
}

const clock = (time) => new Date(time * 1000).toISOString().slice(0, 19).replace("T", " ");

wearKept();
$("theme").append(...THEMES.map((name) => element("option", name)));
$("theme").value = theme();
$("theme").addEventListener("change", () => { wear($("theme").value); draw(); });

$("name").textContent = story.name;
$("about").textContent = aboutSession(story.robot, story.events.length, story.software);

// Who presses the stop keys of the operator's page here must not believe that the rover stops.
let lastEscape = -Infinity;
window.addEventListener("keydown", (event) => {
  const twice = event.key === "Escape" && event.timeStamp - lastEscape < 700;
  if (event.key === "Escape") lastEscape = event.timeStamp;
  if (!twice && !((event.ctrlKey || event.metaKey) && event.key === ".")) return;
  event.preventDefault();
  $("no-stop").hidden = false;
  $("no-stop").textContent = noStop;
}, true);

// -- timeline --------------------------------------------------------------------------------

$("place").max = String(story.events.length - 1);
$("events").append(...story.events.map((event) => {
  const made = element("li", eventAt(clock(event.time), event.text));
  made.value = event.seq;
  return made;
}));

function goTo(index) {
  const at = Math.min(story.events.length - 1, Math.max(0, index));
  const event = story.events[at];
  $("place").value = String(at);
  $("event").textContent = chosenEvent(clock(event.time), event.text);
  [...$("events").children].forEach((one, i) => (i === at ? one.setAttribute("aria-current", "true") : one.removeAttribute("aria-current")));
  $("events").children[at].scrollIntoView({ block: "nearest" });
  const latest = story.plans.findLastIndex((plan) => plan.seq <= event.seq);
  if (latest >= 0 && String(latest) !== $("plan").value) choose(latest);
}

$("place").addEventListener("input", () => goTo(Number($("place").value)));
$("back").addEventListener("click", () => goTo(Number($("place").value) - 1));
$("on").addEventListener("click", () => goTo(Number($("place").value) + 1));

// -- plans -----------------------------------------------------------------------------------

let plan = null;
let picture = null;
let playing = 0;

$("plan").append(...story.plans.map((one, i) => {
  const made = element("option", planOf(one.seq, one.leg, one.status));
  made.value = String(i);
  return made;
}));
$("plan").addEventListener("change", () => choose(Number($("plan").value)));
$("scrub").addEventListener("input", draw);
$("play").addEventListener("click", play);

function choose(index) {
  plan = story.plans[index];
  playing = 0;
  $("plan").value = String(index);
  $("scrub").value = "0";
  $("scrub").disabled = $("play").disabled = !plan.swing;
  const figures = plan.figures;
  $("plan-text").className = plan.status === "found" ? "yes" : "no";
  $("plan-text").textContent = figures
    ? planFound(figures)
    : planRefused(plan.status, plan.reason);
  $("checks").tBodies[0].replaceChildren(...plan.checks.map((check) => row(
    element("td", check.name, mark(check)), element("td", check.margin === null ? "–" : marginOf(check.margin, check.unit)), element("td", check.where))));
  $("beside").parentElement.hidden = !plan.swing;
  const map = story.maps[plan.map];
  $("above-text").textContent = fromAbove(map?.title);
  $("legend").replaceChildren(...(map?.legend ?? []).map(({ text, rgb }) => {
    const made = element("li", "");
    const swatch = element("i", "");
    swatch.style.background = `rgb(${rgb.join(" ")})`;
    made.append(swatch, element("span", text));
    return made;
  }));
  picture = null;
  if (map) {
    const image = new Image();
    image.onload = () => { picture = { image, bounds: map.bounds }; draw(); };
    image.src = `data:image/png;base64,${map.png}`;
  }
  draw();
}

// Ground that nobody has seen is no reason against a plan, and none for it either.
function mark({ name, holds, where }) {
  if (!holds) return "no";
  return name === "unknown ground under the path" && where !== "none" ? "doubt" : "yes";
}

function play() {
  if (playing) { playing = 0; draw(); return; }
  const begin = performance.now();
  playing = begin;
  const frame = (now) => {
    if (playing !== begin) return;
    const share = Math.min(1, (now - begin) / (PLAY_SECONDS * 1000));
    $("scrub").value = String(Math.round(share * 1000));
    if (share >= 1) playing = 0;
    else requestAnimationFrame(frame);
    draw();
  };
  requestAnimationFrame(frame);
}

// Where the wheel is: between the two places of its way around a share of the whole.
function wheelAt(share) {
  const { centers, share: shares, along } = plan.swing;
  const next = Math.max(1, shares.findIndex((one) => one >= share));
  const part = shares[next] > shares[next - 1] ? (share - shares[next - 1]) / (shares[next] - shares[next - 1]) : 0;
  const mix = (a, b) => a + part * (b - a);
  return { center: centers[next].map((to, i) => mix(centers[next - 1][i], to)), along: mix(along[next - 1], along[next]) };
}

function draw() {
  if (!plan) return;
  const share = Number($("scrub").value) / 1000;
  $("play").textContent = playing ? pauseIt : playIt;
  $("scrub-read").textContent = shareOf(share);
  drawAbove(share);
  drawBeside(share);
}

function pen(id) {
  const canvas = $(id);
  const made = canvas.getContext("2d");
  made.clearRect(0, 0, canvas.width, canvas.height);
  made.imageSmoothingEnabled = false;
  return made;
}

function line(made, points, style, width) {
  made.strokeStyle = style;
  made.lineWidth = width;
  made.beginPath();
  points.forEach(([x, y], i) => (i ? made.lineTo(x, y) : made.moveTo(x, y)));
  made.stroke();
}

function drawAbove(share) {
  const made = pen("above");
  const { width, height } = made.canvas;
  const [x, y] = plan.footfall;
  const reach = 2.2; // m from the footfall to the edge
  const scale = height / 2 / reach;
  const to = ([east, north]) => [width / 2 + (east - x) * scale, height / 2 - (north - y) * scale];
  if (picture) {
    const [west, south, east, north] = picture.bounds;
    const [left, top] = to([west, north]);
    made.drawImage(picture.image, left, top, (east - west) * scale, (north - south) * scale);
  }
  const [u, v] = to([x, y]);
  for (const [style, thick] of [[ink("ground"), 5], [ink("strong"), 2]]) {
    line(made, [[u - 10, v], [u + 10, v]], style, thick);
    line(made, [[u, v - 10], [u, v + 10]], style, thick);
  }
  if (!plan.swing) return;
  for (const [style, thick] of [[ink("ground"), 5], [ink("strong"), 2]]) line(made, plan.swing.centers.map(to), style, thick);
  const [a, b] = to(wheelAt(share).center);
  made.fillStyle = ink("warn");
  made.strokeStyle = ink("ground");
  made.beginPath();
  made.arc(a, b, 8, 0, 2 * Math.PI);
  made.fill();
  made.stroke();
}

function drawBeside(share) {
  const made = pen("beside");
  if (!plan.swing) return;
  const { width, height } = made.canvas;
  const { centers, along, ground } = plan.swing;
  const known = ground.filter((one) => one !== null);
  const low = Math.min(...known, ...centers.map((one) => one[2] - story.wheel_radius));
  const high = Math.max(...centers.map((one) => one[2] + story.wheel_radius));
  const scale = Math.min((width - 2 * 30) / (along.at(-1) + 2 * story.wheel_radius), (height - 20) / (high - low));
  const to = (s, z) => [30 + (s + story.wheel_radius) * scale, height - 10 - (z - low) * scale];
  line(made, along.flatMap((s, i) => (ground[i] === null ? [] : [to(s, ground[i])])), ink("line-2"), 3);
  line(made, along.map((s, i) => to(s, centers[i][2])), ink("strong"), 2);
  const now = wheelAt(share);
  made.strokeStyle = ink("warn");
  made.lineWidth = 3;
  made.beginPath();
  made.arc(...to(now.along, now.center[2]), story.wheel_radius * scale, 0, 2 * Math.PI);
  made.stroke();
}

// -- commands --------------------------------------------------------------------------------

const states = new Map(story.commands.map((one) => [one.row, one]));
$("commands-text").textContent = story.sequence
  ? commandsTold(story.sequence.rows.length, story.sequence.duration, story.sequence.valid, story.commands.length > 0)
  : noCommands;
$("commands").hidden = !story.sequence;
if (story.sequence) {
  $("commands").tBodies[0].append(...story.sequence.rows.map((one, i) => {
    const state = states.get(i);
    const cells = [i + 1, one.name, one.leg ?? "–", one.phase || "–", fixed(one.duration), state ? stateOf(state.state, state.reason) : "–"];
    return row(...cells.map((text) => element("td", String(text))));
  }));
}

if (story.plans.length) choose(story.plans.length - 1);
else $("plan-text").textContent = noStepPlanned;
goTo(story.events.length - 1);
