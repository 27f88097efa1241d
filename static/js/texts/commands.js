// Commands: the sequence as a list, its rows, edits of them, and what is being sent.

import { age, fixed, metres, millimetres, percent, radians, seconds } from "../figures.js";
import { COMMAND_WORDS } from "./record.js";

export const insertWait = "Insert a wait before the first row";
export const arm = "Arm the commands";
export const armFirst = "Arm the commands first.";
export const make = "Make commands of what was planned last";
export const exportSequence = "Export the commands";
export const ruleBroken = "A rule does not hold: see the list.";
export const importCommands = "Import commands from a file";
export const undo = "Undo the last choice or edit";
export const nothingToUndo = "There is nothing to undo.";
export const redo = "Redo the choice or edit that was undone last";
export const nothingToRedo = "There is nothing to redo.";
export const undoing = (choice) => `Undo: ${choice} (Ctrl+Z)`;
export const redoing = (choice) => `Redo: ${choice} (Ctrl+Y)`;
export const noPlanFound = (reason) => `Nothing was made: no plan was found. ${reason}`;
export const nothingMade = (why) => `Nothing was made: ${why}`;
export const carriedOut = "The plan was carried out: plan the next step or move.";
export const noPlanToCommand = "There is no plan to make commands of: plan the step first.";
export const noTerrainToCheck = "There is no terrain to check commands on: build or load it first.";
export const stanceUnknown = "It is not known how the rover stands yet.";
export const complete = (count) => `Sequence complete (${count} of ${count}): make new commands.`;
export const makeCommands = "Make commands";
export const makeCommandsOf = (what) => `Make commands: ${what}`;

// -- armed and sent --------------------------------------------------------------------------------

export const ago = (since) => `${age(since)} ago`;
export const armedFor = (left) => `armed for ${left} s more`;
export const waitsBefore = "waits before";
export const sending = "sending";
export const atRow = (past, doing, row, count) => `${past}${doing} row ${row} of ${count}`;
export const notArmed = "not armed";
export const notArmedAs = (why) => `not armed. ${why}`;

// -- how the rover is taken ------------------------------------------------------------------------

export const asCommanded = "as commanded: the rover sags; touch-down is not predicted";
export const asRigid = (why) => `as commanded: ${why}`;
export const sagPredicted = (mode) => `${mode}: the rover's sag is predicted`;

// -- the list --------------------------------------------------------------------------------------

export const noCommandsYet = "No commands yet.";
export const summary = (count, duration, rules) => `${count} commands, ${seconds(duration)}. ${rules}`;
export const rulesHold = "Every rule holds.";
// A rule of the whole sequence says row −1.
export const ruleTold = ({ row, text }) => (row < 0 ? text : `row ${row + 1}: ${text}`);
export const group = (name, first, last, rest) => `${name} (rows ${first}–${last})${rest}`;
export const rest = ({ torque, joint, sag }) => `; predicted: torque ${percent(torque)} at most (${joint}), then ${millimetres(Math.abs(sag))} ${sag < 0 ? "higher" : "lower"} than planned`;
export const tetherTo = (length) => `, tether to ${metres(length)}`;
export const secondsOf = (row) => `Seconds of row ${row}`;
export const until = (name, force) => `${name} until ${force} N more`;
export const all = "all";
export const stepsOf = (leg) => `Leg ${leg} steps`;
export const deleteRow = (row) => `Delete row ${row}`;
export const rowsHaveMoved = "Nothing was changed: the rows have other numbers by now. Look at the list, and do it again.";
export const noNumber = (field) => `${field}: no number was typed, so nothing was changed.`;

// -- the chosen row --------------------------------------------------------------------------------

export const rowUp = "Move the chosen row up";
export const isFirst = "The chosen row is the first.";
export const rowDown = "Move the chosen row down";
export const isLast = "The chosen row is the last.";
export const splitRow = "Split the chosen row in two halves";
export const waitBefore = "Insert a wait before the chosen row";
export const copyRow = "Copy the chosen row, after it";
export const deleteChosen = "Delete the chosen row";
export const chooseRow = "Choose a row first, by its number in the list.";
export const rowTold = (row, name, leg, phase) => `Row ${row}: ${name}${leg === null ? "" : ` leg ${leg}`}${phase ? `, ${phase}` : ""}`;
const limit = (value, slides) => (slides ? metres(value) : radians(value));
export const range = (low, high, slides) => (low === null || high === null ? "no limits" : `${fixed(low)} … ${limit(high, slides)}`);
export const jointOfRow = (joint, row, slides) => `${joint} of row ${row} [${slides ? "m" : "rad"}]`;

// -- the run ---------------------------------------------------------------------------------------

export const nextRow = "Send the next row";
export const rowUnderWay = "The present row is still under way.";
export const hold = "Hold after the present row";
export const waitsAlready = "The run already waits after the present row.";
export const resume = "Go on: send the rows that are left";
export const goesOn = "The run is already going on.";
export const abort = "Abort: send nothing more";
export const nothingSent = "Nothing is being sent.";
export const aborted = "The run was aborted; the present row still ends.";
export const underWay = "under way";
export const agoWas = (since, what) => `${age(since)} ago: ${what}`;
export const stateOf = (state, time) => `${COMMAND_WORDS[state] ?? state}${time && ` ${time}`}`;
export const stateSince = (state, time, reason) => `${stateOf(state, time)}${reason ? `: ${reason}` : ""}`;

// -- what undo takes back --------------------------------------------------------------------------

const CHOICES = { footfall: "footfall", points: "points for the wheel", plan: "choice of a plan", queue: "change of the queue", edit: "edit of the commands", stiffness: "stiffness taken over" };

// Of summary.undo or summary.redo.
export const choiceTold = ({ kind, leg, by }) => `${CHOICES[kind]}${leg === null ? "" : ` of leg ${leg}`}${by && by !== "local" ? `, by ${by}` : ""}`;

// -- on the page from the beginning -----------------------------------------------------------------

export const title = "{} Commands";
export const commandedAsPlanned = "{} as commanded";
export const aboutCommanded = "For experts: the plan is commanded as it is, whether or not the rover sags; so are files read that don't say where they start";
export const redoIt = "Redo";
export const wait = "Insert wait";
export const otherPlan = "These commands belong to another plan than the latest: make commands again, or choose their plan.";
export const startUnknown = "The file of these commands doesn't say where they start: they are checked from where the rover stood when the file was read, sagging as it is known to. Tick *as commanded* before you read a file that was made so.";
export const list = "Command list";
export const command = "Command";
export const phase = "Phase";
export const secondsColumn = "Seconds";
export const rules = "Rules";
export const up = "Up";
export const down = "Down";
export const split = "Split";
export const before = "Wait before";
export const copy = "Copy";
export const deleteIt = "Delete";
export const exportAs = "Export as {}";
export const exportIt = "Export";
export const importIt = "Import";
export const formats = "JSON, SeqJSON, CSV, F Prime text (.seq), Yamcs stack (.ycs) or MCAP";
export const file = "File of commands";
export const armIt = "Arm";
export const byStep = "{} step by step";
export const next = "Next row";
export const goOn = "Go on";
export const stopSending = "Abort";
