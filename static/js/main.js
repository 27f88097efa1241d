// The page's composition: fetch what the session holds, follow its stream, let the panels draw.

import { get } from "./api.js";
import { $, element, toast } from "./dom.js";
import { bind, listenForKeys, showHelp } from "./keys.js";
import { loadLayers } from "./layers.js";
import { changed, known } from "./store.js";
import { follow } from "./stream.js";
import * as commands from "./panels/commands.js";
import * as footfall from "./panels/footfall.js";
import * as ghost from "./panels/ghost.js";
import * as ground from "./panels/ground.js";
import * as map from "./panels/map.js";
import * as plan from "./panels/plan.js";
import * as record from "./panels/record.js";
import * as status from "./panels/status.js";
import * as suggest from "./panels/suggest.js";
import * as whatIf from "./panels/whatif.js";

async function start() {
  // before anything that waits for the server: stop works, and says so when nothing answers
  status.start();
  listenForKeys(status.stop);
  const robot = await get("/robot");
  known.robot = { ...robot, legs: Array.from({ length: robot.legs }, (_, leg) => leg) };
  for (const panel of [ground, footfall, suggest, map, whatIf, plan, ghost, commands, record]) panel.start();
  await loadLayers();
  bind("?", "This list", showHelp);
  await follow();
  changed();
  setInterval(changed, 1000); // ages grow without any message
  loadScene();
}

async function startOrRetry() {
  try {
    await start();
  } catch (error) {
    toast(`${error.message} Trying again.`);
    setTimeout(() => location.reload(), RETRY);
  }
}

const RETRY = 2000; // ms

// viser's own panel and notices are hidden: the page has its own, and they would cover the ground.
const SCENE_STYLE = "[data-floating-window], .mantine-Notifications-root { display: none !important; }";

function loadScene() {
  const frame = $("scene");
  frame.addEventListener("load", () => {
    $("scene-note").hidden = true;
    frame.contentDocument?.head.append(element("style", { textContent: SCENE_STYLE }));
  });
  // ?fixedDpr=0.5 keeps software rendering bearable; viser reads it from the frame's address.
  frame.src = `/scene/${location.search}`;
}

startOrRetry();
