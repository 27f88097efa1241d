// Texts that several areas of the page say alike.

export const stopRequest = "Stop request";
export const noRover = "No rover is connected.";
export const noTelemetry = "No telemetry yet: no rover is connected.";
export const noTerrain = "There is no terrain yet.";
export const noSequence = "There are no commands yet: make them first.";
export const noPlan = "There is no plan yet: plan the step first.";
export const stopInForce = "A stop is in force: clear it first.";
export const sendingAlready = "Commands are already being sent.";
export const notAnswering = "The server does not answer.";
export const chooseFootfall = "Choose a footfall first: click on the ground.";
export const backToTheRover = "End the what-if: back to the rover";
export const noReason = "no reason was given";
export const notKnown = "not known";
export const notComputed = "not computed";
export const noPlanShort = "no plan";
export const planRefused = "the plan was refused";

// -- what many texts are made of -------------------------------------------------------------------

export const leg = (number) => `leg ${number}`;
export const legFirst = (number) => `Leg ${number}`;
export const row = (number) => `row ${number}`;
export const rowFirst = (number) => `Row ${number}`;
export const leftCamera = (pair) => `${pair}, left camera`;

export const planGait = "Plan gait";
export const planWalk = "Plan walk";

// -- on the page from the beginning -----------------------------------------------------------------

export const cancel = "Cancel";
export const send = "Send to rover";
export const hold = "Hold";
export const predicted = "Predicted";
export const measured = "Measured";
export const Leg = "Leg";
export const commanded = "Commanded";
export const enter = "Enter";
export const escape = "Esc";
export const state = "State";
export const undo = "Undo";
export const assumptions = "Balance assumptions";
export const xIn = "x {} m";
export const yIn = "y {} m";
export const toRover = "Back to the rover";
export const x = "x";
export const y = "y";
export const z = "z";
export const checks = "Checks";
export const check = "Check";
export const margin = "Margin";
export const whereLeast = "Where it is least";
export const zIn = "z {} m";
