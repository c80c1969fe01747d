// A running program and a connection to it with the protocol's own client library.
import type { Channel, Service } from '@foxglove/ws-protocol';
import FoxgloveClient from '@foxglove/ws-protocol/dist/esm/src/FoxgloveClient';
import { parse } from '@foxglove/rosmsg';
import { MessageReader, MessageWriter } from '@foxglove/rosmsg2-serialization';
import { spawn, type ChildProcess } from 'node:child_process';
import { createServer, type AddressInfo } from 'node:net';
import { join } from 'node:path';
import WebSocket from 'ws';

const root = process.env['DOPPEL_ROOT'] ?? join(process.cwd(), '..');
export const program = process.env['DOPPEL'] ?? join(root, 'build/bin/doppel');
export const robot = process.env['DOPPEL_ROBOT'] ?? join(root, 'robots/omarm_one');

export const sleep = (ms: number): Promise<void> => new Promise((done) => setTimeout(done, ms));

export async function until<T>(what: string, look: () => T | undefined | false | null, ms = 20_000): Promise<T> {
  const end = Date.now() + ms;
  for (;;) {
    const found = look();
    if (found) return found;
    if (Date.now() > end) throw new Error(`${what} did not happen within ${ms / 1000} s`);
    await sleep(20);
  }
}

export const definitions = (schema: string): ReturnType<typeof parse> => parse(schema, { ros2: true });

// The bytes of a message; missing fields are empty.
export function encode(schema: string, message: object): Uint8Array {
  return new MessageWriter(definitions(schema)).writeMessage(message);
}

export class Peer {
  readonly client: FoxgloveClient;
  readonly channels = new Map<string, Channel>();
  readonly services = new Map<string, Service>();
  info: Record<string, unknown> | null = null;
  private nextCall = 1;

  constructor(port: number) {
    const ws = new WebSocket(`ws://127.0.0.1:${port}/`, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
    this.client = new FoxgloveClient({ ws: ws as never });
    this.client.on('serverInfo', (info) => (this.info = info as never));
    this.client.on('advertise', (list) => list.forEach((channel) => this.channels.set(channel.topic, channel)));
    this.client.on('advertiseServices', (list) => list.forEach((service) => this.services.set(service.name, service)));
  }

  // The next event for which `wanted` holds, after `act` was called; never, once `unless` ends the waiting.
  next<T>(event: string, wanted: (value: T) => boolean, act: () => void, unless?: AbortSignal, ms = 20_000): Promise<T> {
    return new Promise((done, failed) => {
      const end = (): void => {
        clearTimeout(timer);
        this.client.off(event as never, listen as never);
      };
      const timer = setTimeout(() => failed(new Error(`no ${event} within ${ms / 1000} s`)), ms);
      const listen = (value: T): void => {
        if (!wanted(value)) return;
        end();
        done(value);
      };
      unless?.addEventListener('abort', end);
      this.client.on(event as never, listen as never);
      act();
    });
  }

  async call(name: string, request: object): Promise<{ message: Record<string, unknown>; bytes: Uint8Array }> {
    const service = this.services.get(name);
    if (!service) throw new Error(`there is no service ${name}`);
    const callId = this.nextCall++;
    const data = encode(service.request!.schema, request);
    const answered = new AbortController(); // a remaining timer would keep the program running
    const answer = await Promise.race([
      this.next<{ callId: number; data: DataView }>('serviceCallResponse', (one) => one.callId === callId,
        () => this.client.sendServiceCallRequest({ serviceId: service.id, callId, encoding: 'cdr', data }), answered.signal),
      this.next<{ callId: number; message: string }>('serviceCallFailure', (one) => one.callId === callId, () => {}, answered.signal)
        .then((failure) => Promise.reject(new Error(`${name}: ${failure.message}`))),
    ]).finally(() => answered.abort());
    const bytes = bytesOf(answer.data);
    return { message: new MessageReader(definitions(service.response!.schema)).readMessage(bytes) as Record<string, unknown>, bytes };
  }

  close(): void {
    this.client.close();
  }
}

export function bytesOf(view: ArrayBufferView): Uint8Array {
  return new Uint8Array(view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength));
}

export const freePort = (): Promise<number> =>
  new Promise((done) => {
    const server = createServer().listen(0, '127.0.0.1', () => {
      const { port } = server.address() as AddressInfo;
      server.close(() => done(port));
    });
  });

export class Program {
  private child: ChildProcess | null = null;
  port = 0;

  async start(): Promise<void> {
    this.port = await freePort();
    const child = spawn(program, ['up', robot, '--headless', '--port', String(this.port)], { stdio: 'ignore' });
    this.child = child;
    const end = Date.now() + 20_000;
    for (;;) {
      if (child.exitCode !== null || child.pid === undefined) throw new Error(`${program} ended with ${child.exitCode}`);
      if (await fetch(`http://127.0.0.1:${this.port}/health`).then((r) => r.ok, () => false)) return;
      if (Date.now() > end) throw new Error(`${program} does not answer`);
      await sleep(30);
    }
  }

  stop(): void {
    this.child?.kill('SIGKILL');
  }
}
