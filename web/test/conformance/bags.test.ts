// Recordings in both directions: @mcap/core reads what the program writes, and the program reads what @mcap/core writes.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { MessageReader, MessageWriter } from '@foxglove/rosmsg2-serialization';
import { McapIndexedReader, McapStreamReader, McapWriter, type McapTypes } from '@mcap/core';
import { decompress as unzstd } from 'fzstd';
import { compress, decompress as unlz4 } from 'lz4js';
import { spawn, spawnSync, type ChildProcess } from 'node:child_process';
import { createHash } from 'node:crypto';
import { mkdirSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { makeBag } from '../make_bag.mjs';
import { definitions, freePort, program, robot, until } from './harness';

type Record = McapTypes.TypedMcapRecord;
type Message = McapTypes.TypedMcapRecords['Message'];
type Channel = McapTypes.TypedMcapRecords['Channel'];
interface Qos {
  [name: string]: unknown;
}
interface Metadata {
  version: number;
  storage_identifier: string;
  duration: { nanoseconds: number };
  starting_time: { nanoseconds_since_epoch: number };
  message_count: number;
  topics_with_message_count: { topic_metadata: { name: string; type: string; serialization_format: string; offered_qos_profiles: Qos[]; type_description_hash: string }; message_count: number }[];
  compression_format: string;
  compression_mode: string;
  relative_file_paths: string[];
  files: { path: string; starting_time: { nanoseconds_since_epoch: number }; duration: { nanoseconds: number }; message_count: number }[];
  custom_data: unknown;
  ros_distro: string;
}
interface Info {
  files: string[];
  size: number;
  messages: number;
  start: number;
  end: number;
  profile: string;
  library: string;
  notes: string[];
  topics: { name: string; type: string; encoding: string; messages: number }[];
}

const work = mkdtempSync(join(tmpdir(), 'doppel-bags-'));
const environment = { ...process.env, XDG_RUNTIME_DIR: join(work, '.run'), HOME: work, DOPPEL_PORT: '' };
const decompressHandlers = { zstd: (bytes: Uint8Array) => unzstd(bytes), lz4: (bytes: Uint8Array, size: bigint) => Uint8Array.from(unlz4(bytes, Number(size))) };
let twin: ChildProcess | null = null;

// The output of the program, which ends with the exit code `code`.
function doppel(args: string[], code = 0): string {
  const done = spawnSync(program, args, { cwd: work, env: environment, encoding: 'utf8', timeout: 60_000 });
  assert.equal(done.status, code, `doppel ${args.join(' ')}\n${done.stdout}${done.stderr}`);
  return done.stdout + done.stderr;
}
const infoOf = (bag: string): Info => JSON.parse(doppel(['bag', 'info', bag, '--json'])) as Info;

// Texts of YAML by the parser of Python.
function yaml<T>(texts: string[]): T[] {
  const script = 'import json, sys, yaml\nprint(json.dumps([yaml.safe_load(text) for text in json.load(sys.stdin)]))';
  const done = spawnSync('python3', ['-c', script], { input: JSON.stringify(texts), encoding: 'utf8' });
  assert.equal(done.status, 0, done.stderr);
  return JSON.parse(done.stdout) as T[];
}

// Everything in a file, in the order of its records.
class Content {
  readonly records: Record[] = [];
  readonly channels = new Map<number, Channel>();
  readonly schemas = new Map<number, McapTypes.TypedMcapRecords['Schema']>();
  readonly messages: Message[] = [];

  constructor(readonly file: string) {
    const reader = new McapStreamReader({ validateCrcs: true, includeChunks: true, decompressHandlers });
    reader.append(readFileSync(file));
    for (let record = reader.nextRecord(); record; record = reader.nextRecord()) {
      this.records.push(record);
      if (record.type === 'Channel') this.channels.set(record.id, record);
      else if (record.type === 'Schema') this.schemas.set(record.id, record);
      else if (record.type === 'Message') this.messages.push({ ...record, data: record.data.slice() });
    }
    assert.ok(reader.done(), `${file} has no end`);
  }

  all<T extends Record['type']>(type: T): McapTypes.TypedMcapRecords[T][] {
    return this.records.filter((record) => record.type === type) as McapTypes.TypedMcapRecords[T][];
  }
  topicOf(message: Message): string {
    return this.channels.get(message.channelId)!.topic;
  }
}

const hash = (bytes: Uint8Array): string => createHash('sha1').update(bytes).digest('hex');
const textOf = (content: Content, message: Message): string => `${content.topicOf(message)} ${message.sequence} ${message.logTime} ${message.publishTime} ${hash(message.data)}`;
const allOf = (contents: Content[]): string[] => contents.flatMap((content) => content.messages.map((message) => textOf(content, message)));
const counts = (keys: Iterable<string>): Map<string, number> => {
  const found = new Map<string, number>();
  for (const key of keys) found.set(key, (found.get(key) ?? 0) + 1);
  return new Map([...found].sort(([a], [b]) => (a < b ? -1 : 1)));
};
const byTime = (a: Message, b: Message): number => (a.logTime < b.logTime ? -1 : a.logTime > b.logTime ? 1 : 0);

const filesOf = (bag: string): string[] =>
  bag.endsWith('.mcap') ? [join(work, bag)] : readdirSync(join(work, bag)).filter((name) => name.endsWith('.mcap')).sort((a, b) => a.localeCompare(b, 'en', { numeric: true })).map((name) => join(work, bag, name));
const read = (bag: string): Content[] => filesOf(bag).map((file) => new Content(file));

async function indexed(file: string): Promise<McapIndexedReader> {
  const bytes = readFileSync(file);
  const readable = {
    size: () => Promise.resolve(BigInt(bytes.length)),
    read: (offset: bigint, size: bigint) => Promise.resolve(new Uint8Array(bytes.subarray(Number(offset), Number(offset + size)))),
  };
  return McapIndexedReader.Initialize({ readable, decompressHandlers });
}
async function listOf<T>(items: AsyncIterable<T>): Promise<T[]> {
  const list: T[] = [];
  for await (const item of items) list.push(item);
  return list;
}

// The bags of the tests: everything of a run with a motion and a call, and copies of it.
const BAGS = ['run', 'lz4', 'none', 'parts'];
before(async () => {
  mkdirSync(join(work, '.run'), { mode: 0o700 });
  const port = String(await freePort());
  let log = '';
  const child = spawn(program, ['up', robot, '--record', 'run', '--headless', '--no-ros', '--port', port], { cwd: work, env: environment });
  twin = child;
  child.stdout.on('data', (text) => (log += String(text)));
  child.stderr.on('data', (text) => (log += String(text)));
  await until(`a twin\n${log}`, () => log.includes('page  '));
  doppel(['move', 'Revolute 1=0.4', '--in', '1', '--port', port]);
  doppel(['control', 'list_controllers', '--port', port]);
  child.kill('SIGINT');
  await until('the end of the recording', () => child.exitCode !== null);
  assert.equal(child.exitCode, 0, log);
  doppel(['bag', 'convert', 'run', '-o', 'lz4', '--compression', 'lz4']);
  doppel(['bag', 'convert', 'run', '-o', 'none', '--compression', 'none']);
  doppel(['bag', 'convert', 'run', '-o', 'parts', '--max-bag-duration', '0.5']);
});
after(() => {
  twin?.kill('SIGKILL');
  rmSync(work, { recursive: true, force: true });
});

for (const bag of BAGS) {
  test(`${bag}: with and without the index there are the same messages, attachments and metadata`, async () => {
    for (const content of read(bag)) {
      const reader = await indexed(content.file);
      const found = await listOf(reader.readMessages({ validateCrcs: true }));
      const text = (message: Message): string => textOf(content, message);
      assert.ok(found.length > 0);
      assert.deepEqual(counts(found.map(text)), counts(content.messages.map(text)));
      assert.deepEqual(found.map((message) => message.logTime), [...content.messages].sort(byTime).map((message) => message.logTime));
      const attachments = await listOf(reader.readAttachments({ validateCrcs: true }));
      assert.deepEqual(attachments.map((one) => [one.name, one.mediaType, one.logTime, hash(one.data)]), content.all('Attachment').map((one) => [one.name, one.mediaType, one.logTime, hash(one.data)]));
      assert.deepEqual((await listOf(reader.readMetadata())).map((one) => [one.name, one.metadata]), content.all('Metadata').map((one) => [one.name, one.metadata]));
      assert.deepEqual(reader.chunkIndexes.map((index) => index.compression), content.all('Chunk').map(() => ({ run: 'zstd', lz4: 'lz4', none: '', parts: 'zstd' })[bag]!));
    }
  });

  test(`${bag}: the statistics and the index of topics are those of the messages`, async () => {
    for (const content of read(bag)) {
      const reader = await indexed(content.file);
      const { statistics } = reader;
      const times = content.messages.map((message) => message.logTime).sort((a, b) => (a < b ? -1 : a > b ? 1 : 0));
      assert.equal(statistics!.messageCount, BigInt(content.messages.length));
      assert.equal(statistics!.schemaCount, content.schemas.size);
      assert.equal(statistics!.channelCount, content.channels.size);
      assert.equal(statistics!.attachmentCount, content.all('Attachment').length);
      assert.equal(statistics!.metadataCount, content.all('Metadata').length);
      assert.equal(statistics!.chunkCount, content.all('Chunk').length);
      assert.equal(statistics!.messageStartTime, times[0]);
      assert.equal(statistics!.messageEndTime, times.at(-1));
      assert.deepEqual(counts(content.messages.map((message) => String(message.channelId))),
        new Map([...statistics!.channelMessageCounts].filter(([, count]) => count > 0n).map(([id, count]) => [String(id), Number(count)] as const).sort(([a], [b]) => (a < b ? -1 : 1))));
      assert.deepEqual([...reader.channelsById.keys()].sort(), [...content.channels.keys()].sort());
      for (const [id, schema] of reader.schemasById) assert.equal(hash(schema.data), hash(content.schemas.get(id)!.data));
      assert.equal(reader.header.profile, 'ros2');
    }
  });

  test(`${bag}: metadata.yaml is that of rosbag2 version 9 and agrees with the files and with bag info`, () => {
    const contents = read(bag);
    const [root] = yaml<{ rosbag2_bagfile_information: Metadata }>([readFileSync(join(work, bag, 'metadata.yaml'), 'utf8')]);
    const metadata = root!.rosbag2_bagfile_information;
    const times = (list: Content[]): number[] => list.flatMap((content) => content.messages.map((message) => Number(message.logTime)));
    const span = (list: number[]) => ({ starting_time: { nanoseconds_since_epoch: Math.min(...list) }, duration: { nanoseconds: Math.max(...list) - Math.min(...list) } });
    assert.deepEqual(Object.keys(metadata), ['version', 'storage_identifier', 'duration', 'starting_time', 'message_count', 'topics_with_message_count', 'compression_format', 'compression_mode', 'relative_file_paths', 'files', 'custom_data', 'ros_distro']);
    assert.equal(metadata.version, 9);
    assert.equal(metadata.storage_identifier, 'mcap');
    assert.equal(metadata.compression_format + metadata.compression_mode, ''); // chunks are compressed, not files
    assert.deepEqual(metadata.relative_file_paths, contents.map((content) => basename(content.file)));
    assert.deepEqual(metadata.files, contents.map((content) => ({ path: basename(content.file), ...span(times([content])), message_count: content.messages.length })));
    assert.deepEqual({ starting_time: metadata.starting_time, duration: metadata.duration }, span(times(contents)));
    assert.equal(metadata.message_count, times(contents).length);
    const topics = counts(contents.flatMap((content) => content.messages.map((message) => content.topicOf(message))));
    assert.deepEqual(new Map(metadata.topics_with_message_count.filter((one) => one.message_count > 0).map((one) => [one.topic_metadata.name, one.message_count])), topics);

    const info = infoOf(bag);
    assert.deepEqual(info.files.map((file) => basename(file)), metadata.relative_file_paths);
    assert.deepEqual([info.messages, info.start, info.end], [metadata.message_count, metadata.starting_time.nanoseconds_since_epoch, metadata.starting_time.nanoseconds_since_epoch + metadata.duration.nanoseconds]);
    assert.deepEqual(info.notes, []);
    assert.deepEqual(info.topics.map((one) => [one.name, one.type, one.encoding, one.messages]),
      metadata.topics_with_message_count.map((one) => [one.topic_metadata.name, one.topic_metadata.type, one.topic_metadata.serialization_format, one.message_count])
        .sort(([a], [b]) => (a! < b! ? -1 : 1)));
  });

  test(`${bag}: each topic has its type, the qualities of rosbag2 and the hash of its type, in the file as in metadata.yaml`, () => {
    const [root] = yaml<{ rosbag2_bagfile_information: Metadata }>([readFileSync(join(work, bag, 'metadata.yaml'), 'utf8')]);
    const topics = new Map(root!.rosbag2_bagfile_information.topics_with_message_count.map((one) => [one.topic_metadata.name, one.topic_metadata]));
    for (const content of read(bag)) {
      const channels = [...content.channels.values()];
      const profiles = yaml<Qos[]>(channels.map((channel) => channel.metadata.get('offered_qos_profiles')!));
      channels.forEach((channel, i) => {
        const topic = topics.get(channel.topic)!;
        const schema = content.schemas.get(channel.schemaId)!;
        assert.deepEqual([channel.messageEncoding, schema.encoding, schema.name], [topic.serialization_format, 'ros2msg', topic.type]);
        assert.deepEqual(profiles[i], topic.offered_qos_profiles);
        assert.equal(channel.metadata.get('topic_type_hash'), topic.type_description_hash);
        assert.match(topic.type_description_hash, /^RIHS01_[0-9a-f]{64}$/);
        for (const profile of profiles[i]!) {
          assert.deepEqual(Object.keys(profile), ['history', 'depth', 'reliability', 'durability', 'deadline', 'lifespan', 'liveliness', 'liveliness_lease_duration', 'avoid_ros_namespace_conventions']);
          assert.deepEqual(profile['deadline'], { sec: 9223372036, nsec: 854775807 }); // RMW_DURATION_INFINITE
        }
        if (channel.topic === '/robot_description') assert.equal(profiles[i]![0]!['durability'], 'transient_local');
        if (channel.topic === '/tf') assert.equal(profiles[i]![0]!['durability'], 'volatile');
      });
    }
  });
}

test('every message is read by another parser of CDR, and written by it to the same bytes', () => {
  const [content] = read('run');
  const types = new Map([...content!.schemas].map(([id, schema]) => {
    const parsed = definitions(new TextDecoder().decode(schema.data));
    return [id, { reader: new MessageReader(parsed), writer: new MessageWriter(parsed) }] as const;
  }));
  for (const message of content!.messages) {
    const { reader, writer } = types.get(content!.channels.get(message.channelId)!.schemaId)!;
    const value = reader.readMessage(message.data);
    assert.deepEqual(writer.writeMessage(value), message.data, content!.topicOf(message));
  }
});

test('the numbers of the messages of a topic have no gap, and times of joint states are those of their stamps', () => {
  const [content] = read('run');
  const last = new Map<number, number>();
  const joints = [...content!.channels.values()].find((channel) => channel.topic === '/joint_states')!;
  const reader = new MessageReader(definitions(new TextDecoder().decode(content!.schemas.get(joints.schemaId)!.data)));
  for (const message of content!.messages) {
    const before = last.get(message.channelId);
    if (before !== undefined) assert.equal(message.sequence, before + 1, content!.topicOf(message));
    last.set(message.channelId, message.sequence);
    if (message.channelId !== joints.id) continue;
    const { header } = reader.readMessage<{ header: { stamp: { sec: number; nanosec: number } } }>(message.data);
    assert.equal(message.logTime, BigInt(header.stamp.sec) * 1_000_000_000n + BigInt(header.stamp.nanosec));
  }
});

test('copies of another compression have the same messages; each part of a split one begins with the latched ones', () => {
  const run = read('run');
  assert.deepEqual(allOf(read('lz4')), allOf(run));
  assert.deepEqual(allOf(read('none')), allOf(run));
  const parts = read('parts');
  assert.ok(parts.length > 1);
  const known = new Set(allOf(run).map((text) => text.split(' ').at(-1)));
  for (const text of allOf(parts)) assert.ok(known.has(text.split(' ').at(-1)), text);
  for (const content of parts) assert.ok(content.messages.slice(0, 20).some((message) => content.topicOf(message) === '/robot_description'), content.file);
  // A repeated message keeps the time of its publication; its numbers are those of the file.
  const once = (contents: Content[]): string[] => contents.flatMap((content) => content.messages
    .filter((message) => message.publishTime === message.logTime && /^\/(joint_states|tf|clock)$/.test(content.topicOf(message)))
    .map((message) => textOf(content, message).replace(/ \d+/, '')));
  assert.deepEqual(once(parts), once(run));
});

// -- the other way
class Memory {
  private readonly parts: Uint8Array[] = [];
  private size = 0n;
  readonly position = (): bigint => this.size;
  readonly write = async (bytes: Uint8Array): Promise<void> => {
    this.parts.push(bytes.slice());
    this.size += BigInt(bytes.length);
  };
  get bytes(): Uint8Array {
    return Buffer.concat(this.parts);
  }
}

const NO_SUMMARY = { useStatistics: false, useSummaryOffsets: false, repeatSchemas: false, repeatChannels: false, useChunkIndex: false, useAttachmentIndex: false, useMetadataIndex: false };

// 300 numbers and 30 texts; `times` gives the time of the i-th message in ms.
async function numbers(options: object, times = (i: number): number => 10 * i): Promise<Uint8Array> {
  const memory = new Memory();
  const writer = new McapWriter({ writable: memory, chunkSize: 2000, ...options });
  await writer.start({ profile: 'ros2', library: 'npm' });
  const channels: { id: number; write: MessageWriter; sequence: number }[] = [];
  for (const [topic, type, text] of [['/count', 'std_msgs/msg/UInt32', 'uint32 data'], ['/text', 'std_msgs/msg/String', 'string data']] as const) {
    const schemaId = await writer.registerSchema({ name: type, encoding: 'ros2msg', data: new TextEncoder().encode(text) });
    channels.push({ id: await writer.registerChannel({ schemaId, topic, messageEncoding: 'cdr', metadata: new Map() }), write: new MessageWriter(definitions(text)), sequence: 0 });
  }
  for (let i = 0; i < 300; i += 1) {
    for (const [k, channel] of channels.entries()) {
      if (k === 1 && i % 10 !== 0) continue;
      const time = BigInt(times(i)) * 1_000_000n + 1_700_000_000_000_000_000n;
      await writer.addMessage({ channelId: channel.id, sequence: ++channel.sequence, logTime: time, publishTime: time + 7n, data: channel.write.writeMessage({ data: k === 1 ? `number ${i}` : i }) });
    }
  }
  await writer.addAttachment({ name: 'note.txt', mediaType: 'text/plain', logTime: 1n, createTime: 2n, data: new TextEncoder().encode('a note') });
  await writer.addMetadata({ name: 'run', metadata: new Map([['operator', 'someone']]) });
  await writer.end();
  return memory.bytes;
}

// A writer may leave out check sums: they are 0 then.
function withoutSums(bytes: Uint8Array): Uint8Array {
  const copy = Uint8Array.from(bytes);
  const view = new DataView(copy.buffer);
  const place: { [opcode: number]: number } = { 0x02: 16, 0x06: 24, 0x0f: 0 }; // Footer, Chunk, DataEnd
  for (let at = 8; at + 9 < copy.length; at += 9 + Number(view.getBigUint64(at + 1, true))) {
    const offset = place[view.getUint8(at)];
    if (offset !== undefined) view.setUint32(at + 9 + offset, 0, true);
  }
  return copy;
}

const lz4 = (bytes: Uint8Array) => ({ compression: 'lz4', compressedData: Uint8Array.from(compress(bytes)) });

const WRITTEN: { [name: string]: () => Promise<Uint8Array> } = {
  'in chunks': () => numbers({}),
  'in chunks of lz4': () => numbers({ compressChunk: lz4 }),
  'outside of chunks': () => numbers({ useChunks: false }),
  'without check sums': async () => withoutSums(await numbers({})),
  'without an index of messages': () => numbers({ useMessageIndex: false }),
  'without a summary': () => numbers(NO_SUMMARY),
  'without a summary and chunks': () => numbers({ ...NO_SUMMARY, useChunks: false }),
  'with mixed times': () => numbers({}, (i) => 10 * ((i * 77) % 300)),
};

for (const [name, write] of Object.entries(WRITTEN)) {
  test(`what is written ${name} is read by info, check, recover, convert and play`, async () => {
    const file = `${name.replaceAll(' ', '_')}.mcap`;
    writeFileSync(join(work, file), await write());
    const written = new Content(join(work, file));
    assert.equal(written.messages.length, 330);
    const info = infoOf(file);
    assert.deepEqual([info.messages, info.start, info.end], [330, 1_700_000_000_000_000_000, 1_700_000_002_990_000_000]);
    assert.deepEqual(info.topics, [{ name: '/count', type: 'std_msgs/msg/UInt32', encoding: 'cdr', messages: 300 }, { name: '/text', type: 'std_msgs/msg/String', encoding: 'cdr', messages: 30 }]);
    assert.match(doppel(['bag', 'check', file]), /no damage, 330 messages/);
    assert.match(doppel(['bag', 'recover', file, '-o', `recovered_${file}`]), /330 messages/);
    const recovered = read(`recovered_${file}`);
    assert.deepEqual(allOf(recovered), allOf([written]));
    assert.deepEqual(recovered[0]!.all('Attachment').map((one) => new TextDecoder().decode(one.data)), ['a note']);
    assert.equal(recovered[0]!.all('Metadata').find((one) => one.name === 'run')!.metadata.get('operator'), 'someone');
    doppel(['bag', 'convert', file, '-o', `bag_${file.replace('.mcap', '')}`, '--compression', 'lz4']);
    assert.deepEqual(counts(allOf(read(`bag_${file.replace('.mcap', '')}`))), counts(allOf([written])));
    const port = String(await freePort());
    assert.match(doppel(['bag', 'play', file, '--no-ros', '--headless', '--port', port, '--rate', '100']), /played 330 messages/);
  });
}

test('a bag of the page\'s tests is played, with the schemas that are in it', async () => {
  writeFileSync(join(work, 'page.mcap'), await makeBag({ compression: 'lz4' }));
  assert.match(doppel(['bag', 'check', 'page.mcap']), /no damage/);
  assert.equal(infoOf('page.mcap').messages, read('page.mcap')[0]!.messages.length);
});
