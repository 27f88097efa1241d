// The REST interface, one function for each way of asking. Errors come as problem+json and are thrown as Problem.

export const ROOT = "/api/v1";

export class Problem extends Error {
  constructor(status, body) {
    super(body.detail || body.title || `the server answered ${status}`);
    this.status = status;
    this.body = body;
  }
}

export async function request(method, path, body, headers = {}) {
  const options = { method, headers: { ...headers } };
  if (body instanceof FormData) {
    options.body = body;
  } else if (body !== undefined) {
    options.headers["Content-Type"] = "application/json";
    options.body = JSON.stringify(body);
  }
  let response;
  try {
    response = await fetch(path.startsWith("/api") ? path : ROOT + path, options);
  } catch {
    throw new Problem(0, { detail: "The server does not answer. Nothing was sent." });
  }
  const type = response.headers.get("Content-Type") || "";
  const answer = type.includes("json") ? await response.json() : await response.blob();
  if (!response.ok) throw new Problem(response.status, answer instanceof Blob ? {} : answer);
  return { body: answer, response };
}

export const get = async (path) => (await request("GET", path)).body;
export const post = async (path, body, headers) => (await request("POST", path, body, headers)).body;
export const put = async (path, body) => (await request("PUT", path, body)).body;

// One key for each deliberate act: a repeated request (double click, retry) is the same act.
export const once = () => ({ "Idempotency-Key": crypto.randomUUID() });
