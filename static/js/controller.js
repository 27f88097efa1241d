// A game controller, as browsers tell of them: it turns the view and moves the ghost. Nothing of it is ever sent.

import { actOfKey, perform } from "./acts.js";
import { holdCamera, isAtThePage } from "./camerakeys.js";
import { toast } from "./dom.js";
import { explainKey } from "./keys.js";
import * as texts from "./texts/controller.js";

const PERIOD = 50; // ms
const PUSHED = 0.5; // of an axis or trigger, where it counts
const AGAIN = 250; // ms: what is held acts again

// Places of the standard layout (W3C Gamepad, "standard"), and the keys of the page's acts that they stand for.
const PLAY = 0; // lowest button of the right cluster
const ACTS = { [PLAY]: " ", 4: "{", 5: "}", 14: "[", 15: "]" }; // 4, 5: shoulders; 14, 15: cross to the left and right
const REPEATING = [14, 15];
// Keys that the scene's camera hears while they are held: sticks, and triggers for down and up.
const AXES = [["KeyA", "KeyD"], ["KeyW", "KeyS"], ["ArrowLeft", "ArrowRight"], ["ArrowUp", "ArrowDown"]];
const TRIGGERS = { 6: "KeyQ", 7: "KeyE" };

const acted = new Map(); // button → when it acted [ms]
let timer = 0;

export function startController() {
  explainKey(texts.controller, texts.aboutController);
  addEventListener("gamepadconnected", begin);
}

function begin({ gamepad }) {
  toast(texts.connected(gamepad.id, gamepad.mapping === "standard"));
  timer ||= setInterval(look, PERIOD);
}

// Only the standard layout is heeded: of another one nobody knows which button is which.
const connected = () => [...navigator.getGamepads()].filter((one) => one?.connected && one.mapping === "standard");

function look() {
  const pads = isAtThePage() ? connected() : [];
  const isPressed = (button) => pads.some((pad) => (pad.buttons[button]?.value ?? 0) > PUSHED);
  const now = performance.now();
  for (const [button, key] of Object.entries(ACTS)) {
    const before = acted.get(button);
    if (!isPressed(Number(button))) acted.delete(button);
    else if (before === undefined || (REPEATING.includes(Number(button)) && now - before >= AGAIN)) {
      acted.set(button, now);
      perform(actOfKey(key));
    }
  }
  const wanted = new Set(Object.entries(TRIGGERS).filter(([button]) => isPressed(Number(button))).map(([, key]) => key));
  for (const pad of pads) {
    AXES.forEach(([less, more], axis) => {
      const pushed = pad.axes[axis] ?? 0;
      if (Math.abs(pushed) > PUSHED) wanted.add(pushed < 0 ? less : more);
    });
  }
  holdCamera("controller", wanted);
  if (![...navigator.getGamepads()].some((one) => one?.connected)) {
    clearInterval(timer);
    timer = 0;
  }
}
