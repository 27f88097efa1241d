// The page as a whole: its acts, keys and palette, what it says of the server, the login that it runs under.

import { age, seconds } from "../figures.js";

// -- acts, keys, palette ---------------------------------------------------------------------------

export const keyTaken = (key, text) => `The key ${key} is already for "${text}".`;
export const listOfKeys = "List of the keys";
export const findAct = "Find an act by its name";
export const escapeTwice = "Esc Esc";
export const space = "Space";
export const noSuchAct = "No act has such a name.";
export const against = (act, why) => `${act}: ${why}`;
export const hold = (time) => `Hold the button for ${seconds(time)}, or choose the act in the palette (Ctrl+K).`;

// -- themes ----------------------------------------------------------------------------

export const theme = (name) => `Theme: ${name}`;

// -- server ----------------------------------------------------------------------------------------

export const answered = (status) => `The server answered ${status}.`;
export const arrivalUnknown = " Whether the request arrived is not known.";
export const notAnswering = (doubt) => `The server does not answer.${doubt}`;
export const tryingAgain = (why) => `Trying again: ${why}`;
export const roverSays = "the rover says: ";
export const linkFault = (who, reason) => `Rover link: ${who}${reason}`;
export const recordSays = (text) => `Record: ${text}`;
export const notRecorded = (count, why) => `The record can't be written, ${count} events wait: ${why}`;
export const recordedAgain = "The record is written again.";

// -- login -----------------------------------------------------------------------------------------

export const needsRole = (needed, own) => `This needs the role ${needed}; you are ${own}.`;
export const logOut = "Log out";
export const noLogin = "Nobody has to log in here.";
export const loginEnds = (left) => `, login ends in ${age(left)}`;
export const anyone = "No login: anyone can command";

// -- what was asked for just before ----------------------------------------------------------------

export const choiceRefused = "Nothing was asked for: your last choice was refused.";
export const planNotMade = "Nothing was made: the plan that you asked for last was not made.";

// -- on the page from the beginning -----------------------------------------------------------------

export const workAreas = "Work areas";
export const layoutTitle = "Layout";
export const aboutTheme = "Colours of this page, remembered by this browser";
export const themeTitle = "Theme";
export const find = "Find {}";
export const ctrlK = "Ctrl+K";
export const keysAt = "Keys {}";
export const work = "Work";
export const keys = "Keys";
export const close = "Close";
export const findTitle = "Find an act";
export const nameOfAct = "Name of an act";
export const acts = "Acts";
