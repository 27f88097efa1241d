// Channels to choose from, found by words of their name or their unit.

import { element } from "../dom.js";
import { allChannels } from "../samples.js";
import * as texts from "../texts/plots.js";
import * as shared from "../texts/shared.js";
import { QUANTITIES } from "../texts/telemetry.js";
import { MOST_CHANNELS } from "./kept.js";

const SHOWN = 40;

// "leg2_hip_yaw_joint" as a person says it
const inWords = (name) => name.replace(/_joint$/, "").replaceAll("_", " ").replace(/^leg(\d+)/, (_, leg) => shared.leg(leg));

/** A channel as it is listed: quantity, what of it, unit. */
export const told = ({ quantity, name, unit }) => texts.channel(QUANTITIES[quantity].title, inWords(name), unit);

/** Channels whose words and unit begin with each typed word; "°" and "N·m" are units. */
export function found(typed) {
  const words = typed.toLowerCase().split(/\s+/).filter(Boolean);
  return allChannels().filter((channel) => {
    const own = `${told(channel)} ${channel.quantity}`.toLowerCase().split(/[\s[\]:,]+/);
    return words.every((word) => own.some((one) => one.startsWith(word)));
  });
}

/**
 * A field to search with, and below it the channels with a tick each; the chosen ones come first.
 * @param {() => {name: string, channels: string[]}} plot
 * @param {(channels: string[]) => void} choose
 */
export function picker(plot, choose) {
  const field = /** @type {HTMLInputElement} */ (element("input", { type: "search", placeholder: texts.findHint, autocomplete: "off" }));
  const list = element("ul", { className: "channels" });
  const note = element("p", { className: "hint", role: "status" });
  const summary = element("summary");
  let drawn = "";
  const box = element("details", { className: "picker" }, summary, field, list, note);
  const draw = () => {
    const { name, channels } = plot();
    summary.textContent = texts.channels(channels.length);
    field.ariaLabel = texts.find(name);
    list.ariaLabel = texts.listOf(name);
    if (!box.open) return;
    const fitting = found(field.value);
    const isChosen = ({ id }) => channels.includes(id);
    const ordered = [...fitting.filter(isChosen), ...fitting.filter((one) => !isChosen(one))];
    const full = channels.length >= MOST_CHANNELS;
    note.textContent = full ? texts.full(MOST_CHANNELS) : ordered.length > SHOWN ? texts.more(ordered.length - SHOWN) : ordered.length ? "" : texts.none;
    const listed = JSON.stringify([ordered.slice(0, SHOWN).map(({ id }) => id), channels]);
    if (listed === drawn) return; // what is pressed at the moment must not be another tick by then
    drawn = listed;
    const focused = /** @type {HTMLElement} */ (document.activeElement)?.dataset?.channel;
    list.replaceChildren(...ordered.slice(0, SHOWN).map((one) => {
      const tick = element("input", { type: "checkbox", checked: isChosen(one), disabled: full && !isChosen(one) });
      tick.dataset.channel = one.id;
      tick.addEventListener("change", () => choose(tick.checked ? [...plot().channels, one.id] : plot().channels.filter((id) => id !== one.id)));
      return element("li", {}, element("label", {}, tick, element("span", { textContent: told(one) })));
    }));
    if (focused) /** @type {HTMLElement} */ (list.querySelector(`[data-channel="${focused}"]`))?.focus();
  };
  field.addEventListener("input", draw);
  box.addEventListener("toggle", () => { draw(); if (box.open) field.focus(); });
  return { box, draw };
}
