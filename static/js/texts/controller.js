// Game controllers and 3-D mice.

export const controller = "Controller";
export const aboutController = "left stick and triggers move the view, right stick turns it; A plays the ghost, cross left and right move it, shoulders go to the part before and after. It sends nothing.";
export const connected = (name, standard) => (standard
  ? `Controller connected: ${name}. It moves view and ghost, and sends nothing.`
  : `Controller ${name} is not used: the browser does not know its buttons.`);
export const puck = "3-D mouse";
export const aboutPuck = "pushed, pulled and lifted it moves the view, tilted and turned it turns it. It sends nothing. Connect it in the palette first.";
export const connectPuck = "Connect a 3-D mouse";
export const noHid = "This browser reads no 3-D mouse: it has no WebHID (Chromium, Chrome and Edge have).";
export const puckConnected = (name) => `3-D mouse connected: ${name}. It moves the view, and sends nothing.`;
