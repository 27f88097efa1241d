// Texts that several areas of the page say alike.

export const notAnswering = "The server does not answer.";
export const notKnown = "not known";
export const noPlanShort = "no plan";
export const planRefused = "the plan was refused";
