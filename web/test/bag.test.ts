// Recordings: files with and without an index, by slices and by HTTP ranges; the state of topics at a time; what cannot be read.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Bag, openBag, type Topic } from '../src/bag/bag';
import { bytesAt, FileBytes } from '../src/bag/bytes';
import { BagProblem } from '../src/bag/problem';
import { listedFiles, openDropped } from '../src/bag/folder';
import { residualOf } from '../src/bag/residual';
import { BagSource } from '../src/bag/source';
import { Survey } from '../src/bag/survey';
import { Recorder } from '../src/app/recorder';
import { recordedSensors } from '../src/app/sensors';
import { Twin } from '../src/app/twin';
import { readCdr } from '../src/protocol/cdr';
import { Client } from '../src/protocol/client';
import { parseSchema, shortName } from '../src/protocol/schema';
import { unlz4 } from '../src/bag/lz4';
import { compress } from 'lz4js';
import { elbowAt, makeBag, MESH, meshBytes, shoulderAt, START, URDF } from './make_bag.mjs';

Object.assign(globalThis, { location: new URL('http://page.test/'), window: globalThis });

const silent = (): void => {};
const blobOf = (bytes: Uint8Array): Blob => new Blob([bytes as BlobPart]);
const open = async (options = {}, name = 'run.mcap'): Promise<Bag> => openBag(name, [new FileBytes(name, blobOf(await makeBag(options)))], silent);
const until = async (what: string, check: () => boolean): Promise<void> => {
  for (let i = 0; i < 500; i += 1) {
    if (check()) return;
    await new Promise((done) => setTimeout(done, 5));
  }
  throw new Error(`${what} did not happen`);
};
const topicOf = (bag: Bag, name: string): Topic => bag.topic(name)!;
const read = ({ topic, data }: { topic: Topic; data: Uint8Array }) => readCdr(parseSchema(topic.type, topic.schema).get(shortName(topic.type))!, data);
const near = (value: number, expected: number, message?: string): void => assert.ok(Math.abs(value - expected) < 1e-9, `${message ?? ''} ${value} instead of ${expected}`);

// A twin that reads the recording, as the page has it.
function follow(bag: Bag): { twin: Twin; source: BagSource } {
  const twin = new Twin(new Client({ url: '' }));
  const source = new BagSource(bag);
  source.onjump = () => twin.rewind([]);
  twin.read(source);
  source.start();
  source.goTo(0);
  return { twin, source };
}
const goTo = async (source: BagSource, time: number): Promise<void> => {
  source.goTo(time);
  await until('the jump', () => !source.isJumping && source.time === time);
};
const jointOf = (twin: Twin, name: string): number => twin.q[twin.tree!.jointByName.get(name)!.index]!;

for (const [kind, options] of Object.entries({ 'without compression': {}, 'of lz4': { compression: 'lz4' }, 'of zstd': { compression: 'zstd' }, 'outside of chunks': { chunks: false } })) {
  test(`a recording ${kind} has its topics, counts and messages`, async () => {
    const bag = await open(options);
    near(bag.length, 10.01);
    assert.equal(bag.start, START);
    assert.equal(topicOf(bag, '/joint_states').count, 501);
    assert.equal(topicOf(bag, '/robot_description').isLatched, true);
    assert.equal(topicOf(bag, '/joint_states').isLatched, false);
    const found = await bag.range(new Set([topicOf(bag, '/joint_states')]), 2, 3);
    assert.equal(found.length, 50);
    near(found[0]!.time, 2.02);
    near(found.at(-1)!.time, 3);
    near((read(found[0]!)['position'] as number[])[0]!, shoulderAt(2.02));
    assert.deepEqual(bag.warnings, 'chunks' in options ? ['run.mcap has no index of its messages; it was read as a whole.'] : []);
  });
}

test('attachments give meshes and marks, metadata with a time too', async () => {
  const bag = await open();
  assert.deepEqual(await bag.attachment(MESH), meshBytes());
  assert.equal(await bag.attachment('package://small_arm/meshes/none.stl'), null);
  assert.deepEqual(bag.events, [{ time: 4, text: 'note.txt (text/plain)' }, { time: 5, text: 'event: the light went out' }]);
});

test('the newest message until a time; of a latched topic the first one before it was sent', async () => {
  const bag = await open();
  const [joints] = await bag.latest(topicOf(bag, '/joint_states'), 3.999);
  near(joints!.time, 3.98);
  const [latched] = await bag.latest(topicOf(bag, '/robot_description'), 9);
  assert.equal(read(latched!)['data'], URDF);
  assert.equal((await bag.latest(topicOf(bag, '/robot_description'), 0)).length, 1, 'before it was sent');
  assert.equal((await bag.latest(topicOf(bag, '/rosout'), 0.5)).length, 0, 'latched as in ROS 2, and logged later');
  assert.deepEqual((await bag.latest(topicOf(bag, '/rosout'), 5.5, { most: 3 })).map((one) => read(one)['msg']), ['the goal is near a limit', 'second 4', 'second 5']);
});

test('steps go to the next message of a topic and to the one before, and stay at the ends', async () => {
  const bag = await open();
  const joints = new Set([topicOf(bag, '/joint_states')]);
  near(await bag.step(joints, 4, 1), 4.02);
  near(await bag.step(joints, 4, -1), 3.98);
  near(await bag.step(joints, 10, 1), 10);
  near(await bag.step(joints, 0, -1), 0);
});

test('a jump shows the state of its time, forwards and backwards; play continues from there', async () => {
  const { twin, source } = follow(await open());
  await until('the description', () => twin.tree !== null && !source.isJumping);
  assert.equal(twin.recording, 'run.mcap');
  await goTo(source, 8);
  near(jointOf(twin, 'shoulder'), shoulderAt(8));
  assert.equal(twin.log.at(-1)!.text, 'second 7');
  await goTo(source, 2.5);
  near(jointOf(twin, 'shoulder'), shoulderAt(2.5));
  near(jointOf(twin, 'elbow'), elbowAt(2.5));
  assert.deepEqual(twin.log.map((line) => line.text), ['second 1', 'second 2'], 'later lines are gone');
  await source.advance(3.1);
  near(jointOf(twin, 'shoulder'), shoulderAt(3.1));
  assert.deepEqual(twin.log.map((line) => line.level), [20, 20, 30]);
  near(source.time, 3.1);
});

test('before its first message a robot has the state of that message', async () => {
  const { twin, source } = follow(await open({ from: 0.005 }));
  await until('the description', () => twin.tree !== null && !source.isJumping);
  near(source.time, 0);
  near(jointOf(twin, 'shoulder'), shoulderAt(0.02));
  near(jointOf(twin, 'elbow'), elbowAt(0.02));
});

test('of several jumps the newest is shown', async () => {
  const { twin, source } = follow(await open());
  await until('the description', () => twin.tree !== null);
  for (const time of [1, 9, 3, 7, 5]) source.goTo(time);
  await until('the last jump', () => !source.isJumping && source.time === 5);
  near(jointOf(twin, 'shoulder'), shoulderAt(5));
});

test('a topic that is subscribed later begins with the message of the present time', async () => {
  const bag = await open();
  const { twin, source } = follow(bag);
  await goTo(source, 6);
  const seen: number[] = [];
  twin.client.subscribe('/camera/image_raw', (m) => seen.push((m['data'] as Uint8Array)[0]!));
  await until('the picture', () => seen.length > 0);
  assert.deepEqual(seen, [29]);
});

test('a topic that is subscribed during a jump begins with the message of the new time', async () => {
  const { twin, source } = follow(await open());
  await until('the description', () => twin.tree !== null && !source.isJumping);
  const seen: number[] = [];
  source.goTo(8);
  twin.client.subscribe('/camera/image_raw', (m) => seen.push((m['data'] as Uint8Array)[0]!));
  await until('the picture', () => seen.length > 0 && !source.isJumping);
  assert.deepEqual(seen, [39]);
});

test('the sensors of a recording without a list of them are those of its topics', async () => {
  const { twin } = follow(await open());
  assert.deepEqual(recordedSensors(twin.client.channels.values()).map(({ name, type, topics }) => ({ name, type, topics })), [{ name: 'camera', type: 'camera', topics: ['/camera/image_raw'] }]);
  const of = (topic: string, schemaName: string): { topic: string; schemaName: string } => ({ topic, schemaName });
  const found = recordedSensors([of('/left/rgb/image_raw', 'sensor_msgs/msg/Image'), of('/left/rgb/image_raw/compressed', 'sensor_msgs/msg/CompressedImage'), of('/left/rgb/camera_info', 'sensor_msgs/msg/CameraInfo'),
    of('/scan', 'sensor_msgs/msg/LaserScan'), of('/tf', 'tf2_msgs/msg/TFMessage')]);
  assert.deepEqual(found.map(({ name, topics }) => [name, topics.length]), [['left/rgb', 3], ['scan', 1]]);
});

test('the curves of the whole recording are read, and repeated for a new one', async () => {
  const bag = await open();
  const recorder = new Recorder(new Twin(new Client({ url: '' })), { reference: () => NaN, tolerance: () => NaN });
  const survey = new Survey(bag, recorder, () => false);
  survey.begin();
  await until('the survey', () => survey.isComplete);
  recorder.joint(survey.twin.tree!.jointByName.get('shoulder')!, 'position');
  recorder.joint(survey.twin.tree!.jointByName.get('shoulder')!, 'target');
  await new Promise((done) => setTimeout(done, 5)); // it begins again
  await until('the next survey', () => survey.isComplete);
  const [times, positions, targets] = recorder.window(-Infinity, Infinity, ['joint:shoulder:position', 'joint:shoulder:target']);
  assert.equal(times!.length, 501);
  for (let i = 0; i < 501; i += 1) near(positions![i]!, shoulderAt(times![i]!));
  assert.ok(targets!.every(Number.isNaN), 'nothing publishes a target');
  near(recorder.valueAt('joint:shoulder:position', 4.01), (shoulderAt(4) + shoulderAt(4.02)) / 2);
  assert.ok(Number.isNaN(recorder.valueAt('joint:shoulder:position', 20)));
  assert.deepEqual(survey.logUntil(3.5).map((line) => line.text), ['second 1', 'second 2', 'the goal is near a limit']);
  survey.stop();
});

test('of several robots the twin and the curves are those of the selected one', async () => {
  const bag = await open({ spaces: ['/left', '/right'] });
  const { twin, source } = follow(bag);
  await until('the description', () => twin.tree !== null && !source.isJumping);
  assert.deepEqual(twin.robots, ['/left', '/right']);
  const recorder = new Recorder(new Twin(new Client({ url: '' })), { reference: () => NaN, tolerance: () => NaN });
  recorder.joint(twin.tree!.jointByName.get('shoulder')!, 'position');
  const survey = new Survey(bag, recorder, () => false);
  survey.begin();
  await until('the survey', () => survey.isComplete);
  assert.deepEqual(survey.twin.robots, twin.robots);
  near(recorder.valueAt('joint:shoulder:position', 4), shoulderAt(4));
  twin.selectRobot('/right');
  survey.twin.selectRobot('/right');
  survey.restart();
  await new Promise((done) => setTimeout(done, 5));
  await until('the next survey', () => survey.isComplete);
  near(recorder.valueAt('joint:shoulder:position', 4), shoulderAt(4, 0.2));
  await goTo(source, 6);
  near(jointOf(twin, 'shoulder'), shoulderAt(6, 0.2));
  survey.stop();
});

test('the files of a bag are one recording, in the order of metadata.yaml or of their numbers', async () => {
  const parts = await Promise.all([[0, 4], [4, 8], [8, 99]].map(([from, to]) => makeBag({ from, to })));
  const names = ['run_2.mcap', 'run_10.mcap', 'run_9.mcap'];
  const dropped = [0, 2, 1].map((i, k) => ({ name: `run/${names[k]}`, file: blobOf(parts[i]!) as File }));
  const bag = await openDropped(dropped, silent);
  near(bag.length, 10.01);
  assert.deepEqual(bag.files.map(({ bytes }) => bytes.name), ['run/run_2.mcap', 'run/run_9.mcap', 'run/run_10.mcap']);
  assert.equal(topicOf(bag, '/joint_states').count, 501);
  const across = await bag.range(new Set([topicOf(bag, '/joint_states')]), 3.9, 4.1);
  assert.deepEqual(across.map(({ time }) => time.toFixed(2)), ['3.92', '3.94', '3.96', '3.98', '4.00', '4.02', '4.04', '4.06', '4.08', '4.10']);
  assert.equal((await bag.latest(topicOf(bag, '/robot_description'), 9)).length, 1, 'from the first file');
  const yaml = 'rosbag2_bagfile_information:\n  storage_identifier: mcap\n  relative_file_paths:\n    - run_2.mcap\n    - "run_9.mcap"\n  files: []\n';
  const listed = await openDropped([...dropped, { name: 'run/metadata.yaml', file: blobOf(new TextEncoder().encode(yaml)) as File }], silent);
  assert.equal(listed.files.length, 2);
  assert.equal(listed.name, 'run');
  assert.throws(() => listedFiles('storage_identifier: sqlite3\n', 'metadata.yaml'), /SQLite bag of rosbag2.*ros2 bag convert/);
  await assert.rejects(openDropped([{ name: 'metadata.yaml', file: blobOf(new TextEncoder().encode(yaml)) as File }], silent), /lists run_2\.mcap, which is not among the files/);
});

test('after a reset of a simulation, where doppel begins a file with earlier times, the time goes on', async () => {
  const parts = [await makeBag({ library: 'doppel', to: 6 }), await makeBag({ library: 'doppel', seconds: 4, offset: 0.3 })];
  const bag = await openBag('run', parts.map((bytes, i) => new FileBytes(`run_${i}.mcap`, blobOf(bytes))), silent);
  const end = 5.98; // of the first file
  near(bag.length, end + 4.01);
  const [joints] = await bag.latest(topicOf(bag, '/joint_states'), end + 2);
  near((read(joints!)['position'] as number[])[0]!, shoulderAt(2, 0.3));
  const others = [await makeBag({ to: 6 }), await makeBag({ seconds: 4 })];
  near((await openBag('run', others.map((bytes, i) => new FileBytes(`run_${i}.mcap`, blobOf(bytes))), silent)).length, 5.98, 'of another writer:');
});

test('a file that is cut off is read until there, and says so', async () => {
  const whole = await makeBag();
  const cut = whole.slice(0, Math.floor(whole.length / 2));
  const bag = await openBag('cut.mcap', [new FileBytes('cut.mcap', blobOf(cut))], silent);
  assert.ok(bag.length > 3 && bag.length < 7, String(bag.length));
  assert.match(bag.warnings[0]!, new RegExp(`cut\\.mcap ends at byte ${cut.length} without an index: .*'doppel bag recover'`));
  assert.match(bag.warnings[1]!, /cut\.mcap: the record at byte \d+ is cut off/);
  const [joints] = await bag.latest(topicOf(bag, '/joint_states'), 2);
  near((read(joints!)['position'] as number[])[0]!, shoulderAt(2));
});

test('a damaged chunk costs its own messages only', async () => {
  const bytes = await makeBag({ compression: 'lz4' });
  const bag = await openBag('run.mcap', [new FileBytes('run.mcap', blobOf(bytes))], silent);
  const broken = bag.spans[3]!.piece;
  bytes.fill(0xff, broken.from + 80, broken.from + broken.length);
  const damaged = await openBag('run.mcap', [new FileBytes('run.mcap', blobOf(bytes))], silent);
  const problems: string[] = [];
  damaged.onproblem = (text) => problems.push(text);
  const found = await damaged.range(new Set([topicOf(damaged, '/joint_states')]), -1, 99);
  assert.ok(found.length > 350 && found.length < 501, String(found.length));
  assert.match(problems[0]!, new RegExp(`^run\\.mcap, byte ${broken.from}: (the chunk|the check sum of the chunk) `));
});

test('a file that is damaged or cut off anywhere is read in part or refused with its name', async () => {
  let state = 12345; // of a generator with a constant seed
  const random = (below: number): number => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state % below;
  };
  for (const compression of ['', 'lz4', 'zstd']) {
    const whole = await makeBag({ seconds: 3, compression });
    for (let i = 0; i < 60; i += 1) {
      const bytes = i % 3 === 0 ? whole.slice(0, random(whole.length)) : whole.slice();
      for (let k = 0; k < i % 4; k += 1) bytes[random(bytes.length)] = random(256);
      try {
        const bag = await openBag('hurt.mcap', [new FileBytes('hurt.mcap', blobOf(bytes))], silent);
        bag.onproblem = (text) => assert.match(text, /^hurt\.mcap\b/);
        await bag.range(new Set(bag.topics), -1, 1e9);
      } catch (problem) {
        assert.ok(problem instanceof BagProblem, String((problem as Error).stack));
        assert.match(problem.message, /hurt\.mcap/);
      }
    }
  }
});

test('a scan reads the name of a large attachment, not the attachment', async () => {
  const whole = await makeBag({ large: 9e6 });
  const cut = whole.slice(0, whole.length - 100);
  const file = new FileBytes('run.mcap', blobOf(cut));
  let most = 0;
  const bag = await openBag('run.mcap', [{ name: file.name, size: file.size, isRemote: false, read: (from, length) => {
    most = Math.max(most, length);
    return file.read(from, length);
  } }], silent);
  assert.ok(most <= 4 * 1024 * 1024, `${most} bytes at once`);
  assert.deepEqual(bag.files[0]!.attachments.map(({ name }) => name), [MESH, 'film.mp4', 'note.txt']);
  assert.equal((await bag.attachment('film.mp4'))!.length, 9e6);
});

test('LZ4 frames with linked blocks, check sums and sizes are read; damaged ones end at once', () => {
  const text = Uint8Array.from({ length: 200_000 }, (_, i) => (i * i) % 251 ^ (i >> 9));
  const packed = Uint8Array.from(compress(text));
  assert.deepEqual(unlz4(packed, text.length), text);
  // A stored block, a block of "abcabcabcabc", with the size and sums of blocks and content.
  const made = Uint8Array.of(4, 0x22, 0x4d, 0x18, 0x5c, 0x40, 15, 0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0x80, 120, 121, 122, 9, 9, 9, 9, 6, 0, 0, 0, 0x35, 97, 98, 99, 3, 0, 9, 9, 9, 9, 0, 0, 0, 0, 9, 9, 9, 9);
  assert.equal(new TextDecoder().decode(unlz4(made, 15)), 'xyzabcabcabcabc');
  for (let i = 7; i < packed.length; i += 997) {
    const bad = packed.slice();
    bad.fill(0xff, i, i + 500);
    try {
      unlz4(bad, text.length);
    } catch (problem) {
      assert.match((problem as Error).message, /^(it|a|an) /);
    }
  }
  assert.throws(() => unlz4(packed.subarray(0, 50), text.length), /ends early/);
});

test('what is no MCAP file is named, with what to do', async () => {
  const fails = (content: string | Uint8Array, what: RegExp, name = 'run'): Promise<void> => {
    const bytes = typeof content === 'string' ? Uint8Array.from(content, (c) => c.charCodeAt(0)) : content;
    return assert.rejects(openBag(name, [new FileBytes(name, blobOf(bytes))], silent), what);
  };
  await fails('SQLite format 3\0 and more', /run\.db3 is a SQLite bag of rosbag2 .*doppel bag convert.*ros2 bag convert.*rosbags-convert/, 'run.db3');
  await fails('#ROSBAG V2.0\n', /run\.bag is a bag of ROS 1 .*rosbags-convert/, 'run.bag');
  await fails('\x28\xb5\x2f\xfd....', /compressed as a whole by zstd.*zstd -d run/);
  await fails('<!doctype html>', /a page of text/);
  await fails('a text of a file', /run is not an MCAP file: at byte 0 it has 61 20 74/);
  await fails('', /run is empty/);
  await fails(await makeBag({ compression: 'brotli' }), /run, byte \d+: the chunk is compressed by 'brotli'; this page reads zstd, lz4/);
  await assert.rejects(openBag('folder', [], silent), /folder has no \.mcap files/);
});

test('an address is read by ranges: the index, then what is shown, or as a whole from a server without them', async () => {
  const bytes = await makeBag({ seconds: 60, chunkSize: 128 * 1024 });
  let ranges = true, hidden = false, sent = 0, requests = 0;
  Object.assign(globalThis, { fetch: async (_: string, { headers = {}, method = 'GET' }: { headers?: Record<string, string>; method?: string } = {}) => {
    if (method === 'HEAD') return new Response(null, { headers: { 'Content-Length': String(bytes.length) } });
    requests += 1;
    const [, from, to] = /bytes=(\d+)-(\d+)/.exec(headers['Range'] ?? '') ?? [];
    const part = ranges && from ? bytes.slice(Number(from), Number(to) + 1) : bytes;
    sent += part.length;
    return new Response(part as BodyInit, { status: ranges && from ? 206 : 200, headers: hidden ? {} : { 'Content-Range': `bytes ${from}-${Number(from) + part.length - 1}/${bytes.length}` } });
  } });
  const bag = await openBag('far.mcap', [await bytesAt('http://far.test/far.mcap', silent)], silent);
  near(bag.length, 60.01);
  assert.ok(bag.isRemote);
  const opened = sent;
  assert.ok(opened < bytes.length / 2, `${opened} of ${bytes.length} bytes for the index`);
  const joints = topicOf(bag, '/joint_states');
  near((read((await bag.latest(joints, 50))[0]!)['position'] as number[])[0]!, shoulderAt(50));
  assert.ok(sent - opened <= 2 * 128 * 1024, `${sent - opened} bytes for one time`);
  const before = requests;
  await bag.latest(joints, 49.99);
  assert.equal(requests, before, 'from the cache');
  hidden = true; // as from another address that does not expose the header
  near((await openBag('far.mcap', [await bytesAt('http://far.test/far.mcap', silent)], silent)).length, 60.01);
  hidden = false;
  ranges = false;
  const texts: string[] = [];
  const whole = await openBag('far.mcap', [await bytesAt('http://far.test/far.mcap', (text) => texts.push(text))], silent);
  near(whole.length, 60.01);
  assert.equal(whole.isRemote, false);
  assert.match(texts.at(-1)!, /^Downloading far\.mcap, because the server has no ranges: \d+\.\d MB\b/);
});

test('the difference of two curves: the largest with its time and sign, the root of the mean square', () => {
  assert.deepEqual(residualOf([0, 1, 2, 3], [0.3, NaN, -0.4, 0]), { largest: -0.4, time: 2, rms: Math.sqrt(0.25 / 3), count: 3 });
  assert.deepEqual(residualOf([0], [NaN]), { largest: NaN, time: NaN, rms: NaN, count: 0 });
});
