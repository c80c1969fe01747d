// The state of the twin in the page: description, joints, controllers, time. All other parts subscribe to it.

import { Client, type Phase } from '../protocol/client';
import type { Message, Value } from '../protocol/cdr';
import { STRIDE, Tree } from '../robot/tree';
import { parseUrdf } from '../robot/urdf';
import { Signal, Standing } from './signal';
import { readLoads, readStatus, type Load, type Status } from './status';
import { poseOf, readTransform, type Transform, TransformStore } from './transforms';

export interface Controller {
  name: string;
  type: string;
  state: string;
  claims: string[];
  joints: string[]; // of the claims, in their order
  interface: string; // "position" if all claims have that interface
}

export interface LogLine {
  time: number;
  level: number; // 10 debug ... 50 fatal
  name: string;
  text: string;
  place: string;
}

const LOG_MOST = 1000;

export function stampOf(value: Value | undefined): number {
  const time = value as { sec?: number; nanosec?: number } | undefined;
  return time ? (time.sec ?? 0) + (time.nanosec ?? 0) * 1e-9 : 0;
}

export class Twin {
  readonly robotChanged = new Standing<Tree>();
  readonly moved = new Signal();
  readonly sampled = new Signal(); // joint states have been received
  readonly phaseChanged = new Standing<Phase>();
  readonly graphChanged = new Standing<void>();
  readonly controllersChanged = new Standing<void>();
  readonly statusChanged = new Standing<Status | null>();
  readonly logged = new Signal<LogLine>();
  readonly log: LogLine[] = []; // the last of them, for later subscribers
  readonly referenceChanged = new Signal<string>();

  readonly client: Client;
  readonly transforms = new TransformStore();
  tree: Tree | null = null;
  description = '';
  q = new Float64Array();
  velocity = new Float64Array();
  effort = new Float64Array();
  target = new Float64Array();
  commandedAt = new Float64Array(); // when the page last set a target, ms
  poses = new Float64Array();
  controllers: Controller[] = [];
  simTime = 0;
  status: Status | null = null; // null: the server does not publish it
  readonly loads = new Map<string, Load>(); // by joint; updated while a part of the page uses it

  // The true pose of a base that is free to move, in the world; null: none is published. On /tf its parent may be the
  // frame of the odometry.
  truth: Float64Array | null = null;

  private readonly heard = new Map<string, number>(); // joint → ms
  private loadWatchers = 0;
  private endLoads: (() => void) | null = null;
  private readonly stateSubscriptions = new Map<string, () => void>();
  private listing: Promise<void> | null = null;
  private stale = false; // requested again while a response was pending
  private seen = new Float64Array();

  constructor(url: string) {
    this.client = new Client({ url });
    const { client } = this;
    client.onphase = (phase) => {
      this.truth = null;
      if (phase === 'open') void this.listControllers();
      else this.takeStatus(null);
      this.phaseChanged.emit(phase);
    };
    client.ongraph = () => {
      this.graphChanged.emit();
      if (client.phase === 'open' && client.services.size > 0) void this.listControllers();
    };
    client.onstatus = (level, text) =>
      this.tell({ time: this.simTime, level: [20, 30, 40][level] ?? 20, name: 'server', text, place: '' });
    client.subscribe('/robot_description', (m) => this.describe(String(m['data'])));
    client.subscribe('/joint_states', (m) => this.takeJointState(m));
    client.subscribe('/tf', (m) => this.takeTransforms(m, false));
    client.subscribe('/tf_static', (m) => this.takeTransforms(m, true));
    client.subscribe('/ground_truth/odom', (m) => this.takeTruth(m));
    client.subscribe('/clock', (m) => this.knowTime(stampOf(m['clock'])));
    client.subscribe('/doppel/status', (m) => this.takeStatus(readStatus(m)));
    client.subscribe('/rosout', (m) => this.takeLog(m));
    client.subscribe('/controller_manager/activity', () => void this.listControllers());
  }

  start(): void {
    this.client.start();
  }

  private describe(text: string): void {
    if (text === this.description) return;
    try {
      const tree = new Tree(parseUrdf(text));
      const before = this.tree;
      const old = this.q;
      this.description = text;
      this.tree = tree;
      this.truth = null;
      this.q = tree.rest();
      for (const joint of tree.moving) {
        const was = before?.jointByName.get(joint.name);
        if (was) this.q[joint.index] = old[was.index]!;
      }
      this.velocity = new Float64Array(tree.size);
      this.effort = new Float64Array(tree.size).fill(NaN);
      this.target = Float64Array.from(this.q);
      this.commandedAt = new Float64Array(tree.size);
      this.poses = tree.newPoses();
      this.heard.clear();
      this.loads.clear();
      tree.follow(this.q);
      this.placeRoot();
      tree.forward(this.q, this.poses);
      this.robotChanged.emit(tree);
    } catch (problem) {
      this.tell({ time: 0, level: 40, name: 'page', text: `the description cannot be drawn: ${(problem as Error).message}`, place: '' });
    }
  }

  private takeJointState(message: Message): void {
    const { tree } = this;
    if (!tree) return;
    const names = message['name'] as string[];
    const position = message['position'] as ArrayLike<number>;
    const velocity = message['velocity'] as ArrayLike<number>;
    const effort = message['effort'] as ArrayLike<number>;
    const now = performance.now();
    for (let i = 0; i < names.length; i += 1) {
      const joint = tree.jointByName.get(names[i]!);
      if (!joint || joint.index < 0) continue;
      if (Number.isFinite(position[i])) this.q[joint.index] = position[i]!;
      this.velocity[joint.index] = velocity[i] ?? NaN;
      if (Number.isFinite(effort[i])) this.effort[joint.index] = effort[i]!;
      if (!this.heard.has(joint.name) && this.commandedAt[joint.index] === 0) this.target[joint.index] = this.q[joint.index]!;
      this.heard.set(joint.name, now);
    }
    this.update();
    this.sampled.emit();
  }

  private update(): void {
    const { tree } = this;
    if (!tree) return;
    tree.follow(this.q);
    tree.follow(this.target);
    this.placeRoot();
    tree.forward(this.q, this.poses);
    if (this.differs()) this.moved.emit();
  }

  // Whether there was a visible motion.
  private differs(): boolean {
    let far = this.seen.length !== this.poses.length;
    for (let i = 0; i < this.poses.length && !far; i += 1) far = Math.abs(this.poses[i]! - this.seen[i]!) > 2e-5;
    if (far) this.seen = Float64Array.from(this.poses);
    return far;
  }

  private placeRoot(): void {
    const { tree } = this;
    if (!tree) return;
    const world = this.truth ?? this.transforms.toWorld(tree.links[tree.root] ?? '');
    if (world) this.poses.set(world, tree.root * STRIDE);
  }

  private takeTruth(message: Message): void {
    this.truth = poseOf(message);
    this.update();
  }

  private takeTransforms(message: Message, still: boolean): void {
    const now = performance.now();
    const { tree } = this;
    let changed = false;
    for (const raw of message['transforms'] as Message[]) {
      const transform = readTransform(raw, still, now);
      this.transforms.put(transform);
      const link = tree?.linkIndex.get(transform.child);
      if (tree && link !== undefined && link !== tree.root && this.useTransform(tree, link, transform, now)) changed = true;
      if (tree && link === tree.root) changed = true;
    }
    if (changed) this.update();
    if (still) this.moved.emit(); // for example the ground's frame does not move any link
  }

  // The position of a joint that is not in /joint_states is computed from its transform.
  private useTransform(tree: Tree, link: number, transform: Transform, now: number): boolean {
    const joint = tree.parentJoint[link];
    if (!joint || joint.index < 0 || joint.mimic || transform.still) return false;
    if (now - (this.heard.get(joint.name) ?? -1e9) < 500) return false;
    this.q[joint.index] = this.transforms.jointPosition(joint, transform);
    return true;
  }

  get paused(): boolean {
    return this.status?.paused ?? false;
  }

  private takeStatus(status: Status | null): void {
    this.status = status;
    if (status) this.simTime = status.simTime;
    this.statusChanged.emit(status);
  }

  knowTime(time: number): void {
    this.simTime = time;
  }

  // Subscribes to efforts and gravity loads of the joints. Returns the function that ends it.
  watchLoads(): () => void {
    this.loadWatchers += 1;
    this.endLoads ??= this.client.subscribe('/doppel/joint_loads', (m) => this.takeLoads(m));
    let ended = false;
    return () => {
      if (ended) return;
      ended = true;
      this.loadWatchers -= 1;
      if (this.loadWatchers > 0) return;
      this.endLoads?.();
      this.endLoads = null;
    };
  }

  private takeLoads(m: Message): void {
    for (const load of readLoads(m)) {
      this.loads.set(load.joint, load);
      const index = this.tree?.jointByName.get(load.joint)?.index ?? -1;
      if (index >= 0) this.effort[index] = load.effort;
    }
  }

  private tell(line: LogLine): void {
    this.log.push(line);
    if (this.log.length > LOG_MOST) this.log.shift();
    this.logged.emit(line);
  }

  private takeLog(m: Message): void {
    const file = String(m['file'] ?? '');
    this.tell({
      time: stampOf(m['stamp']),
      level: Number(m['level']),
      name: String(m['name']),
      text: String(m['msg']),
      place: file ? `${file}:${String(m['line'])}` : '',
    });
  }

  listControllers(): Promise<void> {
    this.stale = true;
    this.listing ??= (async () => {
      while (this.stale) {
        this.stale = false;
        await this.askControllers();
      }
      this.listing = null;
    })();
    return this.listing;
  }

  private async askControllers(): Promise<void> {
    if (!this.client.services.has('/controller_manager/list_controllers')) return;
    try {
      const answer = await this.client.call('/controller_manager/list_controllers');
      this.controllers = (answer['controller'] as Message[]).map((raw) => {
        const claims = raw['claimed_interfaces'] as string[];
        const needed = claims.length > 0 ? claims : (raw['required_command_interfaces'] as string[]);
        const kinds = new Set(needed.map((claim) => claim.slice(claim.lastIndexOf('/') + 1)));
        return {
          name: String(raw['name']),
          type: String(raw['type']),
          state: String(raw['state']),
          claims,
          joints: [...new Set(needed.map((claim) => claim.slice(0, claim.lastIndexOf('/'))))],
          interface: kinds.size === 1 ? [...kinds][0]! : '',
        };
      });
      this.watchReferences();
      this.controllersChanged.emit();
    } catch {
      // the connection is lost; the next one requests it again
    }
  }

  private watchReferences(): void {
    const wanted = new Set(this.controllers.filter((c) => /Trajectory/.test(c.type)).map((c) => `/${c.name}/controller_state`));
    for (const [topic, end] of this.stateSubscriptions) {
      if (!wanted.has(topic)) {
        end();
        this.stateSubscriptions.delete(topic);
      }
    }
    for (const topic of wanted) {
      if (this.stateSubscriptions.has(topic)) continue;
      this.stateSubscriptions.set(topic, this.client.subscribe(topic, (m) => this.takeReference(topic, m)));
    }
  }

  private takeReference(topic: string, m: Message): void {
    const names = m['joint_names'] as string[];
    const positions = (m['reference'] as Message)['positions'] as ArrayLike<number>;
    const now = performance.now();
    for (let i = 0; i < names.length; i += 1) {
      const joint = this.tree?.jointByName.get(names[i]!);
      if (!joint || joint.index < 0 || !Number.isFinite(positions[i])) continue;
      if (now - this.commandedAt[joint.index]! > 1500) this.target[joint.index] = positions[i]!;
    }
    this.referenceChanged.emit(topic);
  }
}
