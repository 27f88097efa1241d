// SeqJSON → SeqN → SeqJSON by NASA's sequence-language tool. In (stdin): {sequence, dictionary}. Out: {seqn, faults, back}.

import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

// by its path: the package calls itself a module, so its "require" entry can't be loaded
const entry = "node_modules/@nasa-jpl/aerie-sequence-languages/dist/esm/index.js";
const { SeqnParser, seqJsonToSeqn, seqnToSeqJson } = await import(pathToFileURL(`${process.argv[2]}/${entry}`));

const { sequence, dictionary } = JSON.parse(readFileSync(0, "utf8"));
const seqn = seqJsonToSeqn(sequence);
const tree = SeqnParser.parse(seqn);
const faults = [];
tree.iterate({ enter: (one) => { if (one.type.isError) faults.push(seqn.slice(one.from - 40, one.to + 40)); } });
console.log(JSON.stringify({ seqn, faults, back: seqnToSeqJson(tree, seqn, dictionary, "name") }));
