// What executions and exports can be asked for with, as the server tells it; asked for once.

import { get } from "./api.js";

let asked = null;

export const choices = () => (asked ??= get("/choices").catch((error) => {
  asked = null; // the next who asks tries again
  throw error;
}));
