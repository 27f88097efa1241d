// Sessions: opened, checked, compared, brought in.

export const openSample = "Open the chosen sample";
export const noSamples = "There are no samples.";
export const compare = "Compare two sessions";
export const chooseTwo = "Choose two sessions in the list first.";
export const checkThis = "Check this session by replay";
export const checkRuns = "A check is running.";
export const begin = "Begin a new session";
export const reading = (file) => `Reading ${file}…`;
export const notListed = (why) => `The list can't be read: ${why}`;
export const noSessions = "No session is kept here yet: open a sample, or import one.";
export const created = (time) => `made ${time} UTC`;
export const latest = (time) => `last event ${time} UTC`;
export const open = "Open";
export const isOpen = "This session is open.";
export const check = "Check";
export const rename = "Rename";
export const renameThis = "Rename this session";
export const newName = (name, id) => `New name of ${name}, ${id}: Enter keeps it, Esc does not`;
export const actOf = (act, name, id) => `${act}: ${name}, ${id}`;
export const compareThis = (name, id) => `Compare ${name}, ${id}`;
export const cancelCheck = "Cancel the check";
export const checking = (id, doing) => `Checking ${id}: ${doing}`;
export const progress = "Progress of the check";
export const notChecked = (id, why) => `${id} was not checked: ${why}`;
export const same = (name, count) => `${name}: all ${count} products came out as recorded.`;
export const differs = (name) => `${name} did NOT come out as recorded.`;
export const productTold = (kind, verdict, more) => `${kind}: ${verdict}${more}`;
export const compared = "Compared: what differs is marked ≠";

// -- on the page from the beginning -----------------------------------------------------------------

export const title = "Sessions";
export const sample = "Open a sample {}";
export const importOne = "Import a session{}";
export const newCalled = "New session called {}";
export const beginIt = "Begin";
export const download = "Download this session";
export const asPage = "Download as a page";
export const aboutPage = "One file that plays without a server";
export const loading = "The list is loading.";
export const list = "Sessions of this server";
export const session = "Session";
export const events = "Events";
export const acts = "Acts";
export const compareColumn = "Compare";
export const compareTwo = "Compare the two";
