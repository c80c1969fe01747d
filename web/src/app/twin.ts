// The state of the twin in the page: description, joints, controllers, time. All other parts subscribe to it.

import { Client, type Handler, type Phase } from '../protocol/client';
import type { Message, Value } from '../protocol/cdr';
import type { Source } from '../protocol/source';
import { STRIDE, Tree } from '../robot/tree';
import { parseUrdf } from '../robot/urdf';
import { Signal, Standing } from './signal';
import { readLoads, readStatus, type Load, type Status } from './status';
import { poseOf, readTransform, RobotFrames, type Transform, TransformStore } from './transforms';

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

const DESCRIPTION = '/robot_description';

// The state of the twin and of one of its robots: the one that the panels, sliders and commands are for.
export class Twin {
  // The namespaces of all robots, '' first: "/left". Empty: a world without robots, or nothing is connected.
  robots: string[] = [];
  space = ''; // of the selected one
  readonly robotsChanged = new Standing<string[]>();
  readonly selectedRobot = new Signal<string>(); // before its description is received
  readonly robotChanged = new Standing<Tree>();
  readonly moved = new Signal();
  readonly sampled = new Signal(); // joint states have been received
  // The poses are those of this stamp, s: of the true pose of a base that is free to move, else of the joint states.
  readonly placed = new Signal<number>();
  readonly phaseChanged = new Standing<Phase>();
  readonly graphChanged = new Standing<void>();
  readonly controllersChanged = new Standing<void>();
  readonly statusChanged = new Standing<Status | null>();
  readonly logged = new Signal<LogLine>();
  readonly log: LogLine[] = []; // the last of them, for later subscribers
  readonly referenceChanged = new Signal<string>();
  readonly rewound = new Signal(); // the log is another one, and curves of the past are none

  readonly client: Client;
  readonly transforms = new TransformStore();
  tree: Tree | null = null;
  description = '';
  opening = ''; // what is read of a recording before it is shown
  q = new Float64Array();
  velocity = new Float64Array();
  effort = new Float64Array();
  target = new Float64Array();
  commandedAt = new Float64Array(); // when the page last set a target, ms
  readonly referenced = new Set<string>(); // joints of which a controller publishes the target
  poses = new Float64Array();
  controllers: Controller[] = [];
  simTime = 0;
  status: Status | null = null; // null: the server does not publish it
  readonly loads = new Map<string, Load>(); // by joint; updated while a part of the page uses it

  // The true pose of a base that is free to move, in the world; null: none is published. On /tf its parent may be the
  // frame of the odometry.
  truth: Float64Array | null = null;

  readonly transformed = new Signal(); // /tf or /tf_static has been received
  frames: RobotFrames; // of the selected robot
  private endFrames = (): void => {};
  private readonly followed = new Set<{ name: string; handler: Handler; end: () => void }>();
  private wanted: string | null = new URLSearchParams(location.search).get('robot'); // null: any
  private fresh = true; // the next description is that of another robot
  private readonly heard = new Map<string, number>(); // joint → ms
  private loadWatchers = 0;
  private endLoads: (() => void) | null = null;
  private readonly stateSubscriptions = new Map<string, () => void>();
  private listing: Promise<void> | null = null;
  private stale = false; // requested again while a response was pending
  private seen = new Float64Array();

  constructor(client: Client) {
    this.client = client;
    this.frames = this.framesOf('');
    client.onphase = (phase) => {
      if (phase !== 'lost') this.truth = null;
      if (phase === 'open') void this.listControllers();
      else this.takeStatus(null);
      this.phaseChanged.emit(phase);
    };
    client.ongraph = () => {
      if (client.phase !== 'lost') this.findRobots(); // a lost twin's picture and names stay
      if (this.recording) this.watchReferences();
      this.graphChanged.emit();
      if (client.phase === 'open' && client.services.size > 0) void this.listControllers();
    };
    client.onstatus = (level, text) =>
      this.tell({ time: this.simTime, level: [20, 30, 40][level] ?? 20, name: 'server', text, place: '' });
    client.subscribe('/tf', (m) => this.takeTransforms(m, false));
    client.subscribe('/tf_static', (m) => this.takeTransforms(m, true));
    client.subscribe('/clock', (m) => this.knowTime(stampOf(m['clock'])));
    client.subscribe('/doppel/status', (m) => this.takeStatus(readStatus(m)));
    client.subscribe('/rosout', (m) => this.takeLog(m));
    this.follow(DESCRIPTION, (m) => this.describe(String(m['data'])));
    this.follow('/joint_states', (m) => this.takeJointState(m));
    this.follow('/ground_truth/odom', (m) => this.takeTruth(m));
    this.follow('/controller_manager/activity', () => void this.listControllers());
  }

  start(): void {
    this.client.start();
  }

  // A further one for recordings, without a connection.
  static forRecording(): Twin {
    return new Twin(new Client({ url: '' }));
  }

  // Reads a recording from now on; nothing of the twin that was read before stays.
  read(source: Source): void {
    this.fresh = true;
    this.description = '';
    this.controllers = [];
    this.simTime = 0;
    this.wanted = new URLSearchParams(location.search).get('robot');
    this.rewind([]);
    this.client.use(source);
    this.controllersChanged.emit();
  }

  // The recording continues at another time: what was received since is forgotten, and the log is that of the time.
  rewind(log: LogLine[]): void {
    this.transforms.forget();
    this.frames.forget();
    this.truth = null;
    this.log.splice(0, this.log.length, ...log.slice(-LOG_MOST));
    this.rewound.emit();
  }

  // The name of the recording that is read instead of a twin; '' for a twin. Nothing in it can be commanded.
  get recording(): string {
    return this.client.metadata['recording'] ?? '';
  }

  // A running world without any robot: its status is published, and no description.
  get withoutRobots(): boolean {
    return this.status !== null && this.robots.length === 0;
  }

  // Why there is no robot in the page; '' with one.
  get missing(): string {
    return this.tree ? '' : this.opening ? this.opening : this.withoutRobots ? 'This world has no robot.'
      : this.recording ? 'This recording has no /robot_description.' : 'Waiting for the description of the robot.';
  }

  // True for a recording, also before one is opened.
  get isReadOnly(): boolean {
    return this.recording !== '' || (this.opening !== '' && this.client.phase === 'connecting');
  }

  // An arm behind a port.
  get isEmulated(): boolean {
    return this.client.metadata['emulated'] !== undefined;
  }

  // The program at the port moves it, and has the stop. The hand of --hand guide is commanded here, by controllers.
  get isDrivenElsewhere(): boolean {
    return this.isEmulated && this.controllers.length === 0;
  }

  // A name of the selected robot: own('/joint_states') is '/left/joint_states'.
  own(name: string): string {
    return this.space + name;
  }

  // A link of the selected robot in the simulator's services, where several robots may have a link of that name.
  linkName(link: number): string {
    const name = this.tree?.links[link] ?? '';
    return this.robots.length < 2 ? name : `${this.space.slice(1) || this.tree!.robot.name}::${name}`;
  }

  // The frames of a robot in the transforms of all robots; its own tree is used where it has one.
  framesOf(space: string): RobotFrames {
    return new RobotFrames(this.client, this.transforms, space);
  }

  // Subscribes to a topic of the selected robot, whichever it is. Returns the function that ends it.
  follow(name: string, handler: Handler): () => void {
    const topic = { name, handler, end: this.client.subscribe(this.own(name), handler) };
    this.followed.add(topic);
    return () => {
      this.followed.delete(topic);
      topic.end();
    };
  }

  private findRobots(): void {
    const { client } = this;
    const inside = client.services.space; // that of the whole twin
    const found = [...client.channels.values()].map((channel) => channel.topic).filter((topic) => topic.endsWith(DESCRIPTION))
      .map((topic) => topic.slice(0, -DESCRIPTION.length)).map((space) => (space === inside ? '' : space)).sort();
    if (found.length === this.robots.length && found.join() === this.robots.join()) return; // [''] is one robot
    this.robots = found;
    const wanted = this.wanted ?? this.space;
    if (found.length > 0 && found.includes(wanted) && wanted !== this.space) this.changeRobot(wanted);
    else if (found.length > 0 && !found.includes(this.space)) this.changeRobot(found[0]!);
    this.robotsChanged.emit(found);
  }

  // The robot that the page commands from now on, and again after a reconnection.
  selectRobot(space: string): void {
    this.wanted = space;
    if (space !== this.space && this.robots.includes(space)) this.changeRobot(space);
  }

  private changeRobot(space: string): void {
    this.space = space;
    this.description = '';
    this.truth = null;
    this.controllers = [];
    this.fresh = true;
    this.followFrames();
    this.watchReferences();
    this.selectedRobot.emit(space);
    this.controllersChanged.emit();
    for (const topic of this.followed) {
      topic.end();
      topic.end = this.client.subscribe(this.own(topic.name), topic.handler);
    }
    void this.listControllers();
  }

  private followFrames(): void {
    this.endFrames();
    this.frames = this.framesOf(this.space);
    this.endFrames = this.frames.listen((transforms, now) => this.useTransforms(transforms, now, (frame) => frame));
  }

  private describe(text: string): void {
    if (text === this.description) return;
    try {
      const tree = new Tree(parseUrdf(text));
      const before = this.fresh ? null : this.tree;
      const old = this.q;
      this.fresh = false;
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
      this.referenced.clear();
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
      const isFollowed = this.recording ? !this.referenced.has(joint.name) : !this.heard.has(joint.name) && this.commandedAt[joint.index] === 0;
      if (isFollowed) this.target[joint.index] = this.q[joint.index]!;
      this.heard.set(joint.name, now);
    }
    this.update();
    this.sampled.emit();
    if (!this.truth) this.placed.emit(stampOf((message['header'] as Message)['stamp']));
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

  // True if there was a visible motion.
  private differs(): boolean {
    let far = this.seen.length !== this.poses.length;
    for (let i = 0; i < this.poses.length && !far; i += 1) far = Math.abs(this.poses[i]! - this.seen[i]!) > 2e-5;
    if (far) this.seen = Float64Array.from(this.poses);
    return far;
  }

  private placeRoot(): void {
    const { tree } = this;
    if (!tree) return;
    const world = this.truth ?? this.frames.toWorld(tree.links[tree.root] ?? '');
    if (world) this.poses.set(world, tree.root * STRIDE);
  }

  private takeTruth(message: Message): void {
    this.truth = poseOf(message);
    this.update();
    this.placed.emit(stampOf((message['header'] as Message)['stamp']));
  }

  private takeTransforms(message: Message, still: boolean): void {
    const now = performance.now();
    const transforms = (message['transforms'] as Message[]).map((raw) => readTransform(raw, still, now));
    for (const transform of transforms) this.transforms.put(transform);
    this.transformed.emit();
    this.useTransforms(transforms, now, (frame) => this.frames.linkOf(frame));
    if (still) this.moved.emit(); // for example the ground's frame does not move any link
  }

  private useTransforms(transforms: Transform[], now: number, linkOf: (frame: string) => string | null): void {
    const { tree } = this;
    if (!tree) return;
    let changed = false;
    for (const transform of transforms) {
      const link = tree.linkIndex.get(linkOf(transform.child) ?? '');
      if (link === undefined) continue;
      if (link === tree.root || this.useTransform(tree, link, transform, now)) changed = true;
    }
    if (changed) this.update();
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
    this.endLoads ??= this.follow('/doppel/joint_loads', (m) => this.takeLoads(m));
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
    const { space } = this;
    const service = this.own('/controller_manager/list_controllers');
    if (!this.client.services.has(service)) return;
    try {
      const answer = await this.client.call(service);
      if (space !== this.space) return; // another robot was selected meanwhile
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
    const wanted = new Set(this.recording ? this.recordedReferences() : this.controllers.filter((c) => /Trajectory/.test(c.type)).map((c) => this.own(`/${c.name}/controller_state`)));
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

  // A recording has no list of controllers, but the type of a topic shows what it is.
  private recordedReferences(): string[] {
    const topics = [...this.client.channels.values()].filter(({ schemaName }) => /JointTrajectoryControllerState$/.test(schemaName)).map(({ topic }) => topic);
    return topics.filter((topic) => topic.startsWith(`${this.space}/`) && this.robots.every((space) => space.length <= this.space.length || !topic.startsWith(`${space}/`)));
  }

  private takeReference(topic: string, m: Message): void {
    const names = m['joint_names'] as string[];
    const positions = (m['reference'] as Message)['positions'] as ArrayLike<number>;
    const now = performance.now();
    for (let i = 0; i < names.length; i += 1) {
      const joint = this.tree?.jointByName.get(names[i]!);
      if (!joint || joint.index < 0 || !Number.isFinite(positions[i])) continue;
      this.referenced.add(joint.name);
      if (now - this.commandedAt[joint.index]! > 1500) this.target[joint.index] = positions[i]!;
    }
    this.referenceChanged.emit(topic);
  }
}
