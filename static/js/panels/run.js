// The run: what is being sent, row by row; holding it, going on, giving it up. For the page that holds the conn.

import { act } from "../acts.js";
import { post } from "../api.js";
import { $, age, attempt } from "../dom.js";
import { COMMAND_WORDS as WORDS } from "../events.js";
import { refresh } from "../stream.js";
import { alive, known, silent, subscribe } from "../store.js";
import { kept, unsure } from "./conn.js";

export function start() {
  act({ text: "Send the next row", button: "run-next", held: true, run: () => steer("next"), refusal: () => idle() || kept() || (gate().waiting ? unsure() : "The present row is still under way.") });
  act({ text: "Hold after the present row", button: "run-hold", run: () => steer("hold"), refusal: () => idle() || kept() || (gate().mode === "whole" ? "" : "It waits after the present row already.") });
  act({ text: "Resume: send the rows that are left", button: "run-resume", held: true, run: () => steer("resume"), refusal: () => idle() || kept() || (gate().mode === "steps" ? unsure() : "It goes on already.") });
  act({ text: "Abort: send nothing more", button: "run-abort", run: () => steer("abort"), refusal: () => idle() || kept() });
  subscribe(draw);
}

const gate = () => known.summary.gate;
const idle = () => (known.summary?.gate.state !== "sending" ? "Nothing is being sent." : gate().aborted ? "It was aborted; the present row is carried out." : "");

const steer = (what) => attempt(async () => {
  await post(`/sessions/current/run/${what}`, {});
  await refresh();
});

function draw({ summary }) {
  if (!summary) return;
  $("run-acts").hidden = summary.gate.state !== "sending";
  $("run-state").textContent = alive() ? summary.gate.why : `${age(silent())} ago: ${summary.gate.why || "under way"}`;
}

// How far the rows of the latest run came, where it is of this sequence: row → {state, text, times}.
export function rowStates(summary, sequence) {
  if (!sequence || summary.run?.sequence !== sequence.digest) return new Map();
  return new Map(summary.run.rows.map((one) => [one.row, { state: one.state, text: said(one), times: told(one.times) }]));
}

const WAITING = ["queued", "unsent"]; // since the run began or ended, all alike

const said = ({ state, reason, times }) =>
  `${WORDS[state] ?? state}${WAITING.includes(state) ? "" : ` ${clock(times[state])}`}${reason && state !== "unsent" ? `: ${reason}` : ""}`;

const told = (times) => Object.entries(times).map(([state, at]) => `${WORDS[state] ?? state} ${clock(at)}`).join("\n");

const clock = (seconds) => (seconds ? new Date(seconds * 1000).toISOString().slice(11, 19) : "");
