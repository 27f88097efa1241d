// What the log-in page runs, its words first. It is served joined with all that it imports.

import "./fill.js";
import "./login.js";
