// The login page.

export const stopEnded = "NO STOP WAS SENT: your login has ended. Log in and ask again, or use another way to stop the rover.";
export const ended = "Your login has ended. Log in again to go on.";
export const noStopHere = "NO STOP WAS SENT: nobody can stop the rover from this page. Log in, or use another way.";
export const expired = "That login took too long, or was not begun in this browser. Try again.";
export const refused = "The provider did not let you in.";
export const unproven = "What the provider said could not be proven. An admin finds the reason in the log.";
export const unreachable = "The provider does not answer. Log in with a local account, or try again.";
export const unreadable = "The accounts can't be read; the server's disk needs attention.";
export const taken = "Your name can't be used here: it is that of another account. Ask an admin.";
export const noRole = "The provider knows you, but you have no role here. Ask an admin.";

// -- on the page from the beginning -----------------------------------------------------------------

export const title = "FootFall: log in";
export const name = "Name {}";
export const password = "Password {}";
export const logIn = "Log in";
export const or = "or {}";
export const logInWith = "log in with {}";
export const nobodyStops = "Nobody can stop the rover from this page: log in, or use another way.";
