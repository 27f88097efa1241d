// Reads an MCAP file as Foxglove does: its reader, and its ROS 2 decoder with the definitions in the file.
// Out: [{topic, schema, row, time, message}], doubles as their 16 hexadecimal digits.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const require = createRequire(`${process.argv[2]}/`); // the folder that the packages are installed in
const { McapIndexedReader } = require("@mcap/core");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");

const data = readFileSync(process.argv[3]);
const readable = {
  size: async () => BigInt(data.length),
  read: async (at, count) => new Uint8Array(data.subarray(Number(at), Number(at + count))),
};

function hexadecimal(number) {
  const bytes = Buffer.alloc(8);
  bytes.writeDoubleLE(number);
  return bytes.toString("hex");
}

const plain = (message) => JSON.parse(JSON.stringify(message, (_, item) => (item instanceof Float64Array ? [...item].map(hexadecimal) : item)));

const reader = await McapIndexedReader.Initialize({ readable });
const found = [];
for await (const one of reader.readMessages()) {
  const channel = reader.channelsById.get(one.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  const decoder = new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true }));
  const message = decoder.readMessage(one.data);
  if (typeof message.data === "number") message.data = hexadecimal(message.data);
  found.push({ topic: channel.topic, schema: schema.name, row: one.sequence, time: String(one.logTime), message: plain(message) });
}
console.log(JSON.stringify(found));
