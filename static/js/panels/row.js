// One row of the commands, chosen in the list: its joints, its place, split in two, a pause before it, deleted.

import { act } from "../acts.js";
import { $, asTyped, element } from "../dom.js";
import { edit, editTyped, isOnItsWay } from "../edits.js";
import { jointsOf, slides } from "../robot.js";
import { changed, known, subscribe } from "../store.js";
import * as texts from "../texts/commands.js";
import { shortName } from "./legs.js";

const WAIT = { name: "WAIT", duration: 1.0 };
const listeners = [];
let chosen = null; // row, from 0
let drawn = "";
let shown = null; // the row that the fields are of

export function start() {
  const last = () => known.sequence.commands.length - 1;
  act({ text: texts.rowUp, button: "row-up", run: () => move(-1), refusal: () => none() || (chosen > 0 ? "" : texts.isFirst) });
  act({ text: texts.rowDown, button: "row-down", run: () => move(1), refusal: () => none() || (chosen < last() ? "" : texts.isLast) });
  act({ text: texts.splitRow, button: "row-split", run: () => edit(() => ({ kind: "split", row: meant() })), refusal: none });
  act({ text: texts.waitBefore, button: "row-wait", run: () => edit(() => ({ kind: "insert", row: meant(), command: WAIT })), refusal: none });
  act({ text: texts.copyRow, button: "row-copy", run: copy, refusal: none });
  act({ text: texts.deleteChosen, button: "row-delete", run: () => deleteRow(chosen, known.sequence.digest), refusal: none });
  subscribe(draw);
}

const none = () => (chosenRow() === null ? texts.chooseRow : "");

// The row that is worked with, null where there is none.
export function chosenRow() {
  return chosen !== null && chosen < (known.sequence?.commands.length ?? 0) ? chosen : null;
}

// row: from 0, or null.
export function choose(row) {
  chosen = row;
  listeners.forEach((listener) => listener());
  draw();
}

// Called when another row is chosen.
export const onChoice = (listener) => listeners.push(listener);

// The row that is worked with when an edit's turn has come: one before it may have moved it.
function meant() {
  if (chosenRow() === null) throw new Error(texts.chooseRow);
  return chosen;
}

// To be changed into another command: joint by joint, or its seconds.
async function copy() {
  let row;
  const made = await edit(() => {
    row = meant() + 1;
    const { name, leg, joints, duration, phase, force } = known.sequence.commands[row - 1];
    return { kind: "insert", row, command: { name, leg, joints, duration, phase, force } };
  });
  if (made) choose(row);
}

async function move(by) {
  let to;
  const made = await edit(() => {
    to = meant() + by;
    return { kind: "move", row: to - by, to };
  });
  if (made) choose(to);
}

// of: the version in whose list the row was pointed at.
export async function deleteRow(row, of) {
  if (await edit({ kind: "delete", row }, of)) goAlong(row + 1, -1);
}

export async function waitFirst() {
  if (await edit({ kind: "insert", row: 0, command: WAIT })) goAlong(0, 1);
}

// Rows from that one on have other numbers now: what is worked with stays the same row.
function goAlong(from, by) {
  if (chosen === null || chosen < from) return;
  chosen += by;
  changed();
}

function draw() {
  const row = chosenRow();
  $("row-edit").hidden = row === null;
  const key = JSON.stringify([known.sequence?.digest, row]);
  // not under the hands of somebody who types
  if (row === null || key === drawn || $("row-joints").contains(document.activeElement) || (isOnItsWay() && row === shown)) return;
  drawn = key;
  shown = row;
  const command = known.sequence.commands[row];
  $("row-title").textContent = texts.rowTold(row + 1, command.name, known.sequence.legs[row], command.phase);
  $("row-joints").replaceChildren(...(command.joints ?? []).map((angle, joint) => jointField(known.sequence, row, joint, angle)));
}

function jointField({ commands, digest }, row, joint, angle) {
  const command = commands[row];
  const { joint_names: names, lower, upper } = known.robot;
  const whole = command.leg === null ? joint : jointsOf(command.leg)[joint];
  const name = command.leg === null ? `${known.robot.legs.find((leg) => jointsOf(leg).includes(whole))} ${shortName(names[whole])}` : shortName(names[whole]);
  return element("label", { textContent: `${name} `, title: texts.range(lower[whole], upper[whole], slides(whole)) },
    element("input", {
      type: "number", step: "any", value: asTyped(angle, 4), ariaLabel: texts.jointOfRow(name, row + 1, slides(whole)),
      onchange: ({ target }) => {
        target.blur();
        drawn = "";
        editTyped(target, asTyped(angle, 4), (number) => ({ kind: "joint", row, joint, number }), digest);
      },
    }));
}
