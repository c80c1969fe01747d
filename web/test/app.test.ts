import assert from 'node:assert/strict';
import { test } from 'node:test';
import { parsePose, trajectoryYaml } from '../src/app/pose_yaml';
import { duration } from '../src/app/commander';
import { readFindings } from '../src/app/health';
import { readLinkedPose } from '../src/app/linked_pose';
import { CAPACITY, numberAt, Recorder } from '../src/app/recorder';
import { Signal } from '../src/app/signal';
import { TransformStore } from '../src/app/transforms';
import { fixed } from '../src/app/units';
import type { Twin } from '../src/app/twin';
import { eigen3 } from '../src/scene/eigen';
import { parseUrdf } from '../src/robot/urdf';
import { STRIDE, Tree } from '../src/robot/tree';

test('a pose is copied and pasted; other spellings are read, nonsense is not', () => {
  const text = trajectoryYaml(['Revolute 1', 'a "b", c'], [{ time: 2, positions: [1.5, -0.25] }], '/arm/joint_trajectory');
  assert.equal(text, '# /arm/joint_trajectory\njoint_names: ["Revolute 1", "a \\"b\\", c"]\npoints:\n- positions: [1.5, -0.25]\n  time_from_start: {sec: 2, nanosec: 0}\n');
  assert.deepEqual([...parsePose(text)!], [['Revolute 1', 1.5], ['a "b", c', -0.25]]);
  assert.deepEqual([...parsePose("joint_names:\n- a\n- 'b c'\npoints:\n- positions:\n  - 1\n  - 2e-1\n  time_from_start: {sec: 1}\n")!], [['a', 1], ['b c', 0.2]]);
  assert.deepEqual([...parsePose('{joint_names: [a], points: [{positions: [1]}, {positions: [2]}]}')!], [['a', 2]]);
  assert.equal(parsePose('joint_names: [a, b]\npositions: [1]'), null);
  assert.equal(parsePose('joint_names: [a]\npositions: [x]'), null);
  assert.equal(parsePose('hello'), null);
  assert.deepEqual([...parsePose(`${trajectoryYaml(['a'], [{ time: 0.25, positions: [1] }], '/x')}---\n${trajectoryYaml(['b'], [{ time: 1, positions: [2] }])}`)!], [['a', 1], ['b', 2]]);
  assert.match(trajectoryYaml(['a'], [{ time: 2.9999999999, positions: [0] }]), /sec: 3, nanosec: 0/);
});

test('the configuration of an address is read; what is no number is left out', () => {
  assert.deepEqual([...readLinkedPose('?robot=a&q=Revolute%202%3D1.2&q=a=b=-3e-1&q=x=&q=y=1rad&q==2&q=z')], [['Revolute 2', 1.2], ['a=b', -0.3]]);
  assert.equal(readLinkedPose('').size, 0);
});

test('findings are read worst first, and no JSON is no findings', () => {
  const read = readFindings('{"findings":[{"rule":"a","severity":"note"},{"rule":"b","severity":"error","line":7}],"mass":1.5}')!;
  assert.deepEqual(read.findings.map((f) => f.rule), ['b', 'a']);
  assert.equal(read.findings[0]!.line, 7);
  assert.equal(readFindings('{'), null);
});

test('the recorder keeps the last samples, windows them, and starts again when time goes back', () => {
  const twin = { sampled: new Signal(), robotChanged: new Signal(), simTime: 0, client: { channel: () => ({}) }, paused: false, tree: null, q: [] } as unknown as Twin & { simTime: number };
  const recorder = new Recorder(twin, { reference: () => NaN, tolerance: () => NaN });
  let value = 0;
  const wall = { now: 0 };
  const real = performance.now;
  const clock = (now: () => number): unknown => Object.defineProperty(performance, 'now', { value: now, configurable: true, writable: true });
  clock(() => wall.now);
  try {
    recorder['add']('k', 'a, "b"', 'm', () => value, () => {});
    for (let i = 1; i <= CAPACITY + 500; i += 1) {
      wall.now = i * 20;
      twin.simTime = i * 0.02;
      value = i;
      twin.sampled.emit();
    }
    assert.equal(recorder.count, CAPACITY);
    assert.ok(Math.abs(recorder.oldest - 501 * 0.02) < 1e-9);
    const [times, values] = recorder.window(100, 101, ['k']) as [Float64Array, Float64Array];
    assert.ok(times.length >= 50 && times.length <= 53 && values[1] === Math.round(times[1]! / 0.02));
    assert.ok(recorder.window(-1, 1e9, ['k'], 100)[0]!.length <= 100);
    assert.match(recorder.csv(['k']).split('\n')[0]!, /^time \[s\],"a, ""b"" \[m\]"$/);
    wall.now += 20;
    twin.simTime = 0.5;
    twin.sampled.emit();
    assert.equal(recorder.count, 1);
  } finally {
    clock(real);
  }
  assert.equal(numberAt({ a: [{ b: 2 }] }, ['a', 0, 'b']), 2);
  assert.ok(Number.isNaN(numberAt({ a: 'x' }, ['a', 'b', 'c'])));
});

test('joint positions are read off transforms, over the whole turn and along a slide', () => {
  const tree = new Tree(parseUrdf(`<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
    <joint name="t" type="continuous"><parent link="a"/><child link="b"/><origin xyz="1 2 3" rpy="0.3 0.4 0.5"/><axis xyz="0 0.6 0.8"/></joint>
    <joint name="s" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="1 0 0" rpy="0 1 0"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>`));
  const store = new TransformStore();
  for (const [angle, slide] of [[0.1, 0.2], [-3.1, -0.5], [2.5, 1], [0, 0]] as const) {
    const poses = tree.newPoses();
    tree.forward([angle, slide], poses);
    const turn = tree.moving[0]!;
    const made = (pose: Float64Array) => ({ parent: '', child: '', still: false, pose, at: 0, stamp: 0, rate: 0 });
    assert.ok(Math.abs(store.jointPosition(turn, made(poses.slice(STRIDE, 2 * STRIDE))) - angle) < 1e-9);
    const flat = tree.newPoses();
    tree.forward([0, slide], flat);
    store.put({ ...made(flat), child: 'x', parent: 'w' });
    const only = new Tree(parseUrdf(`<robot name="r"><link name="b"/><link name="c"/><joint name="s" type="prismatic"><parent link="b"/><child link="c"/><origin xyz="1 0 0" rpy="0 1 0"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>`));
    const own = only.newPoses();
    only.forward([slide], own);
    assert.ok(Math.abs(store.jointPosition(only.moving[0]!, made(own.slice(STRIDE, 2 * STRIDE))) - slide) < 1e-9);
  }
});

test('the rate of a frame is that of its arrivals, also after a burst; plain kinematics at ten a second', () => {
  const store = new TransformStore();
  const put = (at: number): void => store.put({ parent: 'w', child: 'c', still: false, pose: Float64Array.of(0, 0, 0, 0, 0, 0, 1), at, stamp: 0, rate: 0 });
  for (const at of [0, 1, 2]) put(at);
  for (let i = 1; i <= 40; i += 1) put(2 + i * 100);
  assert.ok(Math.abs(store.frames.get('c')!.rate - 10) < 1.5, String(store.frames.get('c')!.rate));
});

test('numbers of zero have no minus, what is no number is a dash', () => {
  assert.deepEqual([fixed(-0.0001, 2), fixed(-0.4, 0), fixed(-1.5, 1), fixed(NaN, 2)], ['0.00', '0', '-1.5', '–']);
});

test('a duration carries its nanoseconds over', () => {
  assert.deepEqual(duration(2.9999999999), { sec: 3, nanosec: 0 });
  assert.deepEqual(duration(0.25), { sec: 0, nanosec: 250_000_000 });
});

test('principal axes of inertia', () => {
  const { values, vectors } = eigen3([[2, 1, 0], [1, 2, 0], [0, 0, 5]]);
  assert.deepEqual(values.map((v) => Math.round(v * 1e9) / 1e9).sort(), [1, 3, 5]);
  for (let k = 0; k < 3; k += 1) assert.ok(Math.abs(Math.hypot(vectors[0]![k]!, vectors[1]![k]!, vectors[2]![k]!) - 1) < 1e-12);
});
