// Logging in. All text goes in as text; the password goes nowhere but into the one request.

import { ROOT } from "./api.js";
import { $ } from "./dom.js";
import { asksToStop, hearEverywhere } from "./stopkeys.js";
import { stopIsConfirmed, stopIsUnconfirmed } from "./stopwish.js";
import { wearKept } from "./themes.js";

wearKept();

if (stopIsUnconfirmed()) $("why").textContent = "NO STOP WAS SENT: your login has ended. Log in and ask again, or use another way to stop the rover.";
else if (location.search === "?ended") $("why").textContent = "Your login has ended. Log in again to go on.";
stopIsConfirmed(); // nobody who logs in later is to stop by this

// Who presses them here must not believe that the rover stops.
hearEverywhere((event) => {
  if (asksToStop(event)) $("answer").textContent = "NO STOP WAS SENT: nobody can stop the rover from this page. Log in, or use another way.";
});

const REASONS = {
  expired: "That login took too long, or was not begun in this browser. Try again.",
  refused: "The provider did not let you in.",
  unproven: "What the provider said could not be proven. An admin finds the reason in the log.",
  unreachable: "The provider does not answer. Log in with a local account, or try again.",
  unreadable: "The accounts can't be read; the server's disk needs attention.",
  taken: "Your name can't be used here: it is that of another account. Ask an admin.",
  "no-role": "The provider knows you, but you have no role here. Ask an admin.",
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
    return "The server does not answer.";
  }
}
