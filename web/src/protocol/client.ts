// A twin over the Foxglove WebSocket protocol: topics, services, assets. The Foxglove client handles the frames of one
// connection; this file adds the rest: reconnecting, subscriptions and advertisements that survive a restart of the
// twin, names in a namespace, and the assignment of responses to requests. A recording takes the place of a connection.

import type { Channel, IWebSocket, Parameter, ServerInfo, Service } from '@foxglove/ws-protocol';
// Imported by file: the package's index includes the server and its log, 2.4 KiB compressed that are not used.
import FoxgloveClient from '@foxglove/ws-protocol/dist/esm/src/FoxgloveClient';
import { readCdr, writeCdr, type Message } from './cdr';
import { parseSchema, shortName, type MessageType } from './schema';
import { BUILTIN } from './builtin';
import { framesOf } from './bundle';
import type { Source } from './source';

export type Phase = 'connecting' | 'open' | 'lost';
export type Handler = (message: Message, stamp: bigint) => void;

interface Subscription {
  id: number; // while there is a channel
  topic: string;
  channel: number | null;
  type: MessageType | null;
  handlers: Set<Handler>;
  last: { message: Message; stamp: bigint } | null;
}

interface Pending {
  service: Service;
  done: (value: Message) => void;
  failed: (reason: Error) => void;
  timer: ReturnType<typeof setTimeout>;
}

const MAX_WAIT = 5000; // ms between two attempts to connect: browsers write an error to the console for each

export type SocketLike = IWebSocket & { bufferedAmount: number };

export interface ClientOptions {
  url: string;
  connect?: (url: string, protocol: string) => SocketLike;
}

// The services by name; '/gazebo/step' in the page is '/left/gazebo/step' if the twin is in the namespace '/left'.
class Offers extends Map<string, Service> {
  space = '';
  override get(name: string): Service | undefined {
    return super.get(name) ?? (this.space ? super.get(this.space + name) : undefined);
  }
  override has(name: string): boolean {
    return this.get(name) !== undefined;
  }
}

// Name and text of a service's schema. Servers of older protocol versions send the text only.
function schemaOf(service: Service, part: 'request' | 'response'): [name: string, text: string] {
  const described = service[part];
  return [described?.schemaName || `${service.type}_${part === 'request' ? 'Request' : 'Response'}`, described?.schema ?? service[`${part}Schema`] ?? ''];
}

export class Client {
  phase: Phase = 'connecting';
  serverName = '';
  metadata: Record<string, string> = {}; // of the server, also after the connection is lost
  lostAt = 0; // ms, when the connection was lost
  sessionId = '';
  capabilities = new Set<string>();
  reason = '';
  readonly channels = new Map<number, Channel>();
  readonly services = new Offers();
  readonly received = new Map<string, { count: number; bytes: number; at: number }>();
  onphase: (phase: Phase) => void = () => {};
  ongraph: () => void = () => {};
  onstatus: (level: number, message: string) => void = () => {};
  onparameters: (values: Parameter[]) => void = () => {};
  bytes = 0; // of messages, responses and assets

  private socket: SocketLike | null = null;
  private source: Source | null = null; // the server or recording that is read
  private wire: Source | null = null; // the same, once it has identified itself
  private nextId = 1;
  private wait = 250;
  private next: ReturnType<typeof setTimeout> | undefined; // the next attempt to connect
  private closed = false;
  private readonly subscriptions = new Map<string, Subscription>();
  private readonly byId = new Map<number, Subscription>();
  private readonly advertised = new Map<string, { id: number; type: string }>();
  private readonly calls = new Map<number, Pending>();
  private readonly assets = new Map<number, { done: (data: Uint8Array) => void; failed: (e: Error) => void }>();
  private readonly types = new Map<string, MessageType>();
  private readonly asked = new Map<string, { done: (values: Parameter[]) => void; failed: (e: Error) => void; about: string; errors: string[] }>();
  private readonly reported = new Set<string>(); // the warnings of this connection
  private watching = false;

  constructor(private readonly options: ClientOptions) {
    for (const [name, text] of Object.entries(BUILTIN)) this.learn(name, text);
  }

  start(): void {
    this.closed = false;
    const connect = this.options.connect ?? ((url, protocol) => new WebSocket(url, protocol));
    const socket = connect(this.options.url, FoxgloveClient.SUPPORTED_SUBPROTOCOL);
    this.socket = socket;
    const wire = new FoxgloveClient({ ws: socket });
    this.openBundles(socket);
    wire.on('open', () => {
      this.wait = 250;
    });
    this.follow(wire);
  }

  // Reads this source instead of the server from now on.
  use(source: Source): void {
    const before = this.source;
    if (this.socket) this.socket.onmessage = () => {}; // what the server still sends is not taken
    this.source = null;
    this.closed = true;
    before?.close();
    clearTimeout(this.next);
    if (this.phase === 'open') this.lose('');
    this.received.clear();
    this.follow(source);
  }

  private follow(wire: Source): void {
    this.source = wire;
    wire.on('close', ({ reason }) => {
      if (this.source === wire) this.lose(reason);
    });
    wire.on('error', ({ message }) => {
      if (this.phase === 'open') this.report(message, `the connection: ${message}`);
    });
    wire.on('serverInfo', (info) => this.greet(wire, info));
    this.listenToOffers(wire);
    this.listenToAnswers(wire);
  }

  // Each message of a bundle is given to the protocol's client as a frame of its own.
  private openBundles(socket: SocketLike): void {
    const take = socket.onmessage;
    socket.onmessage = (event) => {
      let frames: Uint8Array[] | null = null;
      try {
        frames = framesOf(event.data);
      } catch (problem) {
        this.report('bundle', `the connection: ${(problem as Error).message}`);
        return;
      }
      if (frames) for (const data of frames) take?.({ ...event, data });
      else take?.(event);
    };
  }

  // Connects now instead of after the rest of the pause.
  retry(): void {
    if (this.socket || this.closed) return;
    clearTimeout(this.next);
    this.start();
  }

  stop(): void {
    this.closed = true;
    this.source?.close();
  }

  private lose(reason: string): void {
    this.socket = null;
    this.source = null;
    this.wire = null;
    if (this.phase === 'open') this.lostAt = performance.now();
    this.reason = reason;
    this.reported.clear();
    this.byId.clear();
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
    this.next = setTimeout(() => this.start(), this.wait);
    this.wait = Math.min(MAX_WAIT, this.wait * 2);
  }

  private setPhase(phase: Phase): void {
    this.phase = phase;
    this.onphase(phase);
  }

  private greet(wire: Source, info: ServerInfo): void {
    this.wire = wire;
    this.serverName = info.name;
    this.metadata = info.metadata ?? {};
    this.sessionId = info.sessionId ?? '';
    this.capabilities = new Set(info.capabilities);
    for (const subscription of this.subscriptions.values()) subscription.last = null;
    for (const [topic, mine] of this.advertised) mine.id = wire.advertise({ topic, encoding: 'cdr', schemaName: mine.type });
    if (this.watching) wire.subscribeParameterUpdates([]);
    this.setPhase('open');
  }

  private listenToOffers(wire: Source): void {
    wire.on('advertise', (channels) => {
      const read = channels.filter((channel) => this.addChannel(channel));
      const bound = this.findSpace() ? this.channels.values() : read;
      for (const channel of bound) this.bind(channel);
      this.ongraph();
    });
    wire.on('unadvertise', (ids) => {
      for (const id of ids) this.removeChannel(id);
      this.ongraph();
    });
    wire.on('advertiseServices', (services) => {
      for (const service of services) this.services.set(service.name, service);
      this.ongraph();
    });
    wire.on('unadvertiseServices', (ids) => {
      for (const [name, service] of this.services) if (ids.includes(service.id)) this.services.delete(name);
      this.ongraph();
    });
  }

  private listenToAnswers(wire: Source): void {
    wire.on('message', ({ subscriptionId, timestamp, data }) => this.take(subscriptionId, timestamp, data));
    wire.on('serviceCallResponse', ({ callId, data }) => {
      this.bytes += data.byteLength;
      this.settle(callId, (call) => call.done(readCdr(this.typeOf(...schemaOf(call.service, 'response')), data)));
    });
    wire.on('serviceCallFailure', ({ callId, message }) => this.settle(callId, (call) => call.failed(new Error(message))));
    wire.on('fetchAssetResponse', (answer) => {
      const waiting = this.assets.get(answer.requestId);
      this.assets.delete(answer.requestId);
      if (!('data' in answer)) {
        waiting?.failed(new Error(answer.error || 'refused'));
        return;
      }
      const { buffer, byteOffset, byteLength } = answer.data;
      this.bytes += byteLength;
      waiting?.done(new Uint8Array(buffer, byteOffset, byteLength));
    });
    wire.on('parameterValues', ({ id = '', parameters }) => {
      const request = this.asked.get(id);
      this.asked.delete(id);
      if (request && request.errors.length > 0) request.failed(new Error(request.errors.join('; ')));
      else request?.done(parameters);
      this.onparameters(parameters);
    });
    wire.on('status', ({ level, message }) => {
      // The reason why a node rejects a value arrives as a status that begins with the parameter's name.
      for (const { about, errors } of this.asked.values()) if (about && message.startsWith(`${about}: `)) errors.push(message.slice(about.length + 2));
      this.onstatus(level, message);
    });
  }

  private take(id: number, stamp: bigint, data: ArrayBufferView): void {
    this.bytes += data.byteLength;
    const subscription = this.byId.get(id);
    if (!subscription || !subscription.type) return;
    const { topic } = subscription;
    const counted = this.received.get(topic) ?? { count: 0, bytes: 0, at: 0 };
    counted.count += 1;
    counted.bytes += data.byteLength;
    counted.at = performance.now();
    this.received.set(topic, counted);
    let message: Message;
    try {
      message = readCdr(subscription.type, data);
    } catch (problem) {
      this.report(topic, `${topic}: ${(problem as Error).message}`);
      return;
    }
    subscription.last = { message, stamp };
    for (const handler of subscription.handlers) handler(message, stamp);
  }

  // Once in a connection: an invalid message is followed by a hundred more in the next second.
  private report(about: string, text: string): void {
    if (this.reported.has(about)) return;
    this.reported.add(about);
    this.onstatus(2, text);
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

  // The program's own topics show in which namespace it is: the status of its loop, or in a view, which has none, the
  // findings. Each robot in a namespace has findings of its own. Whether it has changed.
  private findSpace(): boolean {
    const of = (name: string): string | undefined => {
      for (const { topic } of this.channels.values()) if (topic.endsWith(name)) return topic.slice(0, -name.length);
      return undefined;
    };
    const space = of('/doppel/status') ?? of('/doppel/health');
    if (space === undefined || space === this.services.space) return false;
    this.services.space = space;
    return true;
  }

  // True if its schema can be read.
  private addChannel(channel: Channel): boolean {
    this.channels.set(channel.id, channel);
    try {
      this.types.delete(shortName(channel.schemaName));
      this.learn(channel.schemaName, channel.schema);
    } catch (problem) {
      this.onstatus(1, `${channel.topic}: ${(problem as Error).message}`);
      return false;
    }
    return true;
  }

  // Called for the subscriptions that waited for it.
  private bind(channel: Channel): void {
    for (const subscription of this.subscriptions.values()) {
      if (subscription.channel === null && this.means(subscription.topic, channel)) this.subscribeNow(subscription, channel);
    }
  }

  private means(topic: string, channel: Channel): boolean {
    return channel.topic === topic || (this.services.space !== '' && channel.topic === this.services.space + topic);
  }

  private removeChannel(id: number): void {
    this.channels.delete(id);
    for (const subscription of this.subscriptions.values()) {
      if (subscription.channel !== id) continue;
      subscription.channel = null;
      this.byId.delete(subscription.id);
    }
  }

  private subscribeNow(subscription: Subscription, channel: Channel): void {
    if (channel.encoding !== 'cdr' || !this.wire) return;
    subscription.channel = channel.id;
    subscription.type = this.type(channel.schemaName);
    subscription.id = this.wire.subscribe(channel.id);
    this.byId.set(subscription.id, subscription);
  }

  channel(topic: string): Channel | null {
    let found: Channel | null = null;
    for (const channel of this.channels.values()) {
      if (channel.topic === topic) return channel;
      if (this.means(topic, channel)) found = channel;
    }
    return found;
  }

  // Returns the function that ends the subscription. A topic may appear later, or again after a restart. `fresh`: the last
  // message, which others on this page have read, is not repeated.
  subscribe(topic: string, handler: Handler, fresh = false): () => void {
    let subscription = this.subscriptions.get(topic);
    if (!subscription) {
      subscription = { id: -1, topic, channel: null, type: null, handlers: new Set(), last: null };
      this.subscriptions.set(topic, subscription);
      const channel = this.channel(topic);
      if (channel) this.subscribeNow(subscription, channel);
    } else if (subscription.last && !fresh) {
      const { message, stamp } = subscription.last;
      const mine = subscription;
      queueMicrotask(() => mine.handlers.has(handler) && handler(message, stamp));
    }
    const mine = subscription;
    mine.handlers.add(handler);
    return () => {
      mine.handlers.delete(handler);
      if (mine.handlers.size > 0 || this.subscriptions.get(topic) !== mine) return;
      this.subscriptions.delete(topic);
      if (mine.channel === null) return; // its id may be in use for another topic by now
      this.byId.delete(mine.id);
      this.wire?.unsubscribe(mine.id);
    };
  }

  publish(name: string, typeName: string, message: Message): void {
    const topic = this.channel(name)?.topic ?? name;
    const type = this.type(typeName);
    if (!type) throw new Error(`the type ${typeName} is unknown`);
    const payload = writeCdr(type, message);
    if (!this.wire) return;
    let mine = this.advertised.get(topic);
    if (mine?.type !== typeName) {
      mine = { id: this.wire.advertise({ topic, encoding: 'cdr', schemaName: typeName }), type: typeName };
      this.advertised.set(topic, mine);
    }
    this.wire.sendMessage(mine.id, payload);
  }

  // Bytes that the browser has not sent yet.
  get backlog(): number {
    return this.socket?.bufferedAmount ?? 0;
  }

  // -- services and assets

  requestType(name: string): MessageType | null {
    const service = this.services.get(name);
    return service ? this.typeOf(...schemaOf(service, 'request')) : null;
  }

  call(name: string, request: Message = {}, timeout = 5000): Promise<Message> {
    const service = this.services.get(name);
    const type = this.requestType(name);
    if (!service || !type) return Promise.reject(new Error(`there is no service ${name}`));
    const data = writeCdr(type, request);
    return new Promise((done, failed) => {
      const callId = this.nextId++;
      const timer = setTimeout(() => {
        this.calls.delete(callId);
        failed(new Error(`${name} did not answer within ${timeout / 1000} s`));
      }, timeout);
      this.calls.set(callId, { service, done, failed, timer });
      this.wire?.sendServiceCallRequest({ serviceId: service.id, callId, encoding: 'cdr', data });
    });
  }

  fetchAsset(uri: string): Promise<Uint8Array> {
    const { wire } = this;
    if (!wire) return Promise.reject(new Error('not connected'));
    return new Promise((done, failed) => {
      const requestId = this.nextId++;
      this.assets.set(requestId, { done, failed });
      wire.fetchAsset(uri, requestId);
    });
  }

  // -- parameters

  // All values, now and whenever one changes, to `onparameters`.
  watchParameters(on: boolean): void {
    if (on === this.watching) return;
    this.watching = on;
    if (on) this.wire?.subscribeParameterUpdates([]);
    else this.wire?.unsubscribeParameterUpdates([]);
  }

  getParameters(names: string[] = []): Promise<Parameter[]> {
    return this.askParameters('', (wire, id) => wire.getParameters(names, id));
  }

  // Fails with the reason if the node rejects the value.
  setParameter(parameter: Parameter): Promise<Parameter[]> {
    return this.askParameters(parameter.name, (wire, id) => wire.setParameters([parameter], id));
  }

  private askParameters(about: string, ask: (wire: Source, id: string) => void): Promise<Parameter[]> {
    const { wire } = this;
    if (!wire) return Promise.reject(new Error('not connected'));
    const id = `page${this.nextId++}`;
    return new Promise((done, failed) => {
      this.asked.set(id, { done, failed, about, errors: [] });
      setTimeout(() => this.asked.delete(id) && failed(new Error('no answer within 5 s')), 5000);
      ask(wire, id);
    });
  }
}
