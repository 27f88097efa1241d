// Reads an MCAP file as Foxglove does: its reader with zstd, and its ROS 2 decoder with the definitions in the file.
// Out: [{topic, schema, row, time, message}], lists of doubles as their 16 hexadecimal digits, 64-bit integers as texts.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { zstdDecompressSync } from "node:zlib";

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

function plain(item) {
  if (typeof item === "number" || typeof item === "string") return item;
  if (typeof item === "bigint") return String(item);
  if (item instanceof Float64Array) return [...item].map(hexadecimal);
  if (ArrayBuffer.isView(item) || Array.isArray(item)) return [...item].map(plain);
  return Object.fromEntries(Object.entries(item).map(([name, one]) => [name, plain(one)]));
}

const decompressHandlers = { zstd: (bytes) => new Uint8Array(zstdDecompressSync(bytes)) };
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
const found = [];
for await (const one of reader.readMessages()) {
  const channel = reader.channelsById.get(one.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  const text = new TextDecoder();
  const message =
    channel.messageEncoding === "json"
      ? JSON.parse(text.decode(one.data))
      : new MessageReader(parse(text.decode(schema.data), { ros2: true })).readMessage(one.data);
  if (schema.name === "std_msgs/msg/Float64") message.data = hexadecimal(message.data);
  found.push({ topic: channel.topic, schema: schema.name, row: one.sequence, time: String(one.logTime), message: plain(message) });
}
console.log(JSON.stringify(found));
