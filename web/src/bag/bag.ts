// A recording of one or several files: messages by topic and time, from a cache of its pieces that is bounded.
import { openMcap, readAttachment, readPiece, type McapFile, type Piece } from './mcap';
import type { RawMessage } from './records';
import type { Bytes, Progress } from './bytes';
import { BagProblem } from './problem';

export interface Topic {
  id: number;
  name: string;
  type: string;
  schema: string;
  encoding: string; // of the messages: "cdr"
  isLatched: boolean;
  count: number; // messages; 0: unknown
}

export interface BagMessage {
  topic: Topic;
  time: number; // s since the start of the recording
  stamp: bigint; // ns, when it was logged
  data: Uint8Array;
}

// A piece with its times in s since the start of the recording.
export interface Span {
  piece: Piece;
  start: number;
  end: number;
}

export interface BagEvent {
  time: number;
  text: string;
}

const MOST_BYTES = 96e6; // of decompressed pieces that are kept
const byTime = (a: BagMessage, b: BagMessage): number => a.time - b.time;

const STARTING = 1; // s: what was latched before the recording began, and the first poses, are in its beginning
const DESCRIPTION = /(^|\/)(robot_description|robot_description_semantic|tf_static|map)$/;
// Until its first message, milliseconds after the start, a robot would be drawn with all joints at 0.
const POSES = /(^|\/)(JointState|TFMessage)$/;

// The publisher keeps its last message for later subscribers, as rosbag2 writes it; names are for writers that do not.
function isLatched(name: string, qos: string): boolean {
  return /durability: *['"]?(1|transient_local)\b/.test(qos) || DESCRIPTION.test(name);
}

const FOREVER = 1n << 64n;
const isOfDoppel = (file: McapFile): boolean => file.library.startsWith('doppel');
const startOf = (file: McapFile): bigint =>
  file.pieces.reduce((least, { start }) => (start < least ? start : least), FOREVER);
const endOf = (file: McapFile): bigint => file.pieces.reduce((most, { end }) => (end > most ? end : most), 0n);

// ns to add to the times of each file. doppel begins a new one where a simulation was reset, with earlier times; it continues
// the file before it. Files of other writers may overlap.
function shiftsOf(files: McapFile[]): Map<McapFile, bigint> {
  const shifts = new Map<McapFile, bigint>();
  let end = 0n;
  for (const file of files) {
    const start = startOf(file);
    const isReset = shifts.size > 0 && file.pieces.length > 0 && isOfDoppel(file) && start < end;
    const shift = isReset ? end - start : 0n;
    shifts.set(file, shift);
    if (file.pieces.length > 0 && endOf(file) + shift > end) end = endOf(file) + shift;
  }
  return shifts;
}

export class Bag {
  readonly start: bigint;
  readonly length: number; // s
  readonly topics: Topic[];
  readonly warnings: string[];
  readonly events: BagEvent[];
  readonly byteCount: number; // of the pieces, as they are stored
  onproblem: (text: string) => void = () => {}; // of a piece that cannot be read
  readonly spans: Span[]; // by their start
  private readonly shifts: Map<McapFile, bigint>;
  private readonly ids = new Map<McapFile, Map<number, Topic>>();
  private readonly cache = new Map<Piece, Promise<BagMessage[]>>(); // the last used is the last
  private kept = 0;

  constructor(
    readonly name: string,
    readonly files: McapFile[],
  ) {
    this.shifts = shiftsOf(files);
    const pieces = files.flatMap((file) => file.pieces);
    this.start = pieces
      .map((piece) => piece.start + this.shifts.get(piece.file)!)
      .reduce((a, b) => (b < a ? b : a), FOREVER);
    this.spans = pieces
      .map((piece) => ({
        piece,
        start: this.seconds(piece.start, piece.file),
        end: this.seconds(piece.end, piece.file),
      }))
      .sort((a, b) => a.start - b.start);
    this.length = this.spans.reduce((end, span) => Math.max(end, span.end), 0);
    this.topics = this.findTopics();
    this.warnings = files.flatMap(({ warnings }) => warnings);
    this.events = this.findEvents();
    this.byteCount = pieces.reduce((sum, { length }) => sum + length, 0);
  }

  get isRemote(): boolean {
    return this.files.some(({ bytes }) => bytes.isRemote);
  }

  // Since the start of the recording, of a time in that file.
  private seconds(time: bigint, file: McapFile): number {
    return Number(time + this.shifts.get(file)! - this.start) / 1e9;
  }

  private findTopics(): Topic[] {
    const topics = new Map<string, Topic>();
    for (const file of this.files) {
      const ids = new Map<number, Topic>();
      this.ids.set(file, ids);
      for (const [id, channel] of file.channels) {
        const schema = file.schemas.get(channel.schemaId);
        const found = topics.get(channel.topic) ?? {
          id: topics.size + 1,
          name: channel.topic,
          type: schema?.name ?? '',
          schema: new TextDecoder().decode(schema?.data),
          encoding: channel.messageEncoding,
          isLatched: isLatched(channel.topic, channel.metadata.get('offered_qos_profiles') ?? ''),
          count: 0,
        };
        found.count += file.counts.get(id) ?? 0;
        topics.set(channel.topic, found);
        ids.set(id, found);
      }
    }
    return [...topics.values()];
  }

  // Attachments within the time of the recording, without meshes and those of its start, and metadata that names a
  // time.
  private findEvents(): BagEvent[] {
    const out: BagEvent[] = [];
    for (const file of this.files) {
      for (const { name, time, mediaType } of file.attachments) {
        const at = this.seconds(time, file);
        if (/^(package|file|model):\/\//.test(name) || at <= 0 || at > this.length) continue;
        out.push({ time: at, text: `${name}${mediaType ? ` (${mediaType})` : ''}` });
      }
      for (const { name, metadata } of file.metadata) {
        const stamp = metadata.get('time') ?? metadata.get('stamp') ?? metadata.get('log_time') ?? '';
        const at = /^\d{10,}$/.test(stamp)
          ? this.seconds(BigInt(stamp), file)
          : /^\d+\.?\d*$/.test(stamp)
            ? Number(stamp)
            : NaN;
        if (!(at >= 0 && at <= this.length)) continue;
        const text = metadata.get('text') ?? metadata.get('message') ?? metadata.get('name') ?? '';
        out.push({ time: at, text: [name, text].filter(Boolean).join(': ') });
      }
    }
    return out.sort((a, b) => a.time - b.time);
  }

  topic(name: string): Topic | undefined {
    return this.topics.find((topic) => topic.name === name);
  }

  // The bytes of an attachment; null: there is none of that name.
  async attachment(name: string): Promise<Uint8Array | null> {
    for (const file of this.files) {
      const found = file.attachments.find((one) => one.name === name);
      if (found) return readAttachment(file, found);
    }
    return null;
  }

  private has(piece: Piece, topics: ReadonlySet<Topic>): boolean {
    if (!piece.channels) return true;
    const ids = this.ids.get(piece.file)!;
    for (const id of piece.channels) if (topics.has(ids.get(id)!)) return true;
    return false;
  }

  isLoaded(piece: Piece): boolean {
    return this.cache.has(piece);
  }

  // All messages of a piece, by time. One that cannot be read has none, and is reported once.
  load(piece: Piece): Promise<BagMessage[]> {
    const known = this.cache.get(piece);
    if (known) {
      this.cache.delete(piece);
      this.cache.set(piece, known);
      return known;
    }
    const made = this.decode(piece);
    this.cache.set(piece, made);
    this.kept += piece.size;
    for (const old of this.cache.keys()) {
      if (this.kept <= MOST_BYTES || old === piece) break;
      this.cache.delete(old);
      this.kept -= old.size;
    }
    return made;
  }

  private async decode(piece: Piece): Promise<BagMessage[]> {
    const { file } = piece;
    const ids = this.ids.get(file)!;
    const isRepeated = this.repeatsOf(file);
    try {
      return (await readPiece(piece)).flatMap((raw) => {
        const topic = ids.get(raw.channel);
        if (!topic || isRepeated(topic, raw)) return [];
        return [{ topic, time: this.seconds(raw.time, file), stamp: raw.time, data: raw.data }];
      });
    } catch (problem) {
      this.onproblem((problem as Error).message);
      return [];
    }
  }

  // doppel repeats latched messages at the start of each file. Of the log these are lines of before.
  private repeatsOf(file: McapFile): (topic: Topic, message: RawMessage) => boolean {
    if (file === this.files[0] || !isOfDoppel(file)) return () => false;
    const start = startOf(file);
    return (topic, { time, published }) => time === start && published !== time && /(^|\/)Log$/.test(topic.type);
  }

  // The messages after `from`, until `to` inclusive.
  async range(topics: ReadonlySet<Topic>, from: number, to: number): Promise<BagMessage[]> {
    const spans = this.spans.filter(({ piece, start, end }) => end > from && start <= to && this.has(piece, topics));
    const out: BagMessage[] = [];
    for (const messages of await Promise.all(spans.map(({ piece }) => this.load(piece)))) {
      for (let i = after(messages, from); i < messages.length && messages[i]!.time <= to; i += 1)
        if (topics.has(messages[i]!.topic)) out.push(messages[i]!);
    }
    return spans.length > 1 ? out.sort(byTime) : out;
  }

  // The newest `most` messages of a topic until `time`, but none before `since` except the newest one, the oldest
  // first. At most `pieces` pieces are read. A latched topic or one of poses without any has the first one, if that is
  // in the beginning of the recording.
  async latest(
    topic: Topic,
    time: number,
    { most = 1, since = -Infinity, pieces = Infinity } = {},
  ): Promise<BagMessage[]> {
    const wanted = new Set([topic]);
    const inside = this.spans
      .filter(({ piece, start }) => start <= time && this.has(piece, wanted))
      .sort((a, b) => b.end - a.end);
    let found: BagMessage[] = [];
    for (const { piece, end } of inside.slice(0, pieces)) {
      if (found.length >= most && end < found[0]!.time) break;
      if (found.length > 0 && end < since) break;
      const messages = await this.load(piece);
      for (const one of messages) if (one.topic === topic && one.time <= time) found.push(one);
      found = found.sort(byTime).slice(-most);
    }
    if (found.length === 0 && (topic.isLatched || POSES.test(topic.type)))
      return (await this.first(topic)).filter((one) => one.time <= STARTING || DESCRIPTION.test(topic.name));
    return found.filter((one, i) => one.time >= since || i === found.length - 1);
  }

  private async first(topic: Topic): Promise<BagMessage[]> {
    const wanted = new Set([topic]);
    for (const { piece } of this.spans) {
      if (!this.has(piece, wanted)) continue;
      const found = (await this.load(piece)).find((one) => one.topic === topic);
      if (found) return [found];
    }
    return [];
  }

  // The time of the next message of these topics, or of the one before; the same time if there is none.
  async step(topics: ReadonlySet<Topic>, time: number, direction: 1 | -1): Promise<number> {
    const spans = this.spans.filter(
      ({ piece, start, end }) => (direction > 0 ? end > time : start < time) && this.has(piece, topics),
    );
    if (direction < 0) spans.sort((a, b) => b.end - a.end);
    let best = NaN;
    for (const { piece, start, end } of spans) {
      if (direction > 0 ? start > best : end < best) break;
      for (const { topic, time: at } of await this.load(piece)) {
        if (!topics.has(topic) || (direction > 0 ? at <= time : at >= time)) continue;
        if (Number.isNaN(best) || (direction > 0 ? at < best : at > best)) best = at;
      }
    }
    return Number.isNaN(best) ? time : best;
  }

  // Begins to read what follows, before it is needed.
  prefetch(topics: ReadonlySet<Topic>, from: number, to: number): void {
    for (const { piece, start } of this.spans) {
      if (start > from && start <= to && !this.isLoaded(piece) && this.has(piece, topics)) void this.load(piece);
    }
  }
}

// The index of the first message after that time.
function after(messages: BagMessage[], time: number): number {
  let low = 0,
    high = messages.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (messages[middle]!.time <= time) low = middle + 1;
    else high = middle;
  }
  return low;
}

// "run_2.mcap" comes before "run_10.mcap".
export const byName = (a: string, b: string): number => a.localeCompare(b, 'en', { numeric: true });

export async function openBag(name: string, files: Bytes[], progress: Progress): Promise<Bag> {
  if (files.length === 0) throw new BagProblem(`${name} has no .mcap files.`);
  const opened: McapFile[] = [];
  for (const bytes of files) opened.push(await openMcap(bytes, progress));
  const bag = new Bag(name, opened);
  if (bag.spans.length === 0)
    throw new BagProblem(
      bag.warnings.find((text) => /compressed|decompressed/.test(text)) ??
        `${name} has no messages. ${bag.warnings.join(' ')}`.trim(),
    );
  return bag;
}
