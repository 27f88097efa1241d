// One row of the commands, chosen in the list: its joints, its place, split in two, a pause before it, deleted.

import { act } from "../acts.js";
import { $, asTyped, element } from "../dom.js";
import { edit, editTyped, isOnItsWay } from "../edits.js";
import { jointsOf, slides } from "../robot.js";
import { known, subscribe } from "../store.js";
import * as texts from "../texts/commands.js";
import { shortName } from "./legs.js";

const listeners = [];
let chosen = null; // row, from 0
let drawn = "";
let shown = null; // the row that the fields are of

export function start() {
  const last = () => known.sequence.commands.length - 1;
  act({ text: texts.rowUp, button: "row-up", run: () => move(-1), refusal: () => none() || (chosen > 0 ? "" : texts.isFirst) });
  act({ text: texts.rowDown, button: "row-down", run: () => move(1), refusal: () => none() || (chosen < last() ? "" : texts.isLast) });
  act({ text: texts.splitRow, button: "row-split", run: () => edit({ kind: "split", row: chosen }), refusal: none });
  act({ text: texts.waitBefore, button: "row-wait", run: () => edit({ kind: "insert", row: chosen, command: { name: "WAIT", duration: 1.0 } }), refusal: none });
  act({ text: texts.copyRow, button: "row-copy", run: copy, refusal: none });
  act({ text: texts.deleteChosen, button: "row-delete", run: () => edit({ kind: "delete", row: chosen }), refusal: none });
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

// To be changed into another command: joint by joint, or its seconds.
async function copy() {
  const row = chosen;
  const { name, leg, joints, duration, phase, force } = known.sequence.commands[row];
  if (await edit({ kind: "insert", row: row + 1, command: { name, leg, joints, duration, phase, force } })) choose(row + 1);
}

async function move(by) {
  const from = chosen;
  if (await edit({ kind: "move", row: from, to: from + by })) choose(from + by);
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
  $("row-joints").replaceChildren(...(command.joints ?? []).map((angle, joint) => jointField(command, row, joint, angle)));
}

function jointField(command, row, joint, angle) {
  const { joint_names: names, lower, upper } = known.robot;
  const whole = command.leg === null ? joint : jointsOf(command.leg)[joint];
  const name = command.leg === null ? `${known.robot.legs.find((leg) => jointsOf(leg).includes(whole))} ${shortName(names[whole])}` : shortName(names[whole]);
  return element("label", { textContent: `${name} `, title: texts.range(lower[whole], upper[whole], slides(whole)) },
    element("input", {
      type: "number", step: "any", value: asTyped(angle, 4), ariaLabel: texts.jointOfRow(name, row + 1, slides(whole)),
      onchange: ({ target }) => {
        target.blur();
        drawn = "";
        editTyped(target, asTyped(angle, 4), (number) => ({ kind: "joint", row, joint, number }));
      },
    }));
}
