// The page's own line for stop requests. A browser opens six requests to one server at a time, and a stop must not wait
// behind them; WebSockets don't count among those. What the line can't bring goes as an ordinary request.

import { PAGE, Problem, ROOT, request } from "./api.js";
import * as texts from "./texts/link.js";
import * as shared from "./texts/shared.js";

const RETRY = 1000; // ms

let line = null; // an open WebSocket, or null
const waiting = []; // who waits for the answers to come, in the order of asking

export function keepLineOpen() {
  const socket = new WebSocket(`${location.origin.replace(/^http/, "ws")}${ROOT}/stop/line`);
  socket.addEventListener("open", () => { line = socket; });
  socket.addEventListener("message", (message) => waiting.shift()?.(JSON.parse(message.data)));
  socket.addEventListener("close", () => {
    if (line === socket) line = null;
    for (const answer of waiting.splice(0)) answer({ fault: texts.lineBroke });
    setTimeout(keepLineOpen, RETRY);
  });
}

// The server answers so where it has no session open: no rover is connected to it.
const NOTHING_TO_STOP = 409;
export const isNothingToStop = (error) => error.status === NOTHING_TO_STOP;

// One stop request; throws where the server has not confirmed it within `patience` ms.
export async function askToStop(patience) {
  if (line?.readyState !== WebSocket.OPEN) return request("POST", "/stop", {}, {}, patience);
  const socket = line;
  const answer = await new Promise((resolve) => {
    waiting.push(resolve);
    socket.send(JSON.stringify({ page: PAGE }));
    setTimeout(() => resolve({ fault: shared.notAnswering }), patience);
  });
  if (!answer.fault) return answer;
  if (answer.kind === "conflict") throw new Problem(NOTHING_TO_STOP, { detail: answer.fault });
  if (line === socket) line = null; // the next request takes the other way
  socket.close();
  throw new Error(answer.fault);
}
