import assert from 'node:assert/strict';
import { test } from 'node:test';
import type { App } from '../src/app/app';
import { Newest } from '../src/app/newest';
import { Signal } from '../src/app/signal';
import { settings } from '../src/app/settings';
import { ToolDriver } from '../src/app/tool';
import type { Message } from '../src/protocol/cdr';
import { STRIDE, Tree, type TreeJoint } from '../src/robot/tree';
import { parseUrdf } from '../src/robot/urdf';

const rail = (name: string, parent: string, child: string, axis: string): string =>
  `<joint name="${name}" type="prismatic"><parent link="${parent}"/><child link="${child}"/><axis xyz="${axis}"/><limit lower="-1" upper="1" effort="1" velocity="0.6"/></joint>`;
const GANTRY = `<robot name="gantry">${['base', 'a', 'b', 'tool'].map((name) => `<link name="${name}"/>`).join('')}
  ${rail('x', 'base', 'a', '1 0 0')}${rail('y', 'a', 'b', '0 1 0')}${rail('z', 'b', 'tool', '0 0 1')}</robot>`;
const turn = (): Promise<void> => new Promise((done) => setTimeout(done));

// A gantry, whose inverse kinematics is its goal, behind a client that answers when the test lets it.
class Lab {
  readonly calls: { name: string; request: Message; answer: (change?: Message) => Promise<void>; refuse: (why: string) => Promise<void> }[] = [];
  readonly tick = new Signal<number>();
  readonly phaseChanged = new Signal<string>();
  readonly toolChanged = new Signal<number>();
  readonly services = new Map([['/doppel/ik', {}]]);
  readonly client = { phase: 'open', services: this.services, call: (name: string, request: Message) => this.call(name, request) };
  readonly tree = new Tree(parseUrdf(GANTRY));
  readonly target = new Float64Array(3);
  readonly idle = new Set<string>(); // joints without a controller
  readonly driver: ToolDriver;

  constructor() {
    const twin = { client: this.client, tree: this.tree, target: this.target, poses: this.tree.newPoses(), own: (name: string) => name, robotChanged: new Signal(), phaseChanged: this.phaseChanged };
    const world = { tool: this.tree.linkIndex.get('tool')!, size: 1, stage: { tick: this.tick }, toolChanged: this.toolChanged };
    const commander = {
      stopped: false, viewing: false, stopChanged: new Signal(), canMove: (joint: TreeJoint) => !this.idle.has(joint.name),
      setMany: (values: [TreeJoint, number][]) => values.forEach(([joint, value]) => (this.target[joint.index] = value)),
    };
    this.driver = new ToolDriver({ twin, world, commander } as unknown as App);
  }

  private call(name: string, request: Message): Promise<Message> {
    return new Promise((done, failed) => {
      const { x, y, z } = ((request['pose'] as Message)['pose'] as Message)['position'] as unknown as { x: number; y: number; z: number };
      const branch = { positions: [x, y, z], clearance: Infinity, nearest: [], depth: 0, manipulability: 1, limit_distance: 1 };
      const response = { solved: true, reason: '', message: '', joint_names: ['x', 'y', 'z'], branches: [branch] };
      this.calls.push({
        name, request,
        answer: (change = {}) => { done({ ...response, ...change }); return turn(); },
        refuse: (why) => { failed(new Error(why)); return turn(); },
      });
    });
  }

  goal(x: number, y = 0, z = 0): void {
    this.driver.setGoal([x, y, z, 0, 0, 0, 1]);
  }

  asked(): number[] {
    return this.calls.map(({ request }) => (((request['pose'] as Message)['pose'] as Message)['position'] as unknown as { x: number }).x);
  }

  frames(count: number): void {
    for (let i = 0; i < count; i += 1) this.tick.emit(1 / 60);
  }
}

test('Newest: one question is in flight, and of those that wait the last is asked', async () => {
  const done: ((answer: string) => void)[] = [];
  const asked: number[] = [], taken: string[] = [], failed: string[] = [];
  const newest = new Newest<number, string>((question) => new Promise((answer) => { asked.push(question); done.push(answer); }),
    (answer) => taken.push(answer), (problem) => failed.push(problem.message));
  for (let i = 0; i < 5; i += 1) newest.put(i);
  assert.deepEqual(asked, [0]);
  done[0]!('zero');
  await turn();
  assert.deepEqual([asked, taken, newest.busy], [[0, 4], ['zero'], true]);
  newest.clear();
  assert.equal(newest.busy, false);
  newest.put(9);
  assert.deepEqual(asked, [0, 4], 'expected the answer of the dropped question to be waited for');
  done[1]!('dropped');
  await turn();
  done[2]!('nine');
  await turn();
  assert.deepEqual([asked, taken, failed, newest.busy], [[0, 4, 9], ['zero', 'nine'], [], false]);
});

test('ToolDriver: a drag asks with the newest goal, from the commanded positions, and nothing at rest', async () => {
  const lab = new Lab();
  lab.frames(50);
  assert.equal(lab.calls.length, 0);
  lab.target.set([0.01, 0, 0]);
  lab.driver.begin();
  for (const x of [0.1, 0.2, 0.3, 0.4]) {
    lab.goal(x);
    lab.frames(1);
  }
  assert.deepEqual(lab.asked(), [0.1]);
  await lab.calls[0]!.answer();
  assert.deepEqual(lab.asked(), [0.1, 0.4]);
  lab.frames(3);
  await lab.calls[1]!.answer();
  lab.goal(0.4);
  lab.frames(100);
  assert.equal(lab.calls.length, 2, 'expected the same goal to be asked once');
  const { request } = lab.calls[1]!;
  assert.deepEqual([request['tip_link'], request['task'], request['joint_names'], request['every_branch']], ['tool', '', ['x', 'y', 'z'], false]);
  assert.deepEqual(lab.calls[0]!.request['seed'], [0.01, 0, 0]);
  assert.ok(Math.abs(lab.driver.commanded()![0]! - 0.4) < 1e-9);
});

test('ToolDriver: between answers the arm follows the last one at the joints\' velocity', async () => {
  const lab = new Lab();
  lab.driver.begin();
  lab.goal(0.5);
  await lab.calls[0]!.answer();
  const path = [lab.target[0]!];
  for (let i = 0; i < 60; i += 1) {
    lab.frames(1);
    path.push(lab.target[0]!);
  }
  for (let i = 1; i < path.length; i += 1) assert.ok(path[i]! - path[i - 1]! <= 0.6 / 60 + 1e-9 && path[i]! >= path[i - 1]!);
  assert.ok(Math.abs(path[60]! - 0.5) < 1e-9);
});

test('ToolDriver: the nearest pose that works is followed, and no collision', async () => {
  const lab = new Lab();
  const nearest = (x: number, depth: number): Message => ({ positions: [x, 0, 0], clearance: 0, nearest: [], depth, manipulability: 1, limit_distance: 0 });
  const answers: [Message, number][] = [
    [{ solved: false, reason: 'limits', message: 'too far', branches: [nearest(0.1, 0)] }, 0.1],
    [{ solved: false, reason: 'collision', message: 'they touch', branches: [nearest(0.2, 0)] }, 0.1],
    [{ solved: false, reason: 'out_of_reach', message: 'too far', branches: [nearest(0.3, 0.01)] }, 0.1],
    [{ solved: false, reason: 'request', message: 'no such link', branches: [] }, 0.1],
  ];
  lab.driver.begin();
  for (const [i, [change, x]] of answers.entries()) {
    lab.goal(2 + i);
    await lab.calls[i]!.answer(change);
    lab.frames(100);
    assert.ok(Math.abs(lab.target[0]! - x) < 1e-9, `${String(change['reason'])}: ${lab.target[0]}`);
    assert.deepEqual([lab.driver.answer!.obstacle, lab.driver.answer!.message], [change['reason'], change['message']]);
  }
  lab.goal(9);
  await lab.calls[4]!.refuse('no answer within 5 s');
  assert.equal(lab.driver.answer!.message, 'no answer within 5 s');
});

test('ToolDriver: a lost connection and another tool drop the goal; what comes later is not followed', async () => {
  const lab = new Lab();
  for (const lose of [() => lab.phaseChanged.emit('lost'), () => lab.toolChanged.emit(1)]) {
    const first = lab.calls.length;
    lab.driver.begin();
    lab.goal(0.5);
    lose();
    assert.equal(lab.driver.goal, null);
    await lab.calls[first]!.answer();
    lab.frames(20);
    assert.deepEqual([lab.target[0], lab.driver.answer, lab.calls.length], [0, null, first + 1]);
  }
});

test('ToolDriver: a drag that goes on without a connection asks nothing', async () => {
  const lab = new Lab();
  lab.driver.begin();
  lab.goal(0.5);
  await lab.calls[0]!.answer();
  lab.client.phase = 'lost';
  lab.phaseChanged.emit('lost');
  lab.goal(0.6);
  lab.frames(5);
  assert.deepEqual([lab.driver.goal, lab.calls.length], [null, 1]);
});

test('ToolDriver: free orientation is another task; a joint without a controller is named; without the service the reason is', async () => {
  const lab = new Lab();
  settings.keepOrientation = false;
  lab.idle.add('y');
  lab.driver.begin();
  lab.goal(0.1, 0.2);
  settings.keepOrientation = true;
  assert.equal(lab.calls[0]!.request['task'], 'position');
  await lab.calls[0]!.answer();
  lab.frames(60);
  assert.deepEqual([[...lab.target].map((value) => value.toFixed(6)), lab.driver.blockedJoints()], [['0.100000', '0.000000', '0.000000'], ['y']]);
  assert.equal(lab.driver.refusal(), '');
  lab.services.clear();
  assert.match(lab.driver.refusal(), /nothing here offers \/doppel\/ik.*doppel up/);
});

test('ToolDriver: a moving base changes what is asked, not the goal', async () => {
  const lab = new Lab();
  lab.driver.begin();
  lab.goal(0.5);
  await lab.calls[0]!.answer();
  const { poses } = (lab.driver as unknown as { app: App }).app.twin;
  poses[lab.tree.root * STRIDE] = 0.2;
  lab.frames(1);
  assert.equal(lab.driver.goal![0], 0.5);
  assert.ok(Math.abs(lab.asked()[1]! - 0.3) < 1e-12);
});
