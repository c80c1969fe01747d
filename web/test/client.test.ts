import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Client, type SocketLike } from '../src/protocol/client';

const buffer = (...parts: number[]): ArrayBuffer => Uint8Array.from(parts).buffer;

class FakeSocket implements SocketLike {
  binaryType = '';
  readyState = 1;
  bufferedAmount = 0;
  onopen = null;
  onclose: SocketLike['onclose'];
  onmessage: SocketLike['onmessage'];
  onerror = null;
  protocol = '';
  sent: (string | Uint8Array)[] = [];
  send(data: string | ArrayBuffer | ArrayBufferView): void { this.sent.push(data as string | Uint8Array); }
  close(): void { this.onclose?.({ code: 1000, reason: '' }); }
  say(frame: object): void { this.onmessage?.({ data: JSON.stringify(frame) }); }
  ops(): string[] { return this.sent.filter((s) => typeof s === 'string').map((s) => (JSON.parse(s as string) as { op: string }).op); }
}

test('what cannot be read is reported once; what comes after it is taken', () => {
  let socket!: FakeSocket;
  const client = new Client({ url: 'ws://x', connect: () => (socket = new FakeSocket()) });
  const got: unknown[] = [];
  const reported: string[] = [];
  client.onstatus = (level, text) => reported.push(`${level} ${text}`);
  client.subscribe('/n', (message) => got.push(message['data']));
  client.start();
  socket.say({ op: 'serverInfo', name: 'twin', capabilities: [] });
  socket.say({ op: 'advertise', channels: [{ id: 3, topic: '/n', encoding: 'cdr', schemaName: 'std_msgs/msg/String', schema: 'string data\n' }] });
  const { subscriptions } = JSON.parse(socket.sent[0] as string) as { subscriptions: { id: number }[] };
  const message = (...payload: number[]): void => socket.onmessage!({ data: buffer(1, subscriptions[0]!.id, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, ...payload) });
  for (let i = 0; i < 3; i += 1) message(200, 0, 0, 0, 104);
  assert.equal(reported.length, 1);
  assert.match(reported[0]!, /^2 \/n: std_msgs\/msg\/String cannot be read: /);
  for (const frame of ['{', '{"op":"later"}', buffer(), buffer(77), buffer(1, 2), buffer(3, 0, 0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0, 1)]) {
    for (let i = 0; i < 3; i += 1) socket.onmessage!({ data: frame });
  }
  assert.ok(reported.length > 3 && new Set(reported).size === reported.length, reported.join('\n'));
  message(3, 0, 0, 0, 104, 105, 0);
  assert.deepEqual(got, ['hi']);
  client.stop();
});

test('topics that come back in another order, or not at all, reach their own subscriptions', async () => {
  const sockets: FakeSocket[] = [];
  const client = new Client({ url: 'ws://x', connect: () => { const s = new FakeSocket(); sockets.push(s); return s; } });
  const got: string[] = [];
  const ends = ['/a', '/b', '/c'].map((topic) => client.subscribe(topic, (message) => got.push(`${topic} ${String(message['data'])}`)));
  client.start();
  const offer = (socket: FakeSocket, topics: string[]): void => {
    socket.say({ op: 'serverInfo', name: 'twin', capabilities: [] });
    socket.say({ op: 'advertise', channels: topics.map((topic, id) => ({ id, topic, encoding: 'cdr', schemaName: 'std_msgs/msg/Int8', schema: 'int8 data\n' })) });
  };
  const tell = (socket: FakeSocket): void => {
    for (const frame of socket.sent) {
      const { op, subscriptions } = JSON.parse(frame as string) as { op: string; subscriptions: { id: number; channelId: number }[] };
      if (op === 'subscribe') socket.onmessage!({ data: buffer(1, subscriptions[0]!.id, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, subscriptions[0]!.channelId) });
    }
  };
  offer(sockets[0]!, ['/a', '/b', '/c']);
  sockets[0]!.close();
  await new Promise((done) => setTimeout(done, 400));
  offer(sockets[1]!, ['/c', '/a']);
  ends[1]!();
  tell(sockets[1]!);
  assert.deepEqual(got, ['/c 0', '/a 1']);
  sockets[1]!.say({ op: 'unadvertise', channelIds: [0] });
  sockets[1]!.say({ op: 'advertise', channels: [{ id: 7, topic: '/c', encoding: 'cdr', schemaName: 'std_msgs/msg/Int8', schema: 'int8 data\n' }] });
  tell(sockets[1]!);
  assert.deepEqual(got.slice(2), ['/a 1', '/c 7']);
  client.stop();
});

test('a service of either spelling has its request', () => {
  let socket!: FakeSocket;
  const client = new Client({ url: 'ws://x', connect: () => (socket = new FakeSocket()) });
  client.start();
  socket.say({ op: 'serverInfo', name: 'twin', capabilities: [] });
  socket.say({ op: 'advertiseServices', services: [
    { id: 1, name: '/old', type: 'a/srv/Old', requestSchema: 'int8 x', responseSchema: '' },
    { id: 2, name: '/new', type: 'a/srv/New', request: { encoding: 'cdr', schemaName: 'a/srv/New_Request', schemaEncoding: 'ros2msg', schema: 'int8 y' } },
  ] });
  assert.deepEqual(['/old', '/new'].map((name) => client.requestType(name)?.fields.map((field) => field.name)), [['x'], ['y']]);
  client.stop();
});

test('a fetched asset is its bytes; one that is refused fails with the reason', async () => {
  let socket!: FakeSocket;
  const client = new Client({ url: 'ws://x', connect: () => (socket = new FakeSocket()) });
  await assert.rejects(client.fetchAsset('a'), /not connected/);
  client.start();
  socket.say({ op: 'serverInfo', name: 'twin', capabilities: ['assets'] });
  const idOf = (frame: number): number => (JSON.parse(socket.sent[frame] as string) as { requestId: number }).requestId;
  const good = client.fetchAsset('package://a/b.stl'), refused = client.fetchAsset('package://a/c.stl');
  socket.onmessage!({ data: buffer(4, idOf(0), 0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3) });
  socket.onmessage!({ data: buffer(4, idOf(1), 0, 0, 0, 1, 2, 0, 0, 0, 110, 111) });
  assert.deepEqual(await good, Uint8Array.of(1, 2, 3));
  await assert.rejects(refused, /no/);
  client.stop();
});

test('what the page publishes is advertised once, and again after the twin came back', async () => {
  const sockets: FakeSocket[] = [];
  const client = new Client({ url: 'ws://x', connect: () => { const s = new FakeSocket(); sockets.push(s); return s; } });
  client.start();
  client.publish('/c', 'std_msgs/msg/Float64MultiArray', { data: [1] });
  for (let i = 0; i < 2; i += 1) {
    sockets[i]!.say({ op: 'serverInfo', name: 'twin', capabilities: [] });
    client.publish('/c', 'std_msgs/msg/Float64MultiArray', { data: [1] });
    client.publish('/c', 'std_msgs/msg/Float64MultiArray', { data: [2] });
    assert.deepEqual(sockets[i]!.ops(), ['advertise']);
    const { channels } = JSON.parse(sockets[i]!.sent[0] as string) as { channels: { id: number; topic: string; schemaName: string }[] };
    assert.deepEqual([channels[0]!.topic, channels[0]!.schemaName], ['/c', 'std_msgs/msg/Float64MultiArray']);
    const frames = sockets[i]!.sent.slice(1) as Uint8Array[];
    assert.deepEqual(frames.map((frame) => [frame[0], frame[1]]), [[1, channels[0]!.id], [1, channels[0]!.id]]);
    if (i === 0) {
      sockets[0]!.close();
      await new Promise((done) => setTimeout(done, 400));
    }
  }
  client.stop();
});

test('the client subscribes when the topic comes, and again after the twin came back', async () => {
  const sockets: FakeSocket[] = [];
  const client = new Client({ url: 'ws://x', connect: () => { const s = new FakeSocket(); sockets.push(s); return s; } });
  const got: unknown[] = [];
  client.subscribe('/n', (message) => got.push(message['data']));
  client.start();
  const offer = { op: 'advertise', channels: [{ id: 3, topic: '/n', encoding: 'cdr', schemaName: 'std_msgs/msg/Int8', schema: 'int8 data\n' }] };
  sockets[0]!.say({ op: 'serverInfo', name: 'twin', capabilities: [] });
  assert.deepEqual(sockets[0]!.ops(), []);
  sockets[0]!.say(offer);
  const { subscriptions } = JSON.parse(sockets[0]!.sent[0] as string) as { subscriptions: { id: number; channelId: number }[] };
  assert.equal(subscriptions[0]!.channelId, 3);
  sockets[0]!.onmessage!({ data: buffer(1, subscriptions[0]!.id, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 250) });
  assert.deepEqual(got, [-6]);
  sockets[0]!.close();
  assert.equal(client.phase, 'lost');
  await new Promise((done) => setTimeout(done, 400));
  assert.equal(sockets.length, 2);
  sockets[1]!.say({ op: 'serverInfo', name: 'twin', capabilities: [] });
  sockets[1]!.say(offer);
  assert.deepEqual(sockets[1]!.ops(), ['subscribe']);
  client.stop();
});

test("a twin in a namespace is met by the names that it has without one; '/tf' stays what it is", () => {
  let socket!: FakeSocket;
  const client = new Client({ url: 'ws://x', connect: () => (socket = new FakeSocket()) });
  for (const topic of ['/joint_states', '/tf']) client.subscribe(topic, () => {});
  client.start();
  socket.say({ op: 'serverInfo', name: 'twin', capabilities: [] });
  const channel = (id: number, topic: string) => ({ id, topic, encoding: 'cdr', schemaName: 'std_msgs/msg/Int8', schema: 'int8 data\n' });
  socket.say({ op: 'advertise', channels: [channel(1, '/left/joint_states'), channel(2, '/left/doppel/health'), channel(3, '/tf')] });
  const asked = socket.sent.map((frame) => (JSON.parse(frame as string) as { subscriptions: { channelId: number }[] }).subscriptions[0]!.channelId);
  assert.deepEqual(asked, [1, 3]);
  assert.equal(client.channel('/joint_states')?.topic, '/left/joint_states');
  socket.say({ op: 'advertiseServices', services: [{ id: 1, name: '/left/gazebo/step', type: 'a/srv/S', requestSchema: '', responseSchema: '' }] });
  assert.ok(client.services.has('/gazebo/step') && client.services.has('/left/gazebo/step') && !client.services.has('/gazebo/stop'));
  client.stop();
});

test('a call is answered, refused, or fails with the connection', async () => {
  let socket!: FakeSocket;
  const client = new Client({ url: 'ws://x', connect: () => (socket = new FakeSocket()) });
  client.start();
  socket.say({ op: 'serverInfo', name: 'twin', capabilities: [] });
  socket.say({ op: 'advertiseServices', services: [{ id: 1, name: '/s', type: 'a/srv/S', request: { schema: 'int8 x', schemaName: 'a/srv/S_Request' }, response: { schema: 'bool ok', schemaName: 'a/srv/S_Response' } }] });
  const answered = client.call('/s', { x: 1 });
  const call = socket.sent[0] as Uint8Array;
  socket.onmessage!({ data: buffer(3, 1, 0, 0, 0, ...call.slice(5, 9), 3, 0, 0, 0, 99, 100, 114, 0, 1, 0, 0, 1) });
  assert.deepEqual(await answered, { ok: true });
  const refused = client.call('/s', {});
  const second = new DataView((socket.sent[1] as Uint8Array).buffer).getUint32(5, true);
  socket.say({ op: 'serviceCallFailure', serviceId: 1, callId: second, message: 'no' });
  await assert.rejects(refused, /no/);
  await assert.rejects(client.call('/gone'), /no service/);
  const lost = client.call('/s', {});
  client.stop();
  await assert.rejects(lost, /lost/);
});

// A bundle of frames, as doppel's server sends it.
const bundle = (...frames: number[][]): ArrayBuffer => buffer(0x80, ...frames.flatMap((frame) => [frame.length & 255, frame.length >> 8, 0, 0, ...frame]));

test('the messages of a bundle are taken in their order; one that ends too early is reported and ends nothing', () => {
  let socket!: FakeSocket;
  const client = new Client({ url: 'ws://x', connect: () => (socket = new FakeSocket()) });
  const got: unknown[] = [], reported: string[] = [];
  client.onstatus = (_, text) => reported.push(text);
  client.subscribe('/n', (message) => got.push(message['data']));
  client.start();
  socket.say({ op: 'serverInfo', name: 'twin', capabilities: [] });
  socket.say({ op: 'advertise', channels: [{ id: 3, topic: '/n', encoding: 'cdr', schemaName: 'std_msgs/msg/Int8', schema: 'int8 data\n' }] });
  const { subscriptions } = JSON.parse(socket.sent[0] as string) as { subscriptions: { id: number }[] };
  const message = (value: number): number[] => [1, subscriptions[0]!.id, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, value];
  socket.onmessage!({ data: bundle(message(1), message(2)) });
  socket.onmessage!({ data: buffer(0x80, 9, 0, 0, 0, 1) });
  socket.onmessage!({ data: buffer(...message(3)) });
  socket.onmessage!({ data: bundle() });
  assert.deepEqual(got, [1, 2, 3]);
  assert.equal(reported.length, 1);
  assert.match(reported[0]!, /ends too early/);
});

test('without a twin the pauses between attempts grow to five seconds, and a retry ends the pause', (context) => {
  // Node.js 18 takes the list itself, later versions an object with it.
  const timers = ['setTimeout'];
  context.mock.timers.enable((process.versions.node.startsWith('18.') ? timers : { apis: timers }) as never);
  let attempts = 0;
  const client = new Client({ url: 'ws://x', connect: () => {
    attempts += 1;
    const socket = new FakeSocket();
    queueMicrotask(() => socket.close());
    return socket;
  } });
  return (async () => {
    client.start();
    const settle = async (): Promise<void> => { for (let i = 0; i < 5; i += 1) await Promise.resolve(); };
    await settle();
    const pauses: number[] = [];
    for (let i = 0; i < 8; i += 1) {
      const before = attempts;
      let waited = 0;
      while (attempts === before) {
        context.mock.timers.tick(250);
        waited += 250;
      }
      pauses.push(waited);
      await settle();
    }
    assert.deepEqual(pauses, [250, 500, 1000, 2000, 4000, 5000, 5000, 5000]);
    const before = attempts;
    client.retry();
    assert.equal(attempts, before + 1);
    client.stop();
  })();
});
