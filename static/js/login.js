// Logging in. All text goes in as text; the password goes nowhere but into the one request.

import { ROOT } from "./api.js";
import { $ } from "./dom.js";
import { asksToStop, hearEverywhere } from "./stopkeys.js";
import { stopIsConfirmed, stopIsUnconfirmed } from "./stopwish.js";
import * as texts from "./texts/login.js";
import * as shared from "./texts/shared.js";
import { wearKept } from "./themes.js";

wearKept();

if (stopIsUnconfirmed()) $("why").textContent = texts.stopEnded;
else if (location.search === "?ended") $("why").textContent = texts.ended;
stopIsConfirmed(); // nobody who logs in later is to stop by this

// Who presses them here must not believe that the rover stops.
hearEverywhere((event) => {
  if (asksToStop(event)) $("answer").textContent = texts.noStopHere;
});

const REASONS = {
  expired: texts.expired,
  refused: texts.refused,
  unproven: texts.unproven,
  unreachable: texts.unreachable,
  unreadable: texts.unreadable,
  taken: texts.taken,
  "no-role": texts.noRole,
};
const reason = REASONS[new URLSearchParams(location.search).get("sign-on")];
if (reason) $("answer").textContent = reason;

fetch(`${ROOT}/login/ways`).then((answer) => answer.json()).then(({ provider }) => {
  if (!provider) return;
  $("provider").textContent = new URL(provider).host;
  $("elsewhere").hidden = false;
}, () => {});

// Who is logged in already, or need not, has nothing to do here.
fetch(`${ROOT}/me`).then((answer) => { if (answer.ok) location.replace("/"); }, () => {});

$("name").focus();
$("form").addEventListener("submit", async (event) => {
  event.preventDefault();
  const button = $("form").querySelector("button");
  button.disabled = true;
  $("answer").textContent = "";
  const why = await logIn($("name").value, $("password").value);
  button.disabled = false;
  if (!why) return location.replace("/");
  $("answer").textContent = why;
  $("password").value = "";
  $("password").focus();
});

// "" where it succeeded, else what stands against it
async function logIn(name, password) {
  try {
    const headers = { "Content-Type": "application/json" };
    const answer = await fetch(`${ROOT}/login`, { method: "POST", headers, body: JSON.stringify({ name, password }) });
    if (answer.ok) return "";
    const { detail } = await answer.json();
    return `${detail[0].toUpperCase()}${detail.slice(1)}.`;
  } catch {
    return shared.notAnswering;
  }
}
