// What the page runs, its words first. It is served joined with all that it imports.

import "./fill.js";
import "./main.js";
