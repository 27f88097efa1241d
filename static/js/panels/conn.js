// The conn: which page may move the rover, taking it, handing it on. Arming takes it where nobody holds it.

import { act } from "../acts.js";
import { PAGE, post } from "../api.js";
import { $, attempt, toast, untoast } from "../dom.js";
import { refresh } from "../stream.js";
import { LOCAL } from "../who.js";
import { alive, known, silent, subscribe } from "../store.js";
import * as texts from "../texts/conn.js";

const HEARTBEAT = 15_000; // ms; the server waits for six of them

let asked = ""; // the request that was told

export function start() {
  act({ text: texts.take, button: "conn-take", run: () => ask("take"), refusal: () => (holder() ? texts.taken : "") });
  act({ text: texts.release, button: "conn-release", run: () => ask("release"), refusal: notMine });
  act({ text: texts.ask, button: "conn-request", run: () => ask("request"), refusal: () => (!holder() || mine() ? texts.nobodyElse : "") });
  act({ text: texts.grant, button: "conn-grant", run: () => ask("grant"), refusal: unasked });
  act({ text: texts.keep, button: "conn-deny", run: () => ask("deny"), refusal: unasked });
  setInterval(() => {
    if (mine()) post("/sessions/current/conn/heartbeat", {}).catch(() => {}); // what is lost shows in the next summary
  }, HEARTBEAT);
  subscribe(draw);
}

const holder = () => known.summary?.conn.holder ?? null;
export const mine = () => Boolean(holder()) && holder().page === PAGE;
const notMine = () => (mine() ? "" : texts.notHere);
const unasked = () => notMine() || (known.summary.conn.request ? "" : texts.nobodyAsks);

// Why this page may not steer what is being sent; "" where it may. What nobody holds is taken by the act itself.
export const kept = () => (!holder() || mine() ? "" : texts.heldBy(name(holder())));

// Why nothing may go to the rover that this page or the server can't be sure of; "" where nothing is in the way.
export function unsure() {
  if (!alive()) return texts.silent(silent());
  return known.summary?.gate.epoch_known === false ? texts.epochUnknown : "";
}

const ask = (what) => attempt(async () => {
  await post(`/sessions/current/conn/${what}`, {});
  await refresh();
});

// Two pages of one account are told apart by where they are.
function name(who, short = false) {
  const page = who.page ? texts.page(who.page.slice(0, 4)) : "";
  if (who.page === PAGE) return texts.thisPage;
  if (who.name === LOCAL) return !page ? texts.aProgram : short ? texts.anotherPage : texts.another(page);
  if (short) return who.name;
  return texts.account(who.name, [who.client || texts.onTheServer, page].filter(Boolean).join(", "));
}

function draw({ summary }) {
  if (!summary) return;
  const { request } = summary.conn;
  const asks = request && mine();
  const status = $("status-conn");
  const past = alive() ? "" : texts.ago(silent()); // who has it by now is not known
  status.dataset.state = past ? "stale" : asks ? "warn" : mine() ? "good" : "none";
  const told = (short) => past + (!holder() ? texts.nobody : asks ? texts.asks(name(request.by, short)) : name(holder(), short));
  status.textContent = told(true);
  status.title = told(false);
  $("conn-text").textContent = text(request);
  for (const [id, shown] of [["take", !holder()], ["release", mine()], ["request", holder() && !mine()], ["grant", asks], ["deny", asks]]) {
    $(`conn-${id}`).hidden = !shown;
  }
  const asking = asks ? texts.asksHere(name(request.by)) : "";
  if (asking !== asked && asking) toast(asking);
  else if (asking !== asked) untoast(asked);
  asked = asking;
}

function text(request) {
  if (!alive()) return texts.connUnknown(silent(), holder() ? name(holder()) : texts.nobody);
  if (!holder()) return texts.connFree;
  const wait = request ? texts.grantedIn(name(request.by), Math.max(0, Math.ceil(request.granted_in))) : "";
  return texts.connOf(name(holder()), wait);
}
