// The page's composition: fetch what the session holds, follow its stream, let the panels draw.

import { loadAnew } from "./anew.js";
import { get } from "./api.js";
import { startController } from "./controller.js";
import { $, toast } from "./dom.js";
import { startEvents } from "./events.js";
import { listenForKeys } from "./keys.js";
import { loadLayers } from "./layers.js";
import { startLayout } from "./layout.js";
import { startName } from "./onename.js";
import { startPalette } from "./palette.js";
import { startPuck } from "./puck.js";
import { leaveOut } from "./robot.js";
import { startSamples } from "./samples.js";
import { startScene } from "./scene.js";
import { keepStopInSight } from "./stopinsight.js";
import { changed, known } from "./store.js";
import { follow } from "./stream.js";
import * as texts from "./texts/page.js";
import { wearKept } from "./themes.js";
import * as account from "./panels/account.js";
import * as age from "./panels/age.js";
import * as clearances from "./panels/clearances.js";
import * as commands from "./panels/commands.js";
import * as conn from "./panels/conn.js";
import * as execution from "./panels/execution.js";
import * as footfall from "./panels/footfall.js";
import * as gait from "./panels/gait.js";
import * as gauge from "./panels/gauge.js";
import * as ghost from "./panels/ghost.js";
import * as goal from "./panels/goal.js";
import * as ground from "./panels/ground.js";
import * as hand from "./panels/hand.js";
import * as images from "./panels/images.js";
import * as legs from "./panels/legs.js";
import * as loop from "./panels/loop.js";
import * as map from "./panels/map.js";
import * as next from "./panels/next.js";
import * as others from "./panels/others.js";
import * as outcome from "./panels/outcome.js";
import * as places from "./panels/places.js";
import * as plan from "./panels/plan.js";
import * as plots from "./panels/plots.js";
import * as record from "./panels/record.js";
import * as route from "./panels/route.js";
import * as row from "./panels/row.js";
import * as run from "./panels/run.js";
import * as sessions from "./panels/sessions.js";
import * as status from "./panels/status.js";
import * as strip from "./panels/strip.js";
import * as suggest from "./panels/suggest.js";
import * as telemetry from "./panels/telemetry.js";
import * as tether from "./panels/tether.js";
import * as timeline from "./panels/timeline.js";
import * as view from "./panels/view.js";
import * as walk from "./panels/walk.js";
import * as whatIf from "./panels/whatif.js";
import * as whose from "./panels/whose.js";
import * as work from "./panels/work.js";

const PANELS = [work, ground, images, footfall, suggest, map, whatIf, hand, plan, walk, places, loop, gait, tether, goal, route, execution, ghost, strip, gauge, age, view, whose, commands, row, conn, run, outcome, clearances, legs, telemetry, plots, timeline, sessions, record, others, next];

wearKept();

async function start() {
  // before anything that waits for the server: stop works, and says so when nothing answers
  status.start();
  keepStopInSight();
  startName();
  listenForKeys(status.stop);
  startPalette();
  startController();
  startPuck();
  startLayout();
  await account.start();
  const robot = await get("/robot");
  known.robot = { ...robot, legs: Array.from({ length: robot.legs }, (_, leg) => leg) };
  leaveOut();
  startSamples(known.robot);
  startEvents();
  for (const panel of PANELS) panel.start();
  await loadLayers();
  await follow();
  changed();
  setInterval(changed, 1000); // ages grow without any message
  startScene();
}

async function startOrRetry() {
  try {
    await start();
  } catch (error) {
    // where nothing answers, the browser's own page would come in place of this one: there is no stop on that
    const failed = await robotTold();
    do {
      if ($("toast").hidden) toast(texts.tryingAgain(error.message));
      await new Promise((done) => setTimeout(done, RETRY));
    } while (!(await isServed()) || (await isWithoutSession()) || (await isAsBefore(failed)));
    loadAnew();
  }
}

const isServed = () => fetch(location.href).then((answer) => answer.ok, () => false);

// Then there is nothing to show, and a page that is loaded again and again keeps no word of it.
const isWithoutSession = () => get("/sessions/current").then(() => false, (error) => error.status === 404);

// What the server says of the robot: "" where it tells it, else why not.
const robotTold = () => get("/robot").then(() => "", (error) => error.message);

// A robot that can't be shown is shown no better by a page that is loaded again.
const isAsBefore = async (failed) => failed !== "" && (await robotTold()) === failed;

const RETRY = 2000; // ms

startOrRetry();
