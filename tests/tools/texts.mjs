// Finds what an operator would read in sources of the page. In: a JSON object, name → source. Out: [{name, line, text}].
// A text is
// - a string, or a part of a template between values, with a blank and a letter or a sign of a unit, or with a "°";
// - any string with a letter that is, or may become, what is read: the value of textContent, title, ariaLabel and their like,
//   of `text` of an act, a child of an element, what toast, note and Error are given;
// - a number that is made a text in a way of its own: toFixed.
// No text: where modules lie, what is compared, class names, styles, fonts, selectors.

import { createRequire } from "node:module";
import { text as read } from "node:stream/consumers";

const { parse } = createRequire(`${process.argv[2]}/node_modules/eslint/package.json`)("espree");

const WORDS = /^(?=.*\s)(?=.*[\p{L}%×])|°/su;
const READ = ["textContent", "title", "ariaLabel", "aria-label", "ariaValueText", "aria-valuetext", "placeholder", "alt", "label", "text"];
const LOOKS = ["className", "class", "style", "cssText", "font", "background", "href", "src"];
const SELECTING = ["querySelector", "querySelectorAll", "closest", "matches"];
const TELLING = { toast: 0, note: 0, Error: 0, fillText: 0, explainKey: 1, element: 2 }; // from which argument on

const nameOf = (node) => node?.name ?? node?.value ?? node?.property?.name;

// Which strings an expression may come to.
function ends(node) {
  switch (node?.type) {
    case "Literal": case "TemplateLiteral": return [node];
    case "ConditionalExpression": return [...ends(node.consequent), ...ends(node.alternate)];
    case "LogicalExpression": return [...ends(node.left), ...ends(node.right)];
    case "BinaryExpression": return node.operator === "+" ? [...ends(node.left), ...ends(node.right)] : [];
    case "AssignmentExpression": return ends(node.right);
    default: return [];
  }
}

const partsOf = (node) => (node.type === "TemplateLiteral" ? node.quasis.map((part) => part.value.cooked) : [node.value]).filter((part) => typeof part === "string");

function textsOf(source) {
  const found = new Map(); // node → its text
  const keep = (node) => found.set(node, partsOf(node).join("…"));
  const readAloud = (node) => ends(node).filter((one) => partsOf(one).some((part) => /\p{L}/u.test(part))).forEach(keep);
  const visit = (node) => {
    if (!node || typeof node.type !== "string") return;
    if (/^(Import|Export(All|Named))/.test(node.type) && node.source) return;
    if (node.type === "Property" && LOOKS.includes(nameOf(node.key))) return;
    if (node.type === "AssignmentExpression" && (LOOKS.includes(nameOf(node.left)) || nameOf(node.left.object) === "style")) return;
    if (node.type === "BinaryExpression" && /^[!=]==$/.test(node.operator)) return;
    if (node.type === "CallExpression" && SELECTING.includes(nameOf(node.callee))) return;
    if (node.type === "Property" && READ.includes(nameOf(node.key))) readAloud(node.value);
    if (node.type === "AssignmentExpression" && READ.includes(nameOf(node.left))) readAloud(node.right);
    if (node.type === "CallExpression" && nameOf(node.callee) === "setAttribute" && READ.includes(node.arguments[0].value)) readAloud(node.arguments[1]);
    if (/^(Call|New)Expression$/.test(node.type) && Object.hasOwn(TELLING, nameOf(node.callee) ?? "")) node.arguments.slice(TELLING[nameOf(node.callee)]).forEach(readAloud);
    if (/^(Literal|TemplateLiteral)$/.test(node.type) && partsOf(node).some((part) => WORDS.test(part))) keep(node);
    if (node.type === "MemberExpression" && nameOf(node) === "toFixed") found.set(node, "toFixed");
    for (const [name, value] of Object.entries(node)) if (name !== "parent") [value].flat().forEach(visit);
  };
  visit(parse(source, { ecmaVersion: "latest", sourceType: "module", loc: true }));
  return [...found].map(([node, text]) => ({ line: node.loc.start.line, text }));
}

const sources = Object.entries(JSON.parse(await read(process.stdin)));
console.log(JSON.stringify(sources.flatMap(([name, source]) => textsOf(source).map((one) => ({ name, ...one })))));
