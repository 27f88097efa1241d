// A walk on one strip over the ghost's slider: its foot moves, and along it margin, torque, clearance to spare and the age
// of the ground under its footfalls, each with a press to where it is worst.

import { act } from "../acts.js";
import { askAgain, get } from "../api.js";
import { $, asTyped, element } from "../dom.js";
import { along, footMoveTold, worstOf } from "../footmoves.js";
import { walkPlayed } from "../pace.js";
import { isAthletes } from "../robot.js";
import { known, now, subscribe } from "../store.js";
import * as texts from "../texts/walk.js";
import { ghostTo, shownMoment } from "./ghost.js";

const BAND = 100; // height of one band of the picture, in its own units
const NUMBERS = 24; // at most
const FIGURES = { margin: "▼", torque: "▲", spare: "◆", age: "◷" };
const ACTS = { margin: texts.ghostToMargin, torque: texts.ghostToTorque, spare: texts.ghostToSpare, age: texts.ghostToAge };
const LEAST = { spare: 0.02, age: 60 }; // m and s that are as high as a band, where nothing is more

let drawn = null; // the plan that is on it
let asked = ""; // digest of the walk that the server was last asked about
let told = null; // what it said: what the plan itself does not have
let why = ""; // why it did not say it, until it does
let ageTold = ""; // what is said of the oldest ground

export function start() {
  for (const [name, text] of Object.entries(ACTS)) {
    act({ text, button: `strip-${name}`, refusal: () => (walkPlayed() ? (worst(walkPlayed())[name] ? "" : lacking(name)) : texts.noWalkPlayed), run: () => {
      const plan = walkPlayed();
      ghostTo(along(plan).moments[worst(plan)[name].waypoint]);
    } });
  }
  $("strip-picture").addEventListener("click", (event) => {
    const box = $("strip-picture").getBoundingClientRect();
    ghostTo((event.clientX - box.left) / box.width);
  });
  $("scrub").addEventListener("input", () => pointAt(shownMoment()));
  subscribe(draw);
}

function draw() {
  const plan = isAthletes() ? walkPlayed() : null;
  $("strip").hidden = !plan;
  $("ghost").classList.toggle("of-walk", Boolean(plan));
  if (!plan) return;
  ask(known.walk.digest);
  if (plan !== drawn || isOlder()) show(plan);
  drawn = plan;
  pointAt(shownMoment());
}

// Once for each walk, and again where it was not told; the strip is drawn again with what comes.
async function ask(digest) {
  if (digest === asked) return;
  [asked, told, why, ageTold] = [digest, null, "", ""];
  const [found, refused] = await get(`/sessions/current/walks/${digest}/along`).then((answer) => [answer, ""], (error) => [null, error.message]);
  if (digest !== asked) return; // another walk came meanwhile
  [told, why, drawn] = [found, refused, null];
  if (!found) askAgain(() => { if (digest === asked) asked = ""; });
  draw();
}

function pointAt(moment) {
  $("strip-now").style.left = percent(moment);
}

const percent = (share) => `${asTyped(100 * share)}%`;

// Of each band the waypoint where it is worst and what is said of it; none of what the server has not told yet.
function worst(plan) {
  const found = worstOf(plan);
  if (!told) return found;
  const spare = told.parts.reduce((least, part) => ((part.spare ?? -Infinity) < (least.spare ?? -Infinity) ? part : least), told.parts[0]);
  if (spare) found.spare = { waypoint: spare.waypoint, text: texts.leastSpare(spare.spare), why: spare.between };
  const ages = agesOf();
  if (ages.length) {
    const oldest = ages.indexOf(Math.max(...ages));
    found.age = { waypoint: plan.moves.lastIndexOf(oldest), text: texts.oldestGround(ages[oldest]) };
  }
  return found;
}

// Of each foot move how old the ground is that it comes down on [s]; none where the map does not say when it was seen.
const agesOf = () => (told.newest === null ? [] : told.seen_before.map((before) => before + Math.max(0, now() - told.newest)));
const isOlder = () => ageTold !== "" && texts.oldestGround(Math.max(...agesOf())) !== ageTold;
const isTimeless = () => told !== null && told.newest === null;

function show(plan) {
  const { moments, ends } = along(plan);
  const { least_margin: least = 0, most_torque: most = 1 } = known.walk.provenance.settings ?? {};
  const highest = { margin: Math.max(...plan.margins, 2 * least), torque: Math.max(...plan.torques, 1) };
  for (const [name, limit] of Object.entries({ margin: least / highest.margin, torque: most / highest.torque })) {
    const values = name === "margin" ? plan.margins : plan.torques;
    $(`strip-${name}-line`).setAttribute("points", values.map((value, i) => `${1000 * moments[i]},${heightOf(value / highest[name])}`).join(" "));
    $(`strip-${name}-limit`).setAttribute("y1", heightOf(limit));
    $(`strip-${name}-limit`).setAttribute("y2", heightOf(limit));
  }
  const [spares, ages] = told ? [told.parts.map(({ spare }) => spare), agesOf()] : [[], []];
  highest.spare = Math.max(LEAST.spare, ...spares.filter(Number.isFinite));
  highest.age = Math.max(LEAST.age, ...ages);
  const begins = [0, ...ends];
  $("strip-spare-line").setAttribute("d", stepped(spares.map((spare, i) => [moments[told.parts[i].first], moments[told.parts[i].last], spare]), highest.spare));
  $("strip-age-line").setAttribute("d", stepped(ages.map((value, i) => [begins[i], begins[i + 1], value]), highest.age));
  const found = worst(plan);
  ageTold = found.age?.text ?? "";
  for (const name of Object.keys(FIGURES)) mark(name, found[name], plan, moments, highest[name]);
  const every = Math.ceil(plan.legs.length / NUMBERS);
  $("strip-ticks").replaceChildren(...ends.map((end, number) => tick(end, begins[number], number, plan, every)));
  $("strip-picture").setAttribute("aria-label", texts.strip(plan.legs.length, Object.values(found).map(({ text, waypoint }) => texts.worstIn(text, footMoveTold(plan, waypoint)))));
}

const heightOf = (share) => BAND * (1 - Math.max(0, share));

// Level from one moment to another, for each [from, to, value]; nothing where there is no value.
const stepped = (steps, highest) => steps.map(([from, to, value]) => (value === null ? "" : `M${1000 * from},${heightOf(value / highest)}H${1000 * to}`)).join("");

// The sign at the worst place of a band, and the button that goes there.
function mark(name, at, plan, moments, highest) {
  const [sign, button] = [$(`strip-${name}-mark`), $(`strip-${name}`)];
  sign.hidden = !at;
  button.textContent = `${FIGURES[name]} ${at?.text ?? lacking(name)}`;
  if (!at) return;
  const value = { margin: () => plan.margins[at.waypoint], torque: () => plan.torques[at.waypoint], spare: () => spareAt(at.waypoint), age: () => highest }[name]();
  sign.textContent = FIGURES[name];
  sign.style.left = percent(moments[at.waypoint]);
  sign.style.top = percent(1 - Math.max(0, value / highest));
  sign.title = [at.why, footMoveTold(plan, at.waypoint), plan.phases[at.waypoint]].filter(Boolean).join(", "); // of the button it says what that does
}

const lacking = (name) => (name === "age" && isTimeless() ? texts.noTimes : why || texts.workedOut);

const spareAt = (waypoint) => told.parts.find((part) => part.waypoint === waypoint)?.spare ?? 0;

// The end of a foot move, and its number over it.
function tick(end, begin, number, plan, every) {
  const made = element("i", {}, element("b", { textContent: number < plan.legs.length && number % every === 0 ? String(number + 1) : "" }));
  made.style.left = percent(begin);
  made.style.width = percent(end - begin);
  return made;
}
