// Prints the page's catalogue, as JSON: area → name → text. What is no plain text (functions, tables) is null.

import { readdirSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const folder = process.argv[3];
const areas = {};
for (const file of readdirSync(folder)) {
  const told = await import(pathToFileURL(join(folder, file)));
  areas[file.replace(/\.js$/, "")] = Object.fromEntries(Object.entries(told).map(([name, text]) => [name, typeof text === "string" ? text : null]));
}
console.log(JSON.stringify(areas));
