// Gives the page its words, before any other module runs. The markup says where each stands: data-text="area.name" for what
// an element reads, data-title, data-label (for who can't see) and data-placeholder for the attributes. In a text each {}
// is the place of the element's next child: "Radius {} m".

import * as commands from "./texts/commands.js";
import * as conn from "./texts/conn.js";
import * as footfall from "./texts/footfall.js";
import * as ghost from "./texts/ghost.js";
import * as ground from "./texts/ground.js";
import * as images from "./texts/images.js";
import * as kinds from "./texts/kinds.js";
import * as link from "./texts/link.js";
import * as login from "./texts/login.js";
import * as next from "./texts/next.js";
import * as page from "./texts/page.js";
import * as plan from "./texts/plan.js";
import * as plots from "./texts/plots.js";
import * as queue from "./texts/queue.js";
import * as record from "./texts/record.js";
import * as sag from "./texts/sag.js";
import * as scene from "./texts/scene.js";
import * as sessions from "./texts/sessions.js";
import * as shared from "./texts/shared.js";
import * as telemetry from "./texts/telemetry.js";
import * as walk from "./texts/walk.js";

const AREAS = { commands, conn, footfall, ghost, ground, images, kinds, link, login, next, page, plan, plots, queue, record, sag, scene, sessions, shared, telemetry, walk };
const ATTRIBUTES = [["title", "title"], ["label", "aria-label"], ["placeholder", "placeholder"]];

// A key that the catalogue lacks is shown as it is: nothing stays without a word. Tests refuse such keys.
function textOf(key) {
  const [area, name] = key.split(".");
  return AREAS[area]?.[name] ?? key;
}

function fill(element, text) {
  const children = [...element.children];
  element.replaceChildren(...text.split("{}").flatMap((part, i) => (i < children.length ? [part, children[i]] : [part])));
}

for (const element of document.querySelectorAll("[data-text]")) fill(element, textOf(element.getAttribute("data-text")));
for (const [data, attribute] of ATTRIBUTES) {
  for (const element of document.querySelectorAll(`[data-${data}]`)) element.setAttribute(attribute, textOf(element.getAttribute(`data-${data}`)));
}
