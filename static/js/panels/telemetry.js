// Telemetry: any channel over time, with its limits; what is stale is hatched; a click sets the moment that all panels share.

import uPlot from "../../vendor/uplot/uPlot.esm.js";
import { act } from "../acts.js";
import { followCursor, moment, point } from "../cursor.js";
import { $, element, fixed } from "../dom.js";
import { earlier } from "../earlier.js";
import { clock } from "../events.js";
import { bare } from "../figures.js";
import { isShown, reveal } from "../layout.js";
import { inside, paintMoment, range } from "../plots/paint.js";
import { nearest } from "../plots/series.js";
import { channelsOf, heardFrom, since } from "../samples.js";
import { STALE_AFTER, known, subscribe } from "../store.js";
import * as shared from "../texts/shared.js";
import * as texts from "../texts/telemetry.js";
import { ink } from "../themes.js";
import { shortName } from "./legs.js";

const QUANTITIES = Object.fromEntries(Object.entries(texts.QUANTITIES).filter(([, { onlyRecorded }]) => !onlyRecorded));
const NEAR = 0.8; // share of a limit from which on a number is marked
const HEIGHT = 130;
const PERIOD = 190; // ms; faster than five times a second nobody reads
const LINES = [["line-1", []], ["line-2", [8, 4]], ["line-3", [2, 3]], ["line-4", [12, 3, 2, 3]], ["line-5", [5, 2]], ["line-6", [14, 6]]];

let drawnAt = 0;
let plot = null;
let drawnFor = ""; // what the plot is of
let held = null; // [start, end] of what is held still
let hidden = new Set(); // names of channels that are switched off
let newest = null;

export function start() {
  $("plot-quantity").append(...Object.entries(QUANTITIES).map(([value, { title }]) => element("option", { value, textContent: title })));
  $("plot-leg").append(element("option", { value: "", textContent: texts.chosenLeg }),
    ...known.robot.legs.map((leg) => element("option", { value: String(leg), textContent: shared.leg(leg) })));
  for (const id of ["plot-quantity", "plot-leg", "plot-span"]) $(id).addEventListener("change", () => draw(known));
  act({ key: "Q", text: texts.holdPlot, button: "plot-hold", run: hold });
  for (const [quantity, { title }] of Object.entries(QUANTITIES)) {
    act({ text: texts.plot(title), run: () => { $("plot-quantity").value = quantity; reveal("telemetry"); draw(known); } });
  }
  new ResizeObserver(resize).observe($("plot"));
  followCursor(() => { plot?.redraw(false); draw(known); });
  subscribe((state) => {
    if (performance.now() - drawnAt > PERIOD) draw(state);
  });
}

const now = () => Date.now() / 1000;
const wanted = () => {
  const quantity = $("plot-quantity").value;
  const leg = $("plot-leg").value === "" ? known.summary?.view.leg ?? 0 : Number($("plot-leg").value);
  return { quantity, channels: channelsOf(quantity, leg) };
};

function hold() {
  held = held ? null : [now() - Number($("plot-span").value), now()];
  $("plot-hold").setAttribute("aria-pressed", String(Boolean(held)));
  $("plot-hold").textContent = held ? texts.goOn : shared.hold;
  draw(known);
}

function draw({ frame }) {
  if (!isShown("telemetry")) return;
  drawnAt = performance.now();
  $("plot-leg").disabled = !QUANTITIES[$("plot-quantity").value].ofLeg;
  const begin = held ? held[0] : now() - Number($("plot-span").value);
  const { quantity, channels } = wanted();
  const before = frame ? earlier(channels, Number($("plot-span").value)) : { found: [[]], why: "" };
  const data = joined(before.found, since(begin, channels), begin);
  const end = held ? held[1] : now();
  if (held) while (data[0].length && data[0].at(-1) > end) data.forEach((column) => column.pop());
  const silent = data[0].length ? end - data[0].at(-1) : Infinity;
  newest = { start: begin, end };
  const past = frame && isPast() && data[0].length ? texts.numbersOf(clock(data[0][readAt(data[0])])) : "";
  const note = !frame ? shared.noTelemetry
    : held ? texts.held
      : silent > STALE_AFTER ? texts.hatched
        : before.why ? texts.noEarlier(before.why)
          : data[0][0] < heardFrom() ? texts.shaded : "";
  $("plot-note").className = past || silent > STALE_AFTER ? "doubt" : "";
  $("plot-note").textContent = [past, note].filter(Boolean).join(" ");
  $("plot").hidden = $("plot-series").hidden = !frame;
  if (!frame) return;
  build(quantity, channels);
  plot.setData(withGaps(data), false);
  plot.setScale("x", { min: begin, max: end });
  drawList(channels, data);
}

// What this page did not hear comes before what it did, as far as it is in the plot.
function joined(before, own, begin) {
  const from = before[0].findIndex((time) => time >= begin);
  return from < 0 ? own : own.map((column, j) => [...before[j].slice(from), ...column]);
}

// A line must not lead over what was not heard.
function withGaps(data) {
  const gaps = data[0].flatMap((time, i) => (i > 0 && time - data[0][i - 1] > STALE_AFTER ? [i] : []));
  if (!gaps.length) return data;
  return data.map((column, j) => {
    const parts = [];
    let from = 0;
    for (const i of gaps) {
      parts.push(...column.slice(from, i), j === 0 ? column[i - 1] + 0.001 : null);
      from = i;
    }
    return [...parts, ...column.slice(from)];
  });
}

function build(quantity, channels) {
  const key = JSON.stringify(channels.map(({ at }) => at));
  if (plot && key === drawnFor) return;
  drawnFor = key;
  hidden = new Set();
  plot?.destroy();
  const axis = { stroke: () => ink("quiet"), grid: { stroke: () => ink("line"), width: 1 }, ticks: { stroke: () => ink("line") }, font: "11px system-ui, sans-serif" };
  plot = new uPlot({
    width: Math.max(200, $("plot").clientWidth), height: HEIGHT, legend: { show: false },
    cursor: { drag: { x: false, y: false }, points: { show: false } },
    scales: { x: { time: true, auto: false }, y: { range: (_, low, high) => range(channels.filter(({ name }) => !hidden.has(name)), low, high) } },
    axes: [{ ...axis, size: 28, space: 62, values: (_, times) => times.map(clock) }, { ...axis, size: 54, space: 22, values: (_, marks) => marks.map(bare), label: [...new Set(channels.map(({ unit }) => unit))].join(", "), labelSize: 16, labelFont: axis.font }],
    series: [{}, ...channels.map(({ name }, i) => ({ label: name, stroke: () => ink(LINES[i % LINES.length][0]), dash: LINES[i % LINES.length][1], width: 1.5 }))],
    hooks: { drawAxes: [shade, hatch], draw: [limits, (made) => paintMoment(made, moment())], ready: [(made) => made.over.addEventListener("click", () => point(made.posToVal(made.cursor.left, "x")))] },
  }, [[], ...channels.map(() => [])], $("plot"));
}

// What was heard before this page was loaded, up to where it began to hear.
function shade(made) {
  const [first] = made.data[0];
  if (!newest || !(first < heardFrom())) return;
  inside(made, (pen, { top, height }) => {
    const [from, to] = [Math.max(first, newest.start), heardFrom()].map((time) => made.valToPos(time, "x", true));
    pen.fillStyle = `${ink("line")}88`;
    pen.fillRect(from, top, to - from, height);
    pen.strokeStyle = ink("quiet");
    pen.setLineDash([2, 4]);
    pen.strokeRect(to, top, 0, height);
  });
}

function hatch(made) {
  const times = made.data[0];
  if (!newest || !times.length) return;
  // what was before anything was heard is not known, and is left blank
  const heard = [Math.max(newest.start, Math.min(heardFrom(), times[0])), ...times, newest.end];
  inside(made, (pen, { top, height }) => {
    pen.strokeStyle = `${ink("warn")}66`;
    pen.lineWidth = 1;
    for (let i = 1; i < heard.length; i += 1) {
      if (heard[i] - heard[i - 1] <= STALE_AFTER) continue;
      const [from, to] = [heard[i - 1], heard[i]].map((time) => made.valToPos(time, "x", true));
      pen.save();
      pen.beginPath();
      pen.rect(from, top, to - from, height);
      pen.clip();
      pen.beginPath();
      for (let x = from - height; x < to; x += 10) {
        pen.moveTo(x, top + height);
        pen.lineTo(x + height, top);
      }
      pen.stroke();
      pen.restore();
    }
  });
}

function limits(made) {
  const { channels } = wanted();
  inside(made, (pen, { left, width }) => {
    pen.setLineDash([3, 5]);
    pen.lineWidth = 1;
    channels.forEach((channel, i) => {
      if (hidden.has(channel.name)) return;
      pen.strokeStyle = ink(LINES[i % LINES.length][0]);
      for (const limit of [channel.low, channel.high]) {
        if (limit === null) continue;
        const y = made.valToPos(limit, "y", true);
        pen.beginPath();
        pen.moveTo(left, y);
        pen.lineTo(left + width, y);
        pen.stroke();
      }
    });
  });
}

// Whether the shared moment is in the plot: its numbers are told then, not the newest.
const isPast = () => moment() !== null && moment() >= newest.start && moment() <= newest.end;

const readAt = (times) => (isPast() ? nearest(times, moment()) : times.length - 1);

function drawList(channels, data) {
  const i = readAt(data[0]);
  const list = $("plot-series");
  if (list.dataset.of !== drawnFor) {
    list.dataset.of = drawnFor;
    list.replaceChildren(...channels.map(({ name }, j) => {
      const box = element("input", { type: "checkbox", checked: true, onchange: () => toggle(name, j) });
      const line = element("span", { className: "line", ariaHidden: "true" });
      line.style.background = `var(--${LINES[j % LINES.length][0]})`;
      return element("li", {}, element("label", {}, box, line, element("span", { textContent: `${shortName(name)} ` }), element("b")));
    }));
  }
  channels.forEach((channel, j) => {
    const share = shareOf(channel, data[j + 1][i]);
    const box = list.children[j].querySelector("b");
    box.className = share >= 1 ? "no" : share >= NEAR ? "doubt" : "";
    box.textContent = fixed(data[j + 1][i], channel.unit === "m" ? 3 : 1) + (share >= NEAR ? texts.toLimit(share) : "");
  });
}

// How far from the middle of what is allowed towards its end.
function shareOf({ low, high }, number) {
  if (low === null || high === null || number === undefined) return 0;
  return Math.abs(number - (low + high) / 2) / ((high - low) / 2);
}

function toggle(name, j) {
  if (hidden.has(name)) hidden.delete(name);
  else hidden.add(name);
  plot.setSeries(j + 1, { show: !hidden.has(name) });
}

function resize() {
  const width = $("plot").clientWidth;
  if (plot && width > 0) plot.setSize({ width, height: HEIGHT });
}
