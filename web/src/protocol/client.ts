// A twin seen over the Foxglove WebSocket protocol: topics, services, assets. Connects by itself, again and again;
// subscriptions and advertisements survive a restart of the twin.

import { readCdr, writeCdr, type Message } from './cdr';
import { callFrame, FrameError, messageFrame, readServerBinary, readServerText, SUBPROTOCOL } from './frames';
import type { ChannelOffer, Parameter, ServerText, ServiceOffer } from './frames';
import { parseSchema, shortName, type MessageType } from './schema';
import { BUILTIN } from './builtin';

export type Phase = 'connecting' | 'open' | 'lost';
export type Handler = (message: Message, stamp: bigint) => void;

interface Subscription {
  id: number;
  topic: string;
  channel: number | null;
  type: MessageType | null;
  handlers: Set<Handler>;
  last: { message: Message; stamp: bigint } | null;
}

interface Pending {
  service: ServiceOffer;
  done: (value: Message) => void;
  failed: (reason: Error) => void;
  timer: ReturnType<typeof setTimeout>;
}

export interface SocketLike {
  binaryType: string;
  readyState: number;
  bufferedAmount: number;
  onopen: (() => void) | null;
  onclose: ((event: { code: number; reason: string }) => void) | null;
  onmessage: ((event: { data: unknown }) => void) | null;
  onerror: (() => void) | null;
  send(data: string | Uint8Array): void;
  close(): void;
}

export interface ClientOptions {
  url: string;
  connect?: (url: string, protocol: string) => SocketLike;
}

// By name; what the page calls '/gazebo/step' is '/left/gazebo/step' where the twin stands in the namespace '/left'.
class Offers extends Map<string, ServiceOffer> {
  space = '';
  override get(name: string): ServiceOffer | undefined {
    return super.get(name) ?? (this.space ? super.get(this.space + name) : undefined);
  }
  override has(name: string): boolean {
    return this.get(name) !== undefined;
  }
}

export class Client {
  phase: Phase = 'connecting';
  serverName = '';
  sessionId = '';
  capabilities = new Set<string>();
  reason = '';
  readonly channels = new Map<number, ChannelOffer>();
  readonly services = new Offers();
  readonly received = new Map<string, { count: number; bytes: number; at: number }>();
  onphase: (phase: Phase) => void = () => {};
  ongraph: () => void = () => {};
  onstatus: (level: number, message: string) => void = () => {};
  onparameters: (values: Parameter[]) => void = () => {};
  bytes = 0;

  private socket: SocketLike | null = null;
  private nextId = 1;
  private wait = 250;
  private closed = false;
  private readonly subscriptions = new Map<string, Subscription>();
  private readonly byId = new Map<number, Subscription>();
  private readonly advertised = new Map<string, { id: number; topic: string; type: string }>();
  private readonly calls = new Map<number, Pending>();
  private readonly assets = new Map<number, { done: (data: Uint8Array) => void; failed: (e: Error) => void }>();
  private readonly types = new Map<string, MessageType>();
  private readonly asked = new Map<string, { done: (values: Parameter[]) => void; failed: (e: Error) => void; about: string; errors: string[] }>();
  private watching = false;

  constructor(private readonly options: ClientOptions) {
    for (const [name, text] of Object.entries(BUILTIN)) this.learn(name, text);
  }

  start(): void {
    this.closed = false;
    const connect = this.options.connect ?? ((url, protocol) => new WebSocket(url, protocol) as unknown as SocketLike);
    const socket = connect(this.options.url, SUBPROTOCOL);
    this.socket = socket;
    socket.binaryType = 'arraybuffer';
    socket.onmessage = ({ data }) => this.receive(data);
    socket.onerror = () => {};
    socket.onopen = () => {
      this.wait = 250;
    };
    socket.onclose = ({ reason }) => {
      if (this.socket === socket) this.lose(reason);
    };
  }

  stop(): void {
    this.closed = true;
    this.socket?.close();
  }

  private lose(reason: string): void {
    this.socket = null;
    this.reason = reason;
    for (const [id, call] of this.calls) {
      clearTimeout(call.timer);
      call.failed(new Error('the connection was lost'));
      this.calls.delete(id);
    }
    for (const asset of this.assets.values()) asset.failed(new Error('the connection was lost'));
    this.assets.clear();
    for (const request of this.asked.values()) request.failed(new Error('the connection was lost'));
    this.asked.clear();
    this.channels.clear();
    this.services.clear();
    for (const subscription of this.subscriptions.values()) {
      subscription.channel = null;
    }
    this.setPhase('lost');
    this.ongraph();
    if (this.closed) return;
    setTimeout(() => this.start(), this.wait);
    this.wait = Math.min(2000, this.wait * 1.5);
  }

  private setPhase(phase: Phase): void {
    this.phase = phase;
    this.onphase(phase);
  }

  private receive(data: unknown): void {
    try {
      if (typeof data === 'string') this.receiveText(readServerText(data));
      else this.receiveBinary(data as ArrayBuffer);
    } catch (problem) {
      if (!(problem instanceof FrameError)) throw problem;
      this.onstatus(2, `a frame that cannot be read: ${problem.message}`);
    }
  }

  private receiveText(frame: ServerText): void {
    switch (frame.op) {
      case 'serverInfo':
        this.serverName = frame.name;
        this.sessionId = frame.sessionId ?? '';
        this.capabilities = new Set(frame.capabilities);
        for (const subscription of this.subscriptions.values()) subscription.last = null;
        if (this.advertised.size > 0) this.advertiseNow([...this.advertised.values()]);
        if (this.watching) this.send({ op: 'subscribeParameterUpdates', parameterNames: [] });
        this.setPhase('open');
        break;
      case 'parameterValues': {
        const request = this.asked.get(frame.id ?? '');
        this.asked.delete(frame.id ?? '');
        if (request && request.errors.length > 0) request.failed(new Error(request.errors.join('; ')));
        else request?.done(frame.parameters);
        this.onparameters(frame.parameters);
        break;
      }
      case 'status':
        // What a node has against a value comes as a status that begins with the parameter's name.
        for (const { about, errors } of this.asked.values()) if (about && frame.message.startsWith(`${about}: `)) errors.push(frame.message.slice(about.length + 2));
        this.onstatus(frame.level, frame.message);
        break;
      case 'advertise':
        for (const channel of frame.channels) this.addChannel(channel);
        this.ongraph();
        break;
      case 'unadvertise':
        for (const id of frame.channelIds) this.removeChannel(id);
        this.ongraph();
        break;
      case 'advertiseServices':
        for (const service of frame.services) this.services.set(service.name, service);
        this.ongraph();
        break;
      case 'unadvertiseServices':
        for (const [name, service] of this.services) {
          if (frame.serviceIds.includes(service.id)) this.services.delete(name);
        }
        this.ongraph();
        break;
      case 'serviceCallFailure':
        this.settle(frame.callId, (call) => call.failed(new Error(frame.message)));
        break;
      default:
    }
  }

  private receiveBinary(data: ArrayBuffer): void {
    const frame = readServerBinary(data);
    this.bytes += data.byteLength;
    if (frame.kind === 'message') {
      const subscription = this.byId.get(frame.subscription);
      if (!subscription || !subscription.type) return;
      const counted = this.received.get(subscription.topic) ?? { count: 0, bytes: 0, at: 0 };
      counted.count += 1;
      counted.bytes += frame.payload.byteLength;
      counted.at = performance.now();
      this.received.set(subscription.topic, counted);
      const message = readCdr(subscription.type, frame.payload);
      subscription.last = { message, stamp: frame.stamp };
      for (const handler of subscription.handlers) handler(message, frame.stamp);
    } else if (frame.kind === 'response') {
      this.settle(frame.call, (call) => {
        const type = this.typeOf(call.service.responseName || `${call.service.type}_Response`, call.service.responseSchema);
        call.done(readCdr(type, frame.payload));
      });
    } else if (frame.kind === 'asset') {
      const waiting = this.assets.get(frame.request);
      this.assets.delete(frame.request);
      if (frame.error !== null) waiting?.failed(new Error(frame.error));
      else waiting?.done(frame.data);
    }
  }

  private settle(id: number, use: (call: Pending) => void): void {
    const call = this.calls.get(id);
    if (!call) return;
    this.calls.delete(id);
    clearTimeout(call.timer);
    try {
      use(call);
    } catch (problem) {
      call.failed(problem as Error);
    }
  }

  // -- types

  private learn(name: string, text: string): MessageType {
    const parsed = parseSchema(name, text);
    for (const [short, type] of parsed) if (!this.types.has(short)) this.types.set(short, type);
    return parsed.get(shortName(name))!;
  }

  private typeOf(name: string, text: string): MessageType {
    return this.types.get(shortName(name)) ?? this.learn(name, text);
  }

  type(name: string): MessageType | null {
    return this.types.get(shortName(name)) ?? null;
  }

  // -- topics

  private addChannel(channel: ChannelOffer): void {
    this.channels.set(channel.id, channel);
    // What the program tells of itself says in which namespace it stands.
    const own = /^(.*)\/doppel\/(health|status)$/.exec(channel.topic);
    if (own && own[1] !== this.services.space) {
      this.services.space = own[1]!;
      for (const other of [...this.channels.values()]) if (other.id !== channel.id) this.bind(other);
    }
    try {
      this.types.delete(shortName(channel.schemaName));
      this.learn(channel.schemaName, channel.schema);
    } catch (problem) {
      this.onstatus(1, `${channel.topic}: ${(problem as Error).message}`);
      return;
    }
    this.bind(channel);
  }

  // To the subscriptions that waited for it.
  private bind(channel: ChannelOffer): void {
    for (const subscription of this.subscriptions.values()) {
      if (subscription.channel === null && this.means(subscription.topic, channel)) this.subscribeNow(subscription, channel);
    }
  }

  private means(topic: string, channel: ChannelOffer): boolean {
    return channel.topic === topic || (this.services.space !== '' && channel.topic === this.services.space + topic);
  }

  private removeChannel(id: number): void {
    this.channels.delete(id);
    for (const subscription of this.subscriptions.values()) if (subscription.channel === id) subscription.channel = null;
  }

  private subscribeNow(subscription: Subscription, channel: ChannelOffer): void {
    if (channel.encoding !== 'cdr') return;
    subscription.channel = channel.id;
    subscription.type = this.type(channel.schemaName);
    this.byId.delete(subscription.id);
    subscription.id = this.nextId++;
    this.byId.set(subscription.id, subscription);
    this.send({ op: 'subscribe', subscriptions: [{ id: subscription.id, channelId: channel.id }] });
  }

  channel(topic: string): ChannelOffer | null {
    let found: ChannelOffer | null = null;
    for (const channel of this.channels.values()) {
      if (channel.topic === topic) return channel;
      if (this.means(topic, channel)) found = channel;
    }
    return found;
  }

  // Returns what ends the subscription. A topic may come later, or again after a restart.
  subscribe(topic: string, handler: Handler): () => void {
    let subscription = this.subscriptions.get(topic);
    if (!subscription) {
      subscription = { id: this.nextId++, topic, channel: null, type: null, handlers: new Set(), last: null };
      this.subscriptions.set(topic, subscription);
      const channel = this.channel(topic);
      if (channel) this.subscribeNow(subscription, channel);
    } else if (subscription.last) {
      const { message, stamp } = subscription.last;
      queueMicrotask(() => handler(message, stamp));
    }
    const mine = subscription;
    mine.handlers.add(handler);
    return () => {
      mine.handlers.delete(handler);
      if (mine.handlers.size > 0 || this.subscriptions.get(topic) !== mine) return;
      this.subscriptions.delete(topic);
      this.byId.delete(mine.id);
      if (mine.channel !== null) this.send({ op: 'unsubscribe', subscriptionIds: [mine.id] });
    };
  }

  private advertiseNow(list: { id: number; topic: string; type: string }[]): void {
    this.send({
      op: 'advertise',
      channels: list.map(({ id, topic, type }) => ({ id, topic, encoding: 'cdr', schemaName: type })),
    });
  }

  publish(name: string, typeName: string, message: Message): void {
    const topic = this.channel(name)?.topic ?? name;
    const type = this.type(typeName);
    if (!type) throw new Error(`the type ${typeName} is not known here`);
    const payload = writeCdr(type, message);
    if (this.phase !== 'open') return;
    let mine = this.advertised.get(topic);
    if (!mine || mine.type !== typeName) {
      mine = { id: this.nextId++, topic, type: typeName };
      this.advertised.set(topic, mine);
      this.advertiseNow([mine]);
    }
    this.socket?.send(messageFrame(mine.id, payload));
  }

  // Bytes that the browser has not sent yet.
  get backlog(): number {
    return this.socket?.bufferedAmount ?? 0;
  }

  // -- services and assets

  requestType(name: string): MessageType | null {
    const service = this.services.get(name);
    return service ? this.typeOf(service.requestName || `${service.type}_Request`, service.requestSchema) : null;
  }

  call(name: string, request: Message = {}, patience = 5000): Promise<Message> {
    const service = this.services.get(name);
    const type = this.requestType(name);
    if (!service || !type) return Promise.reject(new Error(`there is no service ${name}`));
    const payload = writeCdr(type, request);
    return new Promise((done, failed) => {
      const id = this.nextId++;
      const timer = setTimeout(() => {
        this.calls.delete(id);
        failed(new Error(`${name} did not answer within ${patience / 1000} s`));
      }, patience);
      this.calls.set(id, { service, done, failed, timer });
      this.socket?.send(callFrame(service.id, id, payload));
    });
  }

  fetchAsset(uri: string): Promise<Uint8Array> {
    if (this.phase !== 'open') return Promise.reject(new Error('not connected'));
    return new Promise((done, failed) => {
      const requestId = this.nextId++;
      this.assets.set(requestId, { done, failed });
      this.send({ op: 'fetchAsset', requestId, uri });
    });
  }

  // -- parameters

  // All values there are, now and whenever one changes, to `onparameters`.
  watchParameters(on: boolean): void {
    if (on === this.watching) return;
    this.watching = on;
    this.send({ op: on ? 'subscribeParameterUpdates' : 'unsubscribeParameterUpdates', parameterNames: [] });
  }

  getParameters(names: string[] = []): Promise<Parameter[]> {
    return this.askParameters('', { op: 'getParameters', parameterNames: names });
  }

  // Fails with the reason of the node that refuses.
  setParameter(parameter: Parameter): Promise<Parameter[]> {
    return this.askParameters(parameter.name, { op: 'setParameters', parameters: [parameter] });
  }

  private askParameters(about: string, frame: object): Promise<Parameter[]> {
    const id = `page${this.nextId++}`;
    if (this.phase !== 'open') return Promise.reject(new Error('not connected'));
    return new Promise((done, failed) => {
      this.asked.set(id, { done, failed, about, errors: [] });
      setTimeout(() => this.asked.delete(id) && failed(new Error('no answer within 5 s')), 5000);
      this.send({ ...frame, id });
    });
  }

  private send(frame: object): void {
    if (this.socket && this.socket.readyState === 1) this.socket.send(JSON.stringify(frame));
  }
}
