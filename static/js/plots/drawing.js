// One plot on a canvas: lines with an axis for each unit, limits, silences, events and the moment that is read.

import uPlot from "../../vendor/uplot/uPlot.esm.js";
import { point } from "../cursor.js";
import { clock, when } from "../events.js";
import { bare } from "../figures.js";
import { ink } from "../themes.js";
import { inside, paintMoment, range } from "./paint.js";

const HEIGHT = 190;
const DAY = 86400; // s
const DASHES = [[], [8, 4], [2, 3], [12, 3, 2, 3], [5, 2], [14, 6]];
const LABEL = 11; // px between the signs of two events

// Colour and dash of the nth line: no two of 36 alike.
export const lineOf = (n) => ({ colour: `line-${(n % 6) + 1}`, dash: DASHES[(n + Math.floor(n / 6)) % 6] });

/**
 * Draws into a box. told: what the plot asks when it draws: channels, pauses, begin and end, events with their signs, moment.
 * @param {HTMLElement} box
 * @param {any[]} channels
 * @param {() => {pauses: number[][], begin: number, end: number, marks: {time: number, sign: string, colour: string}[], at: number?}} told
 * @param {{zoomed: (begin: number, end: number) => void, pointed: (time: number?) => void}} heard
 */
export function drawIn(box, channels, told, heard) {
  const units = [...new Set(channels.map(({ unit }) => unit))];
  const line = { stroke: () => ink("quiet"), ticks: { stroke: () => ink("line") }, font: "11px system-ui, sans-serif" };
  const scaleFor = (unit) => ({ range: (_, low, high) => range(channels.filter((one) => one.unit === unit), low, high) });
  const made = new uPlot({
    width: Math.max(200, box.clientWidth), height: HEIGHT, legend: { show: false },
    cursor: { drag: { x: true, y: false, setScale: false, dist: 5 }, points: { show: false } },
    scales: { x: { time: true, auto: false }, ...Object.fromEntries(units.map((unit) => [unit, scaleFor(unit)])) },
    axes: [
      { ...line, size: 28, space: 72, grid: { stroke: () => ink("line"), width: 1 }, values: (_, times) => times.map(times.at(-1) - times[0] > DAY / 2 ? when : clock) },
      ...units.map((unit, i) => ({
        ...line, scale: unit, side: i === 1 ? 1 : 3, size: 56, space: 22, label: unit, labelSize: 16, labelFont: line.font,
        grid: { show: i === 0, stroke: () => ink("line"), width: 1 }, values: (_, marks) => marks.map(bare),
      })),
    ],
    series: [{}, ...channels.map(({ name, unit }, i) => ({ label: name, scale: unit, stroke: () => ink(lineOf(i).colour), dash: lineOf(i).dash, width: 1.5 }))],
    hooks: {
      drawAxes: [(one) => hatch(one, told())],
      draw: [(one) => { limits(one, channels); events(one, told()); paintMoment(one, told().at); }],
      setSelect: [(one) => {
        const { left, width } = one.select;
        if (!(width > 0)) return;
        heard.zoomed(one.posToVal(left, "x"), one.posToVal(left + width, "x"));
        one.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
      }],
      ready: [({ over }) => {
        const at = ({ offsetX }) => made.posToVal(offsetX, "x");
        over.addEventListener("click", (event) => point(at(event)));
        over.addEventListener("mousemove", (event) => heard.pointed(at(event)));
        over.addEventListener("mouseleave", () => heard.pointed(null));
      }],
    },
  }, [[], ...channels.map(() => [])], box);
  return made;
}

export function resize(made, box) {
  if (box.clientWidth > 0) made.setSize({ width: box.clientWidth, height: HEIGHT });
}

function hatch(made, { pauses }) {
  for (const pause of pauses) {
    const [from, to] = pause.map((time) => made.valToPos(time, "x", true));
    const { left, width } = made.bbox;
    const [first, last] = [Math.max(from, left), Math.min(to, left + width)];
    if (!(last > first)) continue;
    inside(made, (pen, { top, height }) => {
      pen.beginPath();
      pen.rect(first, top, last - first, height);
      pen.clip();
      pen.strokeStyle = `${ink("warn")}66`;
      pen.lineWidth = 1;
      pen.beginPath();
      for (let x = first - height - (first % 10); x < last; x += 10) {
        pen.moveTo(x, top + height);
        pen.lineTo(x + height, top);
      }
      pen.stroke();
    });
  }
}

function limits(made, channels) {
  inside(made, (pen, { left, width }) => {
    pen.setLineDash([3, 5]);
    pen.lineWidth = 1;
    channels.forEach((channel, i) => {
      pen.strokeStyle = ink(lineOf(i).colour);
      for (const limit of [channel.low, channel.high]) {
        if (limit === null) continue;
        const y = made.valToPos(limit, channel.unit, true);
        pen.beginPath();
        pen.moveTo(left, y);
        pen.lineTo(left + width, y);
        pen.stroke();
      }
    });
  });
}

function events(made, { marks }) {
  inside(made, (pen, { top, height }) => {
    let signAt = -Infinity;
    pen.font = `${11 * (window.devicePixelRatio || 1)}px system-ui, sans-serif`;
    pen.textAlign = "center";
    pen.textBaseline = "top";
    for (const { time, sign, colour } of marks) {
      const x = made.valToPos(time, "x", true);
      pen.strokeStyle = pen.fillStyle = ink(colour);
      pen.globalAlpha = 0.6;
      pen.beginPath();
      pen.moveTo(x, top);
      pen.lineTo(x, top + height);
      pen.stroke();
      pen.globalAlpha = 1;
      if (x - signAt < LABEL * (window.devicePixelRatio || 1)) continue;
      signAt = x;
      pen.fillText(sign, x, top);
    }
  });
}
