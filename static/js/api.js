// The REST interface, one function for each way of asking. Errors come as problem+json and are thrown as Problem.

import { known } from "./store.js";
import * as texts from "./texts/page.js";
import { readable } from "./words.js";

export const ROOT = "/api/v1";

// This page by a name of its own: whoever holds the conn is one page. It outlives a reload, not the tab.
const NAMED_AS = "footfall-page";
export const PAGE = (() => {
  const kept = sessionStorage.getItem(NAMED_AS) ?? Array.from(crypto.getRandomValues(new Uint8Array(12)), (byte) => byte.toString(16).padStart(2, "0")).join("");
  sessionStorage.setItem(NAMED_AS, kept);
  return kept;
})();

// Loaded anew it has another one.
export const forgetName = () => sessionStorage.removeItem(NAMED_AS);

export class Problem extends Error {
  constructor(status, body) {
    super(body.detail || body.title || texts.answered(status));
    this.status = status;
    this.body = body;
  }
}

// What is done here is done to the session that is shown here, whichever is current by now.
function address(path) {
  const shown = known.summary && encodeURIComponent(known.summary.id);
  return ROOT + (shown ? path.replace(/^\/sessions\/current\//, `/sessions/${shown}/`) : path);
}

// Whether whoever is logged in logs out: what is asked meanwhile comes too late, and no login has ended of itself.
let leaving = false;

export async function request(method, path, body, headers = {}, patience = 0) {
  const options = { method, headers: { "FootFall-Page": PAGE, ...headers } };
  if (patience) options.signal = AbortSignal.timeout(patience);
  if (body instanceof FormData) {
    options.body = body;
  } else if (body !== undefined) {
    options.headers["Content-Type"] = "application/json";
    options.body = JSON.stringify(body);
  }
  let response;
  try {
    response = await fetch(path.startsWith("/api") ? path : address(path), options);
  } catch {
    const doubt = method === "GET" ? "" : texts.arrivalUnknown;
    throw new Problem(0, { detail: texts.notAnswering(doubt) });
  }
  if (response.status === 401) location.assign(leaving ? "/login.html" : "/login.html?ended");
  const type = response.headers.get("Content-Type") || "";
  const answer = type.includes("json") ? readable(await response.json()) : await response.blob();
  if (!response.ok) throw new Problem(response.status, answer instanceof Blob ? {} : answer);
  return { body: answer, response };
}

export const get = async (path) => (await request("GET", path)).body;
export const post = async (path, body, headers) => (await request("POST", path, body, headers)).body;
export const patch = async (path, body) => (await request("PATCH", path, body)).body;
export const put = async (path, body) => (await request("PUT", path, body)).body;

export async function logOut() {
  leaving = true;
  try {
    await post("/logout", {});
  } catch (problem) {
    leaving = false;
    throw problem;
  }
  location.assign("/login.html");
}

// What a panel was not told is asked for again after this long, by whoever draws it then.
const RETRY = 5000; // ms
export const askAgain = (forget) => setTimeout(forget, RETRY);

// One key for each deliberate act: a repeated request (double click, retry) is the same act.
export const once = () => ({ "Idempotency-Key": crypto.randomUUID() });
