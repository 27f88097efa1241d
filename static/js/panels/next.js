// Next: one button that says what comes next and does it, with what stands against it, and the verdict on what was made last.
// What sends is a button of its own in the same place, and must be held.

import { act, actOfButton, perform } from "../acts.js";
import { $, toast } from "../dom.js";
import { goWithJob } from "../layout.js";
import { nextThing } from "../nextthing.js";
import { remember } from "../remembered.js";
import { lacking } from "../rights.js";
import { isAthletes, sees } from "../robot.js";
import { changed, known, now, subscribe } from "../store.js";
import * as commands from "../texts/commands.js";
import * as texts from "../texts/next.js";
import * as shared from "../texts/shared.js";
import { armedFor } from "./commands.js";
import { kept } from "./conn.js";
import { gaitTold, nameOf } from "./gait.js";
import { goalTold, picks } from "./goal.js";
import { endTold, loopNow, loopTold } from "./loop.js";
import { verdictOf } from "./outcome.js";
import { unheededPlaces } from "./places.js";
import { standsStopped } from "./status.js";
import { goalMeant, walkTold } from "./walk.js";
import { waitedFor } from "./work.js";

const AWAITED = ["terrain", "photographs", "blend", "clear", "walk", "gait", "described_step", "described_walk", "sequence", "foot_moves", "edit"]; // of these what comes next depends on
const HELD = ["send", "run-resume", "run-next", "loop-on"]; // what makes the rover move is held, never clicked

let here = { button: "", text: texts.waitForServer, about: "", judge: "" };
let meant = ""; // the act that is held down
let focused = ""; // the one of the two buttons that the keyboard was at

export function start() {
  const go = () => perform(actOfButton(here.button));
  const goAsHeld = () => (meant === here.button ? go() : toast(texts.changedMeanwhile));
  act({ text: texts.doNext, button: "next-act", quiet: true, run: go, refusal: () => (HELD.includes(here.button) ? texts.holdButton : against()) });
  for (const type of ["pointerdown", "keydown"]) $("next-hold").addEventListener(type, ({ repeat }) => { if (!repeat) meant = here.button; });
  act({ text: texts.sendNext, button: "next-hold", quiet: true, held: true, run: goAsHeld, refusal: () => (HELD.includes(here.button) ? against() : texts.nothingToSend) });
  remember("walk-until");
  $("walk-until").addEventListener("change", changed);
  // a key that is held on the other button goes on here, and must not act
  $("next-act").addEventListener("keydown", (event) => { if (event.repeat) event.preventDefault(); });
  for (const id of ["next-act", "next-hold"]) $(id).addEventListener("focus", ({ target }) => { focused = target.matches(":focus-visible") ? id : ""; });
  addEventListener("focusin", ({ target }) => { if (!["next-act", "next-hold"].includes(/** @type {Element} */ (target).id)) focused = ""; });
  subscribe(draw);
}

// Why what comes next can't be done now, "" where nothing stands against it.
const against = () => (here.button ? actOfButton(here.button).refusal() : here.about || here.text);

// What is made of a robot's plans that is commanded as a whole; null where its walks are commanded foot move by foot move.
function wholeOf({ to_command: planned, footfall, planned_for: { footfall: stepped } }) {
  if (isAthletes()) return null;
  const isPlanned = footfall && stepped && ["leg", "x", "y"].every((name) => footfall[name] === stepped[name]);
  return { planned, footfall: isPlanned ? null : footfall, sees: sees() };
}

function factsOf({ summary, walk, gait, sequence }) {
  const { gate, walking, terrain, look, run } = summary;
  const walked = walking !== null && walking.done > 0;
  return {
    stopped: standsStopped(known), notCleared: lacking($("stop-clear")) || kept(), gate, making: waitedFor(AWAITED), armed: armedFor(), picking: picks(),
    loop: loopNow(), walking, walk, walked, places: unheededPlaces(), goal: goalTold(), heading: goalMeant().yaw, gait: $("walk-gait").value, look, ground: terrain, now: now(),
    fits: summary.up_to_date.walk?.fits ?? false,
    gaited: gait && { goal: gait.goal, name: nameOf(gait), fits: summary.up_to_date.gait?.fits ?? false },
    whole: wholeOf(summary),
    ready: summary.up_to_date.sequence?.fits && sequence && !summary.commands_carried_out ? commanded(summary) : 0,
    rest: $("walk-until").value === "rest",
    part: gate.state === "sending" && run?.sequence === sequence?.digest ? partOf(sequence, gate.row ?? 0) : "",
  };
}

// Of how many parts of the walk the commands are; of a plan that is commanded as a whole, 1 where they are of the latest.
const commanded = ({ walking, commands_of_another_plan: another }) => (isAthletes() ? walking?.commanded ?? 0 : Number(!another));

// The foot move that a row belongs to.
const partOf = ({ foot_moves: moves }, row) => moves?.findLast((one) => one.first_row <= row)?.text ?? "";

function draw() {
  if (!known.summary) return;
  here = nextThing(factsOf(known));
  $("next-loop").hidden = !loopNow();
  $("next-loop-hold").hidden = here.button === "loop-hold" || loopNow()?.state === "held";
  $("walk-until").parentElement.hidden = Boolean(loopNow());
  const held = HELD.includes(here.button);
  const [shown, other] = held ? ["next-hold", "next-act"] : ["next-act", "next-hold"];
  if ($(shown).textContent !== here.text) Object.assign($(shown), { textContent: here.text, ariaLabel: texts.named(here.text) }); // the panels have buttons of the same names
  $(shown).hidden = false;
  $(other).hidden = true;
  const why = against();
  $(shown).disabled = Boolean(why);
  $(shown).title = why || here.about;
  const told = why || here.about;
  if ($("next-about").textContent !== told) Object.assign($("next-about"), { textContent: told, className: why && here.button ? "doubt" : "hint" });
  const verdict = byItself() ?? failed() ?? endTold(AWAITED) ?? VERDICTS[here.judge]?.(known) ?? ["", ""];
  if ($("verdict").textContent !== verdict[1]) Object.assign($("verdict"), { className: verdict[0], textContent: verdict[1], title: verdict[1] });
  goWithJob(here.button);
  // who goes on by keyboard finds the next thing under the hand
  if (focused && !why && document.activeElement === document.body) $(shown).focus();
}

const CLASSES = { good: "yes", warn: "doubt", busy: "" };

const VERDICTS = {
  walk: ({ walk, summary }) => (summary.up_to_date.walk?.fits === false ? ["doubt", texts.outOfDate(summary.up_to_date.walk.reason)] : walkTold(walk)),
  gait: ({ gait }) => gaitTold(gait),
  sequence({ sequence }) {
    const broken = sequence.rules.find((rule) => !rule.holds);
    if (broken) return ["no", commands.ruleTold(broken)];
    return [sequence.way.doubt ? "doubt" : "yes", texts.commandsTold(sequence.commands.length, sequence.duration, sequence.way.text)];
  },
  run({ summary: { run, gate } }) {
    if (!run) return undefined;
    const at = [(gate.row ?? 0) + 1, run.rows.length];
    if (run.state !== "ended") return gate.waiting ? ["doubt", texts.waitsBefore(...at, gate.why)] : ["", texts.atRow(...at)];
    if (run.outcome !== "done") return ["no", texts.notAsPlanned(run.number, run.reason || run.outcome.replaceAll("_", " "))];
    const [state, text] = verdictOf(run.compared);
    return [CLASSES[state], texts.runTold(run.number, text)];
  },
};

// While the rover walks by itself, what it decided last: what failed is decided over, too.
const byItself = () => (here.judge === "loop" ? loopTold(loopNow()) : undefined);

// What was asked for last and did not come to be: commands that were refused, ground that could not be built. A run that
// was begun since says more, also to a page that was loaded since.
function failed() {
  const job = [...known.jobs.values()].findLast(({ kind }) => AWAITED.includes(kind));
  if (job?.state !== "failed") return undefined;
  return known.summary.run?.queued > job.ended ? undefined : ["no", job.error?.message ?? shared.noReason];
}
