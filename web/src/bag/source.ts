// A recording as a source of the client: it sends the messages of the subscribed topics, those of a stretch of time
// or the newest ones at a time.
import type { Channel } from '@foxglove/ws-protocol';
import { Newest } from '../app/newest';
import { Signal } from '../app/signal';
import type { Source } from '../protocol/source';
import type { Bag, BagMessage, Topic } from './bag';

type Listener = (event: unknown) => void;

// Of these types each message holds a part of the whole, so that the newest one alone is not the state.
const PARTS: [type: RegExp, how: { most: number; since?: number; pieces?: number }][] = [
  [/(^|\/)TFMessage$/, { most: 400, since: 1 }],
  [/(^|\/)JointState$/, { most: 100, since: 1 }],
  [/(^|\/)DiagnosticArray$/, { most: 100, since: 2 }],
  [/(^|\/)MarkerArray$/, { most: 1000, pieces: 64 }],
];
const ATTEMPTS = 5; // to read the state of a topic at the present time while time goes on
const LOG_PIECES = 24; // that are read for the log of a time
const LOGS = /(^|\/)Log$/;
const LOG = { most: 1000, pieces: LOG_PIECES };
const STATIC_TRANSFORMS = { most: 1000 };
// Of these only the last message of a frame is drawn.
const LARGE = /(^|\/)(Image|CompressedImage|PointCloud2|LaserScan|OccupancyGrid)$/;

export class BagSource implements Source {
  time = 0; // s since the start of the recording: messages until then have been sent
  isReading = false; // a part of the file, for the time that is asked for
  readonly moved = new Signal();
  // Called before the state of another time is sent. `setsLog`: what `ownsLog` gave; the log's messages are not sent
  // then.
  onjump: (time: number, setsLog: boolean) => void = () => {};
  ownsLog: (time: number) => boolean = () => false;
  sent: (message: BagMessage) => void = () => {}; // each message that was sent
  private readonly listeners = new Map<string, Set<Listener>>();
  private readonly subscribed = new Map<number, Topic>(); // by id
  private readonly offered: Topic[];
  private next = 1;
  private late = new Set<number>(); // subscriptions without the state of their topic
  private readonly jumps = new Newest<number, void>(
    (time) => this.jump(time),
    () => this.continueLate(),
    (problem) => {
      this.bag.onproblem(problem.message);
      this.continueLate();
    },
  );

  constructor(
    readonly bag: Bag,
    offers: (topic: Topic) => boolean = () => true,
  ) {
    this.offered = bag.topics.filter(offers);
  }

  // Identifies itself and offers its topics; after that the client subscribes.
  start(): void {
    this.emit('serverInfo', {
      op: 'serverInfo',
      name: this.bag.name,
      capabilities: ['assets'],
      metadata: { recording: this.bag.name },
      sessionId: this.bag.name,
    });
    const channels: Channel[] = this.offered.map(({ id, name, type, schema, encoding }) => ({
      id,
      topic: name,
      encoding,
      schemaName: type,
      schema,
      schemaEncoding: 'ros2msg',
    }));
    this.emit('advertise', channels);
  }

  readonly on = ((name: string, listener: Listener) => {
    this.listeners.set(name, (this.listeners.get(name) ?? new Set()).add(listener));
  }) as Source['on'];

  private emit(name: string, event: unknown): void {
    for (const listener of this.listeners.get(name) ?? []) listener(event);
  }

  close(): void {
    this.listeners.clear();
    this.subscribed.clear();
  }

  subscribe(channel: number): number {
    const id = this.next++;
    const topic = this.offered.find((one) => one.id === channel);
    if (!topic) return id;
    this.subscribed.set(id, topic);
    this.late.add(id);
    if (this.late.size === 1) queueMicrotask(() => void this.catchUp());
    return id;
  }

  unsubscribe(id: number): void {
    this.subscribed.delete(id);
    this.late.delete(id);
  }

  // The topics that are read.
  get topics(): Set<Topic> {
    return new Set(this.subscribed.values());
  }

  // -- time

  // Shows another time. Of several requests only the newest counts.
  goTo(time: number): void {
    this.jumps.put(Math.min(this.bag.length, Math.max(0, time)));
  }

  // The state at the start, before the first message of a stretch.
  async begin(): Promise<void> {
    this.late.clear();
    await this.jump(0);
    this.continueLate();
  }

  get isJumping(): boolean {
    return this.jumps.busy;
  }

  // Sends what was logged until that time.
  async advance(to: number): Promise<void> {
    const from = this.time;
    const messages = await this.whileReading(this.bag.range(this.topics, from, to));
    if (this.time !== from) return; // another time was asked for meanwhile
    this.send(messages);
    this.time = to;
    this.moved.emit();
  }

  private async jump(time: number): Promise<void> {
    const ids = new Set(this.subscribed.keys());
    const setsLog = this.ownsLog(time);
    const messages = await this.whileReading(this.stateAt(ids, time, setsLog));
    this.time = time;
    this.onjump(time, setsLog);
    this.send(messages, false);
    for (const id of ids) this.late.delete(id);
    this.moved.emit();
  }

  // Topics that were subscribed during a jump.
  private continueLate(): void {
    queueMicrotask(() => void this.catchUp());
  }

  private async whileReading<T>(reading: Promise<T>): Promise<T> {
    this.isReading = true;
    try {
      return await reading;
    } finally {
      this.isReading = false;
    }
  }

  // Sends the state of topics that were subscribed since the last jump, which sends it otherwise.
  private async catchUp(): Promise<void> {
    for (let attempt = 1; this.late.size > 0 && !this.isJumping; attempt += 1) {
      const ids = new Set(this.late);
      const { time } = this;
      const messages = await this.stateAt(ids, time, false);
      if (this.isJumping) return;
      if (this.time !== time && attempt < ATTEMPTS) continue; // it went on meanwhile; now the pieces are loaded
      for (const id of ids) this.late.delete(id);
      this.send(messages, false, ids);
    }
  }

  // The messages that make up the state of the topics at that time, descriptions and fixed transforms first.
  private async stateAt(ids: ReadonlySet<number>, time: number, withoutLog: boolean): Promise<BagMessage[]> {
    const topics = new Set([...ids].flatMap((id) => this.subscribed.get(id) ?? []));
    const lists = await Promise.all(
      [...topics].filter((topic) => !(withoutLog && LOGS.test(topic.type))).map((topic) => this.stateOf(topic, time)),
    );
    const all = lists.flat().sort((a, b) => a.time - b.time);
    return [...all.filter(({ topic }) => topic.isLatched), ...all.filter(({ topic }) => !topic.isLatched)];
  }

  private stateOf(topic: Topic, time: number): Promise<BagMessage[]> {
    if (LOGS.test(topic.type)) return this.bag.latest(topic, time, LOG);
    if (topic.isLatched && /(^|\/)TFMessage$/.test(topic.type)) return this.bag.latest(topic, time, STATIC_TRANSFORMS);
    const how = PARTS.find(([type]) => type.test(topic.type))?.[1];
    return this.bag.latest(
      topic,
      time,
      how && { ...how, since: how.since === undefined ? undefined : time - how.since },
    );
  }

  private send(messages: BagMessage[], isStretch = true, ids: Iterable<number> = this.subscribed.keys()): void {
    const byTopic = new Map<Topic, number[]>();
    for (const id of ids) {
      const topic = this.subscribed.get(id);
      if (topic && !(isStretch && this.late.has(id))) byTopic.set(topic, [...(byTopic.get(topic) ?? []), id]);
    }
    const last = new Map(messages.map((message) => [message.topic, message]));
    for (const message of messages) {
      const { topic, data, stamp } = message;
      if (isStretch && LARGE.test(topic.type) && last.get(topic) !== message) continue;
      if (isStretch) this.time = message.time;
      for (const subscriptionId of byTopic.get(topic) ?? [])
        this.emit('message', {
          op: 1,
          subscriptionId,
          timestamp: stamp,
          data: new DataView(data.buffer, data.byteOffset, data.byteLength),
        });
      this.sent(message);
    }
  }

  // -- files

  fetchAsset(uri: string, requestId: number): void {
    this.bag.attachment(uri).then(
      (found) =>
        this.emit(
          'fetchAssetResponse',
          found
            ? { op: 4, requestId, status: 0, data: new DataView(found.buffer, found.byteOffset, found.byteLength) }
            : { op: 4, requestId, status: 1, error: 'the recording has no attachment of this name' },
        ),
      (problem: Error) => this.emit('fetchAssetResponse', { op: 4, requestId, status: 1, error: problem.message }),
    );
  }

  // -- a recording takes no commands

  advertise(): number {
    return this.next++;
  }
  sendMessage(): void {}
  sendServiceCallRequest(): void {}
  getParameters(_: string[], id?: string): void {
    this.emit('parameterValues', { op: 'parameterValues', id, parameters: [] });
  }
  setParameters(_: unknown, id?: string): void {
    this.getParameters([], id);
  }
  subscribeParameterUpdates(): void {}
  unsubscribeParameterUpdates(): void {}
}
