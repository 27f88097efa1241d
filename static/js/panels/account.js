// Who is logged in, with which role, and logging out. What the role does not allow is marked, and says so when pressed.

import { act } from "../acts.js";
import { get, logOut } from "../api.js";
import { $, attempt, toast } from "../dom.js";
import { lacking } from "../rights.js";
import { known, now, subscribe } from "../store.js";
import * as texts from "../texts/page.js";

const SOON = 15 * 60; // seconds before its end that a login warns
const CONTROLS = "[data-needs] :is(button, select, input)";

export async function start() {
  known.me = await get("/me");
  act({ text: texts.logOut, button: "log-out", run: () => attempt(logOut), refusal: () => (known.me.accounts ? "" : texts.noLogin) });
  $("log-out").hidden = !known.me.accounts;
  for (const kind of ["click", "submit", "change"]) document.addEventListener(kind, holdBack, true);
  subscribe(draw);
}

function draw() {
  const { name, role, accounts, notice, ends } = known.me;
  const left = ends ? ends - now() : Infinity;
  const ending = left < SOON ? texts.loginEnds(Math.max(0, left)) : "";
  $("status-user").dataset.state = !accounts || ending ? "warn" : "none";
  $("status-user").textContent = accounts ? `${name}, ${role}${ending}` : texts.anyone; // two lines of the bar
  $("status-user").title = accounts ? $("status-user").textContent : notice;
  queueMicrotask(mark); // after the panels, which know nothing of roles
}

function mark() {
  for (const one of document.querySelectorAll(CONTROLS)) {
    const against = lacking(one);
    if (against) Object.assign(one, { disabled: true, title: against });
  }
}

// What came to be enabled since it was drawn, and forms that are sent from the keyboard.
function holdBack(event) {
  const against = event.target.closest?.(CONTROLS) || event.type === "submit" ? lacking(event.target) : "";
  if (!against) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  toast(against);
}

