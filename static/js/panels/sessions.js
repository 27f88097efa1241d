// Sessions: open, check by replay, compare two, take away as a bundle or as a page that plays alone, bring in.

import { ROOT, get, once, patch, post, request } from "../api.js";
import { act } from "../acts.js";
import { loadAnew } from "../anew.js";
import { $, attempt, element } from "../dom.js";
import { isShown, reveal } from "../layout.js";
import { lacking } from "../rights.js";
import { changed, known, subscribe } from "../store.js";
import * as texts from "../texts/sessions.js";

const LOOK_PERIOD = 400; // ms, while a check runs
const LIST_PERIOD = 10_000; // ms, while the list is in sight
const RUNNING = ["queued", "running"];

let listed = null;
let listedAt = -Infinity;
let drawn = "";
let checking = false;
let renaming = null; // { id, form }: the session whose name is being written, and the field for it
const chosen = new Set(); // ids of the sessions to compare

export function start() {
  act({ text: texts.openSample, button: "open-sample", run: () => open({ sample: $("samples").value }), refusal: () => ($("samples").value ? "" : texts.noSamples) });
  act({ text: texts.compare, button: "compare-sessions", run: compare, refusal: () => (chosen.size === 2 ? "" : texts.chooseTwo) });
  act({ text: texts.checkThis, run: () => { reveal("sessions"); check(known.summary.id); }, refusal: () => (checking ? texts.checkRuns : "") });
  act({ text: texts.renameThis, run: () => { reveal("sessions"); rename(known.summary); }, refusal: () => (listed ? lacking($("sessions").querySelector("tr.current [data-needs]")) : texts.noSessions) });
  act({ text: texts.begin, button: "new-session", run: begin });
  $("new-session-form").addEventListener("submit", (event) => event.preventDefault()); // its button acts
  $("import-session").addEventListener("change", bringIn);
  subscribe(({ summary }) => {
    if (!summary) return;
    if (listed && isShown("sessions") && performance.now() - listedAt > LIST_PERIOD) list();
    count(summary);
    const address = `${ROOT}/recordings/${encodeURIComponent(summary.id)}`;
    $("download-bundle").href = `${address}.zip`;
    $("download-page").href = `${address}.html`;
  });
  list();
}

const open = (which) => attempt(async () => {
  await post("/sessions", which, once());
  loadAnew(); // every panel starts anew on the session that is now current
});

const begin = () => {
  const name = $("new-session-name").value.trim();
  if (name) return open({ name });
  reveal("sessions");
  $("new-session-name").focus();
  return undefined;
};

const bringIn = () => attempt(async () => {
  const file = $("import-session").files[0];
  if (!file) return;
  const form = new FormData();
  form.append("file", file);
  $("sessions-note").textContent = texts.reading(file.name);
  try {
    await post("/recordings", form, once());
    loadAnew();
  } finally {
    $("import-session").value = "";
    $("sessions-note").textContent = "";
  }
});

async function list() {
  listedAt = performance.now();
  try {
    listed = await get("/sessions");
  } catch (error) {
    drawn = "";
    $("sessions-note").className = "doubt";
    $("sessions-note").textContent = texts.notListed(error.message);
    setTimeout(list, 5000);
    return;
  }
  const found = JSON.stringify([listed.current, listed.samples, listed.sessions.map(({ events, ...one }) => [one, one.id === listed.current ? null : events])]);
  if (found === drawn || $("panel-sessions").contains(document.activeElement?.closest?.("select, table"))) return; // not under the hands of somebody
  drawn = found;
  $("samples").replaceChildren(...listed.samples.map((name) => element("option", { value: name, textContent: name })));
  draw();
  changed();
}

function draw() {
  const { sessions, current } = listed;
  $("sessions").hidden = sessions.length === 0;
  $("sessions-note").className = "";
  $("sessions-note").textContent = sessions.length ? "" : texts.noSessions;
  const written = renaming?.form.contains(document.activeElement);
  $("sessions").tBodies[0].replaceChildren(...sessions.map((one) => row(one, one.id === current)));
  if (written) renaming.form.elements.name.focus(); // it went along into the new rows
}

// The current session grows while the list stands there.
function count({ id, events }) {
  const cell = $("sessions").querySelector("tr.current td.count");
  if (cell && listed.current === id && cell.textContent !== String(events)) cell.textContent = String(events);
}

// Copies of one session have its name: they are told apart by the end of their ids.
export function toldApart({ id, name }) {
  return listed?.sessions.some((one) => one.name === name && one.id !== id) ? `${name} (${id.slice(-4)})` : name;
}

const moment = (time) => new Date(time * 1000).toISOString().slice(0, 19).replace("T", " ");

function row(one, current) {
  const created = one.created === null ? "" : texts.created(moment(one.created).slice(0, -3));
  const named = renaming?.id === one.id ? renaming.form : element("span", { textContent: `${current ? "▸ " : ""}${toldApart(one)}`, title: one.id });
  const name = element("td", {}, named, element("small", { textContent: `${created} ${one.robot ?? ""}` }), one.latest === null ? null : element("small", { textContent: texts.latest(moment(one.latest)) }));
  if (one.problem) return element("tr", { className: "failing" }, name, element("td", { colSpan: 3, className: "no", textContent: one.problem }));
  const button = (text, run, against = "") => {
    const made = element("button", { type: "button", textContent: text, disabled: Boolean(against), title: against, onclick: run });
    made.setAttribute("aria-label", texts.actOf(text, one.name, one.id));
    return made;
  };
  const box = element("input", {
    type: "checkbox", checked: chosen.has(one.id), ariaLabel: texts.compareThis(one.name, one.id),
    onchange: (event) => {
      if (event.target.checked) chosen.add(one.id);
      else chosen.delete(one.id);
      changed();
    },
  });
  return element("tr", { className: current ? "current" : "", "data-session": one.id }, name,
    element("td", { className: "count", textContent: one.events ?? "–" }),
    element("td", { className: "acts" }, button(texts.open, () => open({ session: one.id }), current ? texts.isOpen : ""), button(texts.check, () => check(one.id), checking ? texts.checkRuns : ""), element("span", { "data-needs": "planner" }, button(texts.rename, () => rename(one)))),
    element("td", {}, element("label", { className: "touch" }, box)));
}

// The name becomes a field in its place: Enter keeps what is written there, Esc leaves it as it was.
function rename({ id, name }) {
  const form = element("form", {}, element("input", { type: "text", name: "name", value: name, ariaLabel: texts.newName(name, id), autocomplete: "off" }));
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    keepName(id, form.elements.name.value);
  });
  form.addEventListener("keydown", (event) => { if (event.key === "Escape") endRenaming(); });
  renaming = { id, form };
  draw();
  form.elements.name.select();
}

const keepName = (id, name) => attempt(async () => {
  const kept = await patch(`/sessions/${encodeURIComponent(id)}`, { name });
  for (const one of listed.sessions) if (one.id === id) one.name = kept.name;
  endRenaming();
  changed();
});

function endRenaming() {
  const { id } = renaming;
  renaming = null;
  draw();
  $("sessions").querySelector(`[data-session="${id}"] [data-needs] button`)?.focus();
}

function say(...parts) {
  $("sessions-answer").replaceChildren(...parts);
}

const line = (className, textContent) => element("p", { className, textContent });

// Recomputes everything that the session recorded, in a worker; commands, telemetry and stop go on meanwhile.
const check = (id) => attempt(async () => {
  if (checking) return;
  checking = true;
  draw();
  try {
    let job = await post(`/recordings/${encodeURIComponent(id)}/check`, {});
    const cancel = element("button", { type: "button", textContent: texts.cancelCheck, onclick: () => attempt(() => request("DELETE", `/jobs/${job.id}`)) });
    while (RUNNING.includes(job.state)) {
      say(line("", texts.checking(id, job.text)), element("progress", { max: 1, value: job.fraction, ariaLabel: texts.progress }), cancel);
      await new Promise((resolve) => setTimeout(resolve, LOOK_PERIOD));
      job = await get(`/jobs/${job.id}`);
    }
    if (job.state === "done") tellCheck(await get(`/recordings/${encodeURIComponent(id)}/check`));
    else say(line("no", texts.notChecked(id, job.error?.message ?? job.state)));
  } finally {
    checking = false;
    draw();
  }
});

function tellCheck({ ok, name, products, problems }) {
  const bad = products.filter(({ verdict }) => !["same", "equal_within", "not_reproducible", "unchecked"].includes(verdict));
  say(line(ok ? "yes" : "no", ok ? texts.same(name, products.length) : texts.differs(name)),
    element("ul", {}, ...problems.map((text) => element("li", { className: "no", textContent: text })),
      ...(bad.length ? bad : products).map(({ kind, verdict, text }) => element("li", {
        className: bad.length ? "no" : "yes", textContent: texts.productTold(kind, verdict.replaceAll("_", " "), text ? `, ${text}` : ""),
      }))));
}

const compare = () => attempt(async () => {
  const [one, other] = chosen;
  const { names, rows } = await get(`/sessions/${encodeURIComponent(one)}/comparison/${encodeURIComponent(other)}`);
  say(element("table", {}, element("caption", { textContent: texts.compared }),
    element("thead", {}, element("tr", {}, ...["", "", ...names].map((text) => element("th", { scope: "col", textContent: text })))),
    element("tbody", {}, ...rows.map(({ what, told, same, text }) => element("tr", { className: same ? "" : "differs" },
      element("td", { textContent: same ? "=" : "≠" }), element("th", { scope: "row", textContent: what }),
      element("td", { textContent: told[0] }), element("td", {}, element("span", { textContent: told[1] }), text ? element("small", { textContent: text }) : null))))));
});
