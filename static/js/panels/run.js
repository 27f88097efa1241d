// The run: what is being sent, row by row; holding it, going on, giving it up. For the page that holds the conn.

import { act } from "../acts.js";
import { post } from "../api.js";
import { $, attempt } from "../dom.js";
import { refresh } from "../stream.js";
import { alive, known, silent, subscribe } from "../store.js";
import * as texts from "../texts/commands.js";
import { kept, unsure } from "./conn.js";

export function start() {
  act({ text: texts.nextRow, button: "run-next", held: true, run: () => steer("next"), refusal: () => idle() || kept() || (gate().waiting ? unsure() : texts.rowUnderWay) });
  act({ text: texts.hold, button: "run-hold", run: () => steer("hold"), refusal: () => idle() || kept() || (gate().mode === "whole" ? "" : texts.waitsAlready) });
  act({ text: texts.resume, button: "run-resume", held: true, run: () => steer("resume"), refusal: () => idle() || kept() || (gate().mode === "steps" ? unsure() : texts.goesOn) });
  act({ text: texts.abort, button: "run-abort", run: () => steer("abort"), refusal: () => idle() || kept() });
  subscribe(draw);
}

const gate = () => known.summary.gate;
const idle = () => (known.summary?.gate.state !== "sending" ? texts.nothingSent : gate().aborted ? texts.aborted : "");

const steer = (what) => attempt(async () => {
  await post(`/sessions/current/run/${what}`, {});
  await refresh();
});

function draw({ summary }) {
  if (!summary) return;
  $("run-acts").hidden = summary.gate.state !== "sending";
  $("run-state").textContent = alive() ? summary.gate.why : texts.agoWas(silent(), summary.gate.why || texts.underWay);
}

// How far the rows of the latest run came, where it is of this sequence: row → {state, text, times}.
export function rowStates(summary, sequence) {
  if (!sequence || summary.run?.sequence !== sequence.digest) return new Map();
  return new Map(summary.run.rows.map((one) => [one.row, { state: one.state, text: said(one), times: told(one.times) }]));
}

const WAITING = ["queued", "unsent"]; // since the run began or ended, all alike

const said = ({ state, reason, times }) => texts.stateSince(state, WAITING.includes(state) ? "" : clock(times[state]), state === "unsent" ? "" : reason);

const told = (times) => Object.entries(times).map(([state, at]) => texts.stateOf(state, clock(at))).join("\n");

const clock = (seconds) => (seconds ? new Date(seconds * 1000).toISOString().slice(11, 19) : "");
