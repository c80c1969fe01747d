// One MCAP file: what is in it, by its index, or without a usable one by a scan of the whole file.
import { McapIndexedReader, McapStreamReader, type McapTypes } from '@mcap/core';
import type { Bytes, Progress } from './bytes';
import { CODECS } from './codecs';
import { BagProblem, MAGIC, requireMcap } from './problem';
import {
  HEAD,
  lengthAt,
  messagesIn,
  OPCODE,
  openChunk,
  readAttachmentHead,
  readChunk,
  recordsIn,
  type ChunkHead,
  type RawMessage,
} from './records';

// A part of the file that is read at once: a chunk, or a row of messages outside of chunks.
export interface Piece {
  file: McapFile;
  from: number;
  length: number; // bytes in the file
  size: number; // bytes decompressed
  isChunk: boolean;
  compression: string;
  start: bigint; // ns
  end: bigint;
  channels: Set<number> | null; // null: unknown
}

export interface Attachment {
  name: string;
  mediaType: string;
  time: bigint;
  from: number;
  length: number;
}

export interface McapFile {
  bytes: Bytes;
  library: string; // that has written it
  pieces: Piece[];
  channels: Map<number, McapTypes.Channel>;
  schemas: Map<number, McapTypes.Schema>;
  counts: Map<number, number>; // messages by channel
  attachments: Attachment[];
  metadata: McapTypes.Metadata[];
  warnings: string[]; // also why the file was scanned
}

const WINDOW = 4 * 1024 * 1024; // bytes that a scan reads at once
const ATTACHMENT_HEAD = 4096; // bytes that hold the name of an attachment
const ROW = 512 * 1024; // bytes of messages outside of chunks that are one piece
const SHOWN_METADATA = 64; // records that are read

function newFile(bytes: Bytes): McapFile {
  return {
    bytes,
    pieces: [],
    library: '',
    channels: new Map(),
    schemas: new Map(),
    counts: new Map(),
    attachments: [],
    metadata: [],
    warnings: [],
  };
}

class Unreadable extends BagProblem {} // a scan would not help

function readable(file: McapFile): McapFile {
  const foreign = file.pieces.find(({ compression }) => compression !== '' && !CODECS[compression]);
  if (foreign)
    throw new Unreadable(
      `${file.bytes.name}, byte ${foreign.from}: the chunk is compressed by '${foreign.compression}'; this page reads zstd, lz4 and chunks without compression.`,
    );
  return file;
}

export async function openMcap(bytes: Bytes, progress: Progress): Promise<McapFile> {
  requireMcap(bytes.name, await bytes.read(0, Math.min(bytes.size, 16)));
  let why: string;
  try {
    const file = await readIndex(bytes);
    if (file) return readable(file);
    why = `${bytes.name} has no index of its messages; it was read as a whole.`;
  } catch (problem) {
    if (problem instanceof Unreadable) throw problem;
    const end =
      bytes.size < MAGIC.length
        ? ''
        : String.fromCharCode(...(await bytes.read(bytes.size - MAGIC.length, MAGIC.length)));
    why =
      end === MAGIC
        ? `${bytes.name} has a damaged index (${(problem as Error).message.replace(
            / \[.*\]$/,
            '',
          )}); it was read as a whole.`
        : `${bytes.name} ends at byte ${bytes.size} without an index: its recorder was killed, or it is cut off. It was read as a whole; 'doppel bag recover' writes a copy with an index.`;
  }
  const file = await scan(bytes, progress);
  file.warnings.unshift(why);
  return file;
}

// null: there is a summary, but not of what is needed.
async function readIndex(bytes: Bytes): Promise<McapFile | null> {
  const readable = {
    size: async () => BigInt(bytes.size),
    read: (from: bigint, length: bigint) => bytes.read(Number(from), Number(length)),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers: CODECS });
  const { chunkIndexes, channelsById, statistics } = reader;
  const isEmpty = statistics !== undefined && statistics.messageCount === 0n;
  if (!isEmpty && (chunkIndexes.length === 0 || channelsById.size === 0)) return null;
  const file = newFile(bytes);
  file.channels = new Map(channelsById);
  file.schemas = new Map(reader.schemasById);
  file.library = reader.header.library;
  for (const [id, count] of statistics?.channelMessageCounts ?? []) file.counts.set(id, Number(count));
  file.pieces = chunkIndexes
    .filter(({ messageIndexOffsets, uncompressedSize }) => messageIndexOffsets.size > 0 || uncompressedSize > 0n)
    .map((one) => ({
      file,
      from: Number(one.chunkStartOffset),
      length: Number(one.chunkLength),
      size: Number(one.uncompressedSize),
      isChunk: true,
      compression: one.compression,
      start: one.messageStartTime,
      end: one.messageEndTime,
      channels: one.messageIndexOffsets.size > 0 ? new Set(one.messageIndexOffsets.keys()) : null,
    }));
  file.attachments = reader.attachmentIndexes.map((one) => ({
    name: one.name,
    mediaType: one.mediaType,
    time: one.logTime,
    from: Number(one.offset),
    length: Number(one.length),
  }));
  for (const { offset, length } of reader.metadataIndexes.slice(0, SHOWN_METADATA)) {
    const [record] = parse(await bytes.read(Number(offset), Number(length)));
    if (record?.type === 'Metadata') file.metadata.push(record);
  }
  return file;
}

// Records of one kind by @mcap/core.
function parse(bytes: Uint8Array): McapTypes.TypedMcapRecord[] {
  const reader = new McapStreamReader({ noMagicPrefix: true, validateCrcs: false });
  reader.append(bytes);
  const out = [];
  for (let record = reader.nextRecord(); record; record = reader.nextRecord()) out.push(record);
  return out;
}

export async function readAttachment(file: McapFile, { from, length }: Attachment): Promise<Uint8Array> {
  const [record] = parse(await file.bytes.read(from, length));
  if (record?.type !== 'Attachment') throw new BagProblem(`${file.bytes.name}, byte ${from}: there is no attachment.`);
  return record.data;
}

export async function readPiece(piece: Piece): Promise<RawMessage[]> {
  const record = await piece.file.bytes.read(piece.from, piece.length);
  if (!piece.isChunk) return messagesIn(record);
  const place = `${piece.file.bytes.name}, byte ${piece.from}`;
  if (record[0] !== OPCODE.chunk) throw new BagProblem(`${place}: there is no chunk, although the index names one.`);
  return messagesIn(openChunk(readChunk(record, place), place));
}

// -- files without an index

class Scanner {
  readonly file: McapFile;
  private row: Piece | null = null; // messages outside of chunks, to which the next one belongs

  constructor(bytes: Bytes) {
    this.file = newFile(bytes);
  }

  // A record and its position; false: it is the last one with messages.
  take(record: Uint8Array, from: number): boolean {
    switch (record[0]) {
      case OPCODE.chunk:
        this.takeChunk(record, from);
        break;
      case OPCODE.message:
        this.takeMessage(record, from);
        break;
      case OPCODE.dataEnd:
      case OPCODE.footer:
        return false;
      case OPCODE.header:
      case OPCODE.schema:
      case OPCODE.channel:
      case OPCODE.metadata:
        this.learn(record);
        break;
      case OPCODE.attachment:
        this.takeAttachment(record, from, record.length);
        break;
    }
    return true;
  }

  // The beginning of the record is enough.
  takeAttachment(start: Uint8Array, from: number, length: number): void {
    const head = readAttachmentHead(start);
    if (head) this.file.attachments.push({ ...head, from, length });
  }

  private learn(record: Uint8Array): void {
    const [one] = parse(record);
    if (one?.type === 'Header') this.file.library = one.library;
    if (one?.type === 'Schema') this.file.schemas.set(one.id, one);
    if (one?.type === 'Channel') this.file.channels.set(one.id, one);
    if (one?.type === 'Metadata' && this.file.metadata.length < SHOWN_METADATA) this.file.metadata.push(one);
  }

  private takeChunk(record: Uint8Array, from: number): void {
    const { file } = this;
    const place = `${file.bytes.name}, byte ${from}`;
    let head: ChunkHead;
    let inside: Uint8Array;
    try {
      head = readChunk(record, place);
      inside = openChunk(head, place);
    } catch (problem) {
      file.warnings.push(`${(problem as Error).message} It is left out.`);
      return;
    }
    for (const { opcode, from: start, to } of recordsIn(inside))
      if (opcode === OPCODE.schema || opcode === OPCODE.channel) this.learn(inside.subarray(start, to));
    const messages = messagesIn(inside);
    if (messages.length === 0) return;
    for (const { channel } of messages) this.count(channel);
    file.pieces.push({
      file,
      from,
      length: record.length,
      size: head.size,
      isChunk: true,
      compression: head.compression,
      start: messages[0]!.time,
      end: messages.at(-1)!.time,
      channels: new Set(messages.map(({ channel }) => channel)),
    });
  }

  private takeMessage(record: Uint8Array, from: number): void {
    const [message] = messagesIn(record);
    if (!message) return;
    const { channel, time } = message;
    this.count(channel);
    if (!this.row || from + record.length - this.row.from > ROW) {
      this.row = {
        file: this.file,
        from,
        length: 0,
        size: 0,
        isChunk: false,
        compression: '',
        start: time,
        end: time,
        channels: new Set(),
      };
      this.file.pieces.push(this.row);
    }
    this.row.length = this.row.size = from + record.length - this.row.from;
    this.row.channels!.add(channel);
    if (time < this.row.start) this.row.start = time;
    if (time > this.row.end) this.row.end = time;
  }

  private count(channel: number): void {
    this.file.counts.set(channel, (this.file.counts.get(channel) ?? 0) + 1);
  }
}

async function scan(bytes: Bytes, progress: Progress): Promise<McapFile> {
  const scanner = new Scanner(bytes);
  let position = MAGIC.length;
  while (position + HEAD <= bytes.size) {
    progress(`Reading ${bytes.name}, which has no index: ${((position / bytes.size) * 100).toFixed(0)} %.`);
    const first = await bytes.read(position, HEAD);
    const needed = HEAD + lengthAt(new DataView(first.buffer, first.byteOffset, HEAD), 0);
    if (position + needed > bytes.size) {
      scanner.file.warnings.push(
        `${bytes.name}: the record at byte ${position} is cut off; what is before it is shown.`,
      );
      break;
    }
    if (first[0] === OPCODE.attachment && needed > WINDOW) {
      scanner.takeAttachment(await bytes.read(position, ATTACHMENT_HEAD), position, needed);
      position += needed;
      continue;
    }
    const window = await bytes.read(position, Math.min(bytes.size - position, Math.max(needed, WINDOW)));
    let used = 0,
      isOver = false;
    for (const { from, to } of recordsIn(window)) {
      used = to;
      isOver = !scanner.take(window.subarray(from, to), position + from);
      if (isOver) break;
    }
    if (isOver) break;
    position += used;
    await new Promise((ready) => setTimeout(ready)); // the page stays responsive
  }
  return scanner.file;
}
