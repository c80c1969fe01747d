// Reads the messages of a running twin, and those that a thousand joints would cause; prints the medians of rounds.
import * as otherCdr from 'other/cdr';
import * as otherSchema from 'other/schema';
import { parse } from '@foxglove/rosmsg';
import * as cdr from '../../src/protocol/cdr';
import * as schema from '../../src/protocol/schema';
import { Peer, Program, sleep, until } from '../conformance/harness';

const LISTENED = 4; // s
const KEPT = 200; // messages of a topic
const ROUNDS = 31;
const LEAST = 2000; // messages of a round
const READ = /^\/(tf|joint_states|clock|gazebo\/contacts|doppel\/(status|joint_loads|objects)|.*\/controller_state)$/; // what the page reads while it is open

interface Heard {
  name: string;
  text: string;
  rate: number; // Hz
  messages: DataView[];
}

const compare = process.argv[2];
const median = (values: number[]): number => [...values].sort((a, b) => a - b)[values.length >> 1]!;

async function listen(): Promise<{ heard: Map<string, Heard>; schemas: [string, string][] }> {
  const program = new Program();
  await program.start();
  const peer = new Peer(program.port);
  const heard = new Map<string, Heard>();
  try {
    await until('the topics', () => peer.channels.has('/omarm_arm_controller/controller_state') && peer.channels.has('/doppel/status'));
    const topics = new Map<number, Heard>();
    peer.client.on('message', ({ subscriptionId, data }) => {
      const one = topics.get(subscriptionId)!;
      one.rate += 1 / LISTENED;
      if (one.messages.length < KEPT) one.messages.push(data as DataView);
    });
    for (const { id, topic, schemaName, schema: text } of peer.channels.values()) {
      if (!READ.test(topic)) continue;
      heard.set(topic, { name: schemaName, text, rate: 0, messages: [] });
      topics.set(peer.client.subscribe(id), heard.get(topic)!);
    }
    await sleep(LISTENED * 1000);
    const parts = [...peer.services.values()].flatMap((service) => [service.request!, service.response!]);
    return { heard, schemas: [...[...peer.channels.values()], ...parts].map((one) => [one.schemaName, one.schema]) };
  } finally {
    peer.close();
    program.stop();
  }
}

// In a frame, where messages begin at an odd byte.
function framed(type: schema.MessageType, message: cdr.Message): DataView {
  const payload = cdr.writeCdr(type, message);
  const frame = new Uint8Array(13 + payload.length);
  frame.set(payload, 13);
  return new DataView(frame.buffer, 13);
}

function many(heard: Map<string, Heard>): [string, Heard][] {
  const names = Array.from({ length: 1000 }, (_, i) => `joint_${i}`), numbers = names.map((_, i) => i * 0.001);
  const header = { stamp: { sec: 1, nanosec: 2 }, frame_id: 'base_link' };
  const transform = { translation: { x: 1, y: 2, z: 3 }, rotation: { x: 0, y: 0, z: 0, w: 1 } };
  const made = (topic: string, message: cdr.Message): [string, Heard] => {
    const { name, text, rate } = heard.get(topic)!;
    return [`${topic}, 1000 joints`, { name, text, rate, messages: [framed(schema.parseSchema(name, text).get(schema.shortName(name))!, message)] }];
  };
  return [made('/tf', { transforms: names.map((child_frame_id) => ({ header, child_frame_id, transform })) }),
    made('/joint_states', { header, name: names, position: numbers, velocity: numbers, effort: numbers })];
}

// Microseconds of each reader for a message, in turns.
function cost({ name, text, messages }: Heard): [number, number] {
  const ours = schema.parseSchema(name, text).get(schema.shortName(name))!;
  const theirs = otherSchema.parseSchema(name, text).get(otherSchema.shortName(name))!;
  const readers = [(data: DataView) => cdr.readCdr(ours, data), (data: DataView) => otherCdr.readCdr(theirs, data)];
  const turns = Math.max(10, Math.ceil(LEAST / messages.length / (messages[0]!.byteLength > 10_000 ? 100 : 1)));
  const took: [number[], number[]] = [[], []];
  for (let round = 0; round < ROUNDS; round += 1) {
    for (const which of round % 2 ? [0, 1] as const : [1, 0] as const) {
      const began = performance.now();
      for (let i = 0; i < turns; i += 1) for (const message of messages) readers[which]!(message);
      if (round > 2) took[which].push(((performance.now() - began) * 1000) / turns / messages.length);
    }
  }
  return [median(took[0]), median(took[1])];
}

const { heard, schemas } = await listen();
console.log(`\nreading, µs a message${compare ? `; ${compare}; ratio` : ''}`);
const total = [0, 0];
for (const [topic, one] of [...heard, ...many(heard)]) {
  if (one.messages.length === 0) continue;
  const [ours, theirs] = cost(one);
  if (heard.has(topic)) [ours, theirs].forEach((us, i) => (total[i]! += us * one.rate * 1e-3));
  console.log(`  ${topic.padEnd(46)}${one.rate.toFixed(0).padStart(5)} Hz${String(one.messages[0]!.byteLength).padStart(8)} B${ours.toFixed(2).padStart(10)}${compare ? `${theirs.toFixed(2).padStart(10)}${(ours / theirs).toFixed(2).padStart(7)}` : ''}`);
}
console.log(`  all of omarm_one: ${total[0]!.toFixed(2)} ms of each second${compare ? `; ${total[1]!.toFixed(2)}; ${(total[0]! / total[1]!).toFixed(2)}` : ''}`);

const times: [number[], number[]] = [[], []];
for (let round = 0; round < ROUNDS; round += 1) {
  const began = performance.now();
  for (const [name, text] of schemas) schema.parseSchema(name, text);
  const between = performance.now();
  for (const [, text] of schemas) parse(text, { ros2: true });
  times[0].push(between - began);
  times[1].push(performance.now() - between);
}
console.log(`\n${schemas.length} schemas, ms the first time; median: own ${times[0][0]!.toFixed(1)}; ${median(times[0]).toFixed(1)}, @foxglove/rosmsg ${times[1][0]!.toFixed(1)}; ${median(times[1]).toFixed(1)}`);
process.exit(0);
