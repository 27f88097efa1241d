// The server's words as the page shows them. Names, ids, digests and numbers of an answer stay as they are.

import { withSigns } from "./figures.js";

// Members of answers and messages that hold words for a person, alone, listed or by name.
const SAID = new Set([
  "advice", "against", "brief", "detail", "fault", "left_out", "lines", "message", "not_lifted", "notice", "problem", "problems",
  "reason", "reasons", "refused", "text", "told", "unheard", "waits_for", "where", "why",
]);

/** What the server said, its words with true minus signs. Changed in place: a walk's numbers are many. */
export function readable(answer, words = false) {
  if (typeof answer === "string") return words ? withSigns(answer) : answer;
  if (typeof answer !== "object" || answer === null || (Array.isArray(answer) && typeof answer[0] === "number")) return answer;
  for (const [name, item] of Object.entries(answer)) answer[name] = readable(item, words || SAID.has(name));
  return answer;
}
