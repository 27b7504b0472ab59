// Reads an MCAP file with Foxglove's libraries and prints what it finds as JSON.
import { open } from "node:fs/promises";

import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { McapIndexedReader } from "@mcap/core";
import { decompress } from "fzstd";

class FileReadable {
  constructor(handle) {
    this.handle = handle;
  }

  async size() {
    return BigInt((await this.handle.stat()).size);
  }

  async read(offset, size) {
    const buffer = new Uint8Array(Number(size));
    const { bytesRead } = await this.handle.read(buffer, 0, buffer.length, Number(offset));
    if (bytesRead !== buffer.length) {
      throw new Error(`${bytesRead} of ${size} bytes at ${offset}`);
    }
    return buffer;
  }
}

const plain = (key, value) => {
  if (typeof value === "bigint") {
    return value.toString();
  }
  return ArrayBuffer.isView(value) ? Array.from(value) : value;
};

const handle = await open(process.argv[2]);
const reader = await McapIndexedReader.Initialize({
  readable: new FileReadable(handle),
  decompressHandlers: {
    zstd: (data, size) => decompress(data, new Uint8Array(Number(size))),
  },
});
const readers = new Map();
for (const channel of reader.channelsById.values()) {
  const schema = reader.schemasById.get(channel.schemaId);
  const text = new TextDecoder().decode(schema.data);
  readers.set(channel.id, new MessageReader(parse(text, { ros2: true })));
}
const topics = {};
for await (const message of reader.readMessages({ validateCrcs: true })) {
  const { topic } = reader.channelsById.get(message.channelId);
  const decoded = readers.get(message.channelId).readMessage(message.data);
  topics[topic] ??= { count: 0, first: decoded, logTime: message.logTime };
  topics[topic].count += 1;
  topics[topic].last = decoded;
}
const attachments = {};
for await (const attachment of reader.readAttachments()) {
  attachments[attachment.name] = new TextDecoder().decode(attachment.data);
}
const metadata = {};
for await (const record of reader.readMetadata()) {
  metadata[record.name] = Object.fromEntries(record.metadata);
}
await handle.close();
console.log(JSON.stringify({ profile: reader.header.profile, topics, attachments, metadata }, plain));
