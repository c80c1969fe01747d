// Records of an MCAP file that are read by position: chunks and the messages in them. The index, schemas, channels and
// attachments are read by @mcap/core.
import { crc32 } from '@foxglove/crc';
import { CODECS } from './codecs';
import { BagProblem } from './problem';

export const OPCODE = {
  header: 0x01,
  footer: 0x02,
  schema: 0x03,
  channel: 0x04,
  message: 0x05,
  chunk: 0x06,
  attachment: 0x09,
  metadata: 0x0c,
  dataEnd: 0x0f,
} as const;
export const HEAD = 9; // bytes of opcode and length
const CHUNK_HEAD = 40; // bytes before the records of a chunk without compression
const LARGEST_CHUNK = 1 << 30; // bytes, decompressed
const MESSAGE_HEAD = 22; // bytes of channel, sequence and two times

export interface RawMessage {
  channel: number;
  time: bigint; // ns, when it was logged
  published: bigint; // ns
  data: Uint8Array; // a view
}

export interface ChunkHead {
  start: bigint;
  end: bigint;
  size: number; // decompressed
  crc: number; // 0: none
  compression: string;
  records: Uint8Array; // compressed
}

export function lengthAt(view: DataView, position: number): number {
  return Number(view.getBigUint64(position + 1, true));
}

const viewOf = (bytes: Uint8Array): DataView => new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);

export function readChunk(record: Uint8Array, place: string): ChunkHead {
  const view = viewOf(record);
  const name = record.length < HEAD + CHUNK_HEAD ? Infinity : view.getUint32(HEAD + 28, true);
  if (HEAD + CHUNK_HEAD + name > record.length) throw new BagProblem(`${place}: the head of the chunk is damaged.`);
  const compression = new TextDecoder().decode(record.subarray(HEAD + 32, HEAD + 32 + name));
  const from = HEAD + 32 + name + 8;
  const length = Number(view.getBigUint64(from - 8, true));
  return {
    start: view.getBigUint64(HEAD, true),
    end: view.getBigUint64(HEAD + 8, true),
    size: Number(view.getBigUint64(HEAD + 16, true)),
    crc: view.getUint32(HEAD + 24, true),
    compression,
    records: record.subarray(from, from + length),
  };
}

// The records of a chunk. `place` is for the message of what is wrong: a file and the offset of the chunk in it.
export function openChunk({ compression, records, size, crc }: ChunkHead, place: string): Uint8Array {
  if (size > LARGEST_CHUNK)
    throw new BagProblem(`${place}: the chunk is ${size} bytes long by its head, which is damaged.`);
  const codec = CODECS[compression];
  if (compression !== '' && !codec)
    throw new BagProblem(
      `${place}: the chunk is compressed by '${compression}'; this page reads zstd, lz4 and chunks without compression.`,
    );
  let bytes: Uint8Array;
  try {
    bytes = codec ? codec(records, BigInt(size)) : records;
  } catch (problem) {
    throw new BagProblem(`${place}: the chunk cannot be decompressed (${(problem as Error).message}).`);
  }
  if (bytes.length !== size) throw new BagProblem(`${place}: the chunk has ${bytes.length} bytes instead of ${size}.`);
  if (crc !== 0 && crc32(bytes) !== crc) throw new BagProblem(`${place}: the check sum of the chunk is wrong.`);
  return bytes;
}

// The positions of whole records.
export function* recordsIn(bytes: Uint8Array): Generator<{ opcode: number; from: number; to: number }> {
  const view = viewOf(bytes);
  for (let from = 0; from + HEAD <= bytes.length; ) {
    const to = from + HEAD + lengthAt(view, from);
    if (to > bytes.length) return;
    yield { opcode: bytes[from]!, from, to };
    from = to;
  }
}

// The messages among records, by time.
export function messagesIn(bytes: Uint8Array): RawMessage[] {
  const view = viewOf(bytes);
  const out: RawMessage[] = [];
  let last = 0n,
    inOrder = true;
  for (const { opcode, from, to } of recordsIn(bytes)) {
    if (opcode !== OPCODE.message || to - from < HEAD + MESSAGE_HEAD) continue;
    const time = view.getBigUint64(from + HEAD + 6, true);
    out.push({
      channel: view.getUint16(from + HEAD, true),
      time,
      published: view.getBigUint64(from + HEAD + 14, true),
      data: bytes.subarray(from + HEAD + MESSAGE_HEAD, to),
    });
    inOrder &&= time >= last;
    last = time;
  }
  if (!inOrder) out.sort((a, b) => (a.time < b.time ? -1 : a.time > b.time ? 1 : 0));
  return out;
}

// Name, type and time of an attachment by the beginning of its record; null: it is damaged.
export function readAttachmentHead(start: Uint8Array): { name: string; mediaType: string; time: bigint } | null {
  const view = viewOf(start);
  let position = HEAD + 16; // after two times
  const text = (): string | null => {
    const length = position + 4 <= start.length ? view.getUint32(position, true) : Infinity;
    position += 4 + length;
    return position <= start.length ? new TextDecoder().decode(start.subarray(position - length, position)) : null;
  };
  const name = text(),
    mediaType = text();
  return name === null || mediaType === null ? null : { name, mediaType, time: view.getBigUint64(HEAD, true) };
}
