// The conn: which page may move the rover, taking it, handing it on. Arming takes it where nobody holds it.

import { act } from "../acts.js";
import { PAGE, post } from "../api.js";
import { $, age, attempt, toast, untoast } from "../dom.js";
import { refresh } from "../stream.js";
import { LOCAL } from "../who.js";
import { alive, known, silent, subscribe } from "../store.js";

const HEARTBEAT = 15_000; // ms; the server waits for six of them

let asked = ""; // the request that was told

export function start() {
  act({ text: "Take the conn", button: "conn-take", run: () => ask("take"), refusal: () => (holder() ? "Somebody holds the conn." : "") });
  act({ text: "Release the conn", button: "conn-release", run: () => ask("release"), refusal: notMine });
  act({ text: "Request the conn", button: "conn-request", run: () => ask("request"), refusal: () => (!holder() || mine() ? "Nobody else holds the conn." : "") });
  act({ text: "Grant the conn to who requests it", button: "conn-grant", run: () => ask("grant"), refusal: unasked });
  act({ text: "Keep the conn", button: "conn-deny", run: () => ask("deny"), refusal: unasked });
  setInterval(() => {
    if (mine()) post("/sessions/current/conn/heartbeat", {}).catch(() => {}); // what is lost shows in the next summary
  }, HEARTBEAT);
  subscribe(draw);
}

const holder = () => known.summary?.conn.holder ?? null;
export const mine = () => Boolean(holder()) && holder().page === PAGE;
const notMine = () => (mine() ? "" : "This page does not hold the conn.");
const unasked = () => notMine() || (known.summary.conn.request ? "" : "Nobody requests the conn.");

// Why this page may not steer what is being sent; "" where it may. What nobody holds is taken by the act itself.
export const kept = () => (!holder() || mine() ? "" : `${name(holder())} holds the conn: request it first.`);

// Why nothing may go to the rover that this page or the server can't be sure of; "" where nothing is in the way.
export function unsure() {
  if (!alive()) return `The server is silent for ${age(silent())}: what is shown may be over.`;
  return known.summary?.gate.epoch_known === false ? "The rover has not confirmed yet that what was held back on the way is outdated; it is asked again every second." : "";
}

const ask = (what) => attempt(async () => {
  await post(`/sessions/current/conn/${what}`, {});
  await refresh();
});

// Two pages of one account are told apart by where they are.
function name(who, short = false) {
  const page = who.page ? `page ${who.page.slice(0, 4)}` : "";
  if (who.page === PAGE) return "this page";
  if (who.name === LOCAL) return !page ? "a program" : short ? "another page" : `another ${page}`;
  if (short) return who.name;
  return `${who.name} (${[who.client || "on the server", page].filter(Boolean).join(", ")})`;
}

function draw({ summary }) {
  if (!summary) return;
  const { request } = summary.conn;
  const asks = request && mine();
  const status = $("status-conn");
  const past = alive() ? "" : `${age(silent())} ago: `; // who has it by now is not known
  status.dataset.state = past ? "stale" : asks ? "warn" : mine() ? "good" : "none";
  const told = (short) => past + (!holder() ? "nobody" : asks ? `${name(request.by, short)} requests it` : name(holder(), short));
  status.textContent = told(true);
  status.title = told(false);
  $("conn-text").textContent = text(request);
  for (const [id, shown] of [["take", !holder()], ["release", mine()], ["request", holder() && !mine()], ["grant", asks], ["deny", asks]]) {
    $(`conn-${id}`).hidden = !shown;
  }
  const asking = asks ? `${name(request.by)} requests the conn: grant it or keep it in the Commands panel.` : "";
  if (asking !== asked && asking) toast(asking);
  else if (asking !== asked) untoast(asked);
  asked = asking;
}

function text(request) {
  if (!alive()) return `Conn: not known, the server is silent for ${age(silent())}. Then: ${holder() ? name(holder()) : "nobody"}.`;
  if (!holder()) return "Conn: nobody. Arming takes it.";
  const wait = request ? ` ${name(request.by)} requests the conn; granted automatically in ${Math.max(0, Math.ceil(request.granted_in))} s.` : "";
  return `Conn: ${name(holder())}.${wait}`;
}
