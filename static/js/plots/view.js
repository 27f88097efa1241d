// One plot on the page: its name, its lines, what is read from them, and the channels to choose from.

import { moment } from "../cursor.js";
import { element } from "../dom.js";
import { clock, describe, events, when } from "../events.js";
import { signOf } from "../eventsigns.js";
import { recorded } from "../recorded.js";
import { allChannels, since } from "../samples.js";
import * as texts from "../texts/plots.js";
import { UNITS } from "../texts/telemetry.js";
import { drawIn, lineOf, resize } from "./drawing.js";
import * as kept from "./kept.js";
import { picker, told as inWords } from "./picker.js";
import { joined, nearest } from "./series.js";

const NEAR = 0.01; // of the plot: an event this close to the moment that is read is told
const SETTLED = 200; // ms after which a time that is shown is asked for

/**
 * @param {number} id of the plot
 * @param {(begin: number, end: number) => void} zoomed
 */
export function viewOf(id, zoomed) {
  const plot = () => kept.kept().find((one) => one.id === id) ?? { id, name: "", channels: [] };
  const own = { data: [[]], pauses: [], marks: [], begin: 0, end: 1, pointed: null, asked: null };
  let drawn = null;
  let drawnFor = "";

  const name = /** @type {HTMLInputElement} */ (element("input", { type: "text", className: "plot-name", maxLength: 60 }));
  name.addEventListener("change", () => { kept.rename(id, name.value.trim()); name.value = plot().name; });
  const away = element("button", { type: "button", textContent: texts.remove, onclick: () => kept.remove(id) });
  const picked = picker(plot, (channels) => kept.setChannels(id, channels));
  const box = element("div", { className: "plot-lines", tabIndex: 0, role: "group" });
  const note = element("p", { className: "plot-note", role: "status" });
  const list = element("ul", { className: "plot-read" });
  const event = element("output", { className: "plot-event" });
  const section = element("section", { className: "composed" }, element("div", { className: "row" }, name, picked.box, away), note, box, event, list);
  section.dataset.plot = String(id);
  new ResizeObserver(() => drawn && resize(drawn, box)).observe(box);

  const channels = () => plot().channels.map((one) => allChannels().find((channel) => channel.id === one)).filter(Boolean);

  function label() {
    const { name: called } = plot();
    if (document.activeElement !== name) name.value = called;
    name.ariaLabel = texts.nameLabel(called);
    away.ariaLabel = texts.removeIt(called);
    section.ariaLabel = called;
    box.ariaLabel = texts.about(called);
    list.ariaLabel = texts.readOf(called);
    event.ariaLabel = texts.eventOf(called);
    picked.draw();
  }

  function build(shown) {
    const key = JSON.stringify(shown.map((one) => one.id));
    if (drawn && key === drawnFor) return;
    drawn?.destroy();
    own.pointed = null;
    drawnFor = key;
    drawn = drawIn(box, shown, () => ({ ...own, at: moment() }), {
      zoomed,
      pointed: (time) => { own.pointed = time; read(); },
    });
    list.replaceChildren(...shown.map((channel, i) => {
      const swatch = element("span", { className: "line", ariaHidden: "true" });
      swatch.style.background = `var(--${lineOf(i).colour})`;
      const limited = channel.low !== null || channel.high !== null;
      return element("li", {}, swatch, element("span", { textContent: inWords(channel) }), element("b"),
        limited ? element("small", { textContent: texts.limits(channel.low, channel.high, channel.unit) }) : null);
    }));
  }

  // from, to: what the recordings are asked for; null: their ends.
  function draw({ begin, end, from, to, goesOn, changedAt }) {
    label();
    const shown = channels();
    const others = plot().channels.length - shown.length;
    box.hidden = list.hidden = !shown.length;
    if (!shown.length) {
      note.textContent = others ? texts.otherRobot(others) : texts.noChannels;
      return null;
    }
    build(shown);
    const settled = performance.now() - changedAt > SETTLED;
    const fresh = settled || !own.asked ? recorded(shown, from, to, goesOn) : null;
    // what was answered before stays until the answer is there
    const ofSame = own.asked?.for === drawnFor ? own.asked.answer : null;
    const answer = fresh && (fresh.found[0].length || !fresh.asking || !ofSame) ? fresh : ofSame ?? fresh;
    if (!answer) return null;
    own.asked = { for: drawnFor, answer };
    const { data, pauses } = joined(answer.found, answer.silences, since(begin, shown), begin, end);
    Object.assign(own, { data, pauses, begin, end, marks: marksWithin(begin, end) });
    drawn.setData(data, false);
    drawn.setScale("x", { min: begin, max: end });
    note.textContent = [others ? texts.otherRobot(others) : "", answer.why ? texts.notRead(answer.why) : "", data[0].length || answer.asking || answer.unread ? "" : texts.nothingHere]
      .filter(Boolean).join(" ");
    read();
    return answer;
  }

  const marksWithin = (begin, end) => events.filter(({ time }) => time >= begin && time <= end).flatMap((one) => {
    const sign = signOf(one);
    return sign ? [{ ...sign, time: one.time, of: one }] : [];
  });

  // Which moment is read: the pointed one, else the shared one where it is in sight, else the end.
  function readAt() {
    if (own.pointed !== null) return own.pointed;
    const shared = moment();
    return shared !== null && shared >= own.begin && shared <= own.end ? shared : own.end;
  }

  function read() {
    const at = readAt();
    const i = nearest(own.data[0], at);
    channels().forEach((channel, j) => {
      const value = own.data[j + 1]?.[i];
      const cell = list.children[j]?.querySelector("b");
      if (!cell) return;
      const outside = (channel.low !== null && value < channel.low) || (channel.high !== null && value > channel.high);
      cell.className = typeof value === "number" && outside ? "no" : "";
      cell.textContent = typeof value === "number" ? texts.number(value, channel.unit, UNITS[channel.unit].digits) : "–";
      cell.title = i < 0 ? "" : texts.at(when(own.data[0][i]));
    });
    const near = own.marks.filter(({ time }) => Math.abs(time - at) <= NEAR * (own.end - own.begin))
      .sort((a, b) => Math.abs(a.time - at) - Math.abs(b.time - at));
    event.textContent = near.length ? texts.event(near[0].sign, clock(near[0].time), describe(near[0].of)) : i < 0 ? "" : texts.at(when(own.data[0][i]));
  }

  // The time of the moment before or after the one that is read; null where there is none.
  function neighbour(by) {
    const times = own.data[0];
    for (let i = nearest(times, readAt()) + by; i >= 0 && i < times.length; i += by) {
      if (own.data.slice(1).some((column) => column[i] !== null)) return times[i];
    }
    return null;
  }

  // The shared moment has moved: it is read, until the pointer moves again.
  function redraw() {
    own.pointed = null;
    read();
    drawn?.redraw(false);
  }

  const holds = (target) => target === box;
  const timeAt = (clientX) => (drawn ? drawn.posToVal(clientX - drawn.over.getBoundingClientRect().left, "x") : null);
  const numbers = () => ({ times: own.data[0], columns: own.data.slice(1), pauses: own.pauses, marks: own.marks.map(({ time, sign }) => ({ time, sign })) });
  const end = () => drawn?.destroy();
  return { id, section, box, draw, redraw, neighbour, holds, timeAt, numbers, end };
}
