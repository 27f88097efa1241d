// The conn: who may move the rover, and what stands against it; who somebody is; whose choices a page shows.

import { age } from "../figures.js";

export const take = "Take the conn";
export const taken = "Somebody holds the conn.";
export const release = "Release the conn";
export const ask = "Request the conn";
export const nobodyElse = "Nobody else holds the conn.";
export const grant = "Grant the conn to whoever requests it";
export const keep = "Keep the conn";
export const notHere = "This page does not hold the conn.";
export const nobodyAsks = "Nobody requests the conn.";
export const heldBy = (who) => `The conn is held by ${who}: request it first.`;
export const silent = (seconds) => `The server has been silent for ${age(seconds)}: what is shown may be out of date.`;
export const epochUnknown = "The rover has not confirmed yet that it refuses delayed messages. It is asked again every second.";

// -- who -------------------------------------------------------------------------------------------

export const page = (id) => `page ${id}`;
export const thisPage = "this page";
export const aProgram = "a program";
export const anotherPage = "another page";
export const another = (one) => `another ${one}`;
export const onTheServer = "on the server";
export const account = (name, where) => `${name} (${where})`;
export const nobody = "nobody";
export const ago = (seconds) => `${age(seconds)} ago: `;
export const asks = (who) => `${who} requests it`;
export const asksHere = (who) => `${who} requests the conn: grant it or keep it in the Commands panel.`;
export const connUnknown = (seconds, who) => `Conn: not known, the server has been silent for ${age(seconds)}. Then: ${who}.`;
export const connFree = "Conn: nobody. Arming takes it.";
export const grantedIn = (who, seconds) => ` ${who} requests the conn; granted automatically in ${seconds} s.`;
export const connOf = (who, wait) => `Conn: ${who}.${wait}`;

export const ThisPage = "This page";
export const inTheScene = "in the scene";
export const onAnotherPage = "on another page";
export const somebodyInTheScene = "Somebody in the scene";
export const AnotherPage = "Another page";
export const AProgram = "A program";

// -- whose choices ---------------------------------------------------------------------------------

export const showOwnOrHolders = "Show my own choices, or what the conn holder shows";
export const sessionUnknown = "The session is not known yet.";
export const holder = "the conn holder";
export const noHolder = "the conn holder (nobody now: what was chosen last)";
export const holdersChoices = (who) => `⇄ What ${who} shows`;
export const ownAsHolder = "● My own choices, as I hold the conn";
export const own = "● My own choices";
export const notOwn = "This page shows what the conn holder shows: show your own choices first (key _).";

// -- on the page from the beginning -----------------------------------------------------------------

export const aboutWhose = "Whose choices this page shows: leg, layer, ghost, footfall, goal. On your own, no other page's choice changes yours.";
export const none = "Conn: –";
export const takeIt = "Take conn";
export const releaseIt = "Release conn";
export const requestIt = "Request conn";
export const grantIt = "Grant";
export const keepIt = "Keep conn";
