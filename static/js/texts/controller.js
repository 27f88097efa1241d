// Game controllers and 3-D mice.

export const controller = "Controller";
export const aboutController = "left stick and triggers move the view, right stick turns it; A plays the ghost, cross left and right move it, shoulders go to the part before and after. It sends nothing.";
export const connected = (name, standard) => (standard
  ? `Controller connected: ${name}. It moves view and ghost, and sends nothing.`
  : `Controller ${name} is not used: the browser does not know its buttons.`);
