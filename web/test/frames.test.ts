import assert from 'node:assert/strict';
import { test } from 'node:test';
import { callFrame, FrameError, messageFrame, readServerBinary, readServerText } from '../src/protocol/frames';
import { Client, type SocketLike } from '../src/protocol/client';

const buffer = (...parts: number[]): ArrayBuffer => Uint8Array.from(parts).buffer;

test('binary frames of the server are read', () => {
  const data = readServerBinary(buffer(1, 5, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 42));
  assert.equal(data.kind, 'message');
  if (data.kind === 'message') assert.deepEqual([data.subscription, data.stamp, data.payload.getUint8(0)], [5, 1n, 42]);
  const asset = readServerBinary(buffer(4, 9, 0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3));
  assert.deepEqual(asset.kind === 'asset' && [asset.request, asset.error, [...asset.data]], [9, null, [1, 2, 3]]);
  const refused = readServerBinary(buffer(4, 9, 0, 0, 0, 1, 2, 0, 0, 0, 110, 111));
  assert.equal(refused.kind === 'asset' && refused.error, 'no');
  assert.equal(readServerBinary(buffer(77)).kind, 'unknown');
  for (const short of [buffer(), buffer(1, 2), buffer(3, 0, 0, 0, 0, 0, 0, 0, 0, 9, 0, 0, 0, 1)]) {
    assert.throws(() => readServerBinary(short), FrameError);
  }
});

test('frames of the client have the layout of the protocol', () => {
  assert.deepEqual([...messageFrame(258, Uint8Array.of(7))], [1, 2, 1, 0, 0, 7]);
  assert.deepEqual([...callFrame(1, 2, Uint8Array.of(9))], [2, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, 99, 100, 114, 9]);
});

test('text frames: both spellings of services, unknown operations, no JSON', () => {
  const frame = readServerText('{"op":"advertiseServices","services":[{"id":1,"name":"/a","type":"t","requestSchema":"int8 x","responseSchema":""}]}');
  assert.equal(frame.op === 'advertiseServices' && frame.services[0]!.requestSchema, 'int8 x');
  assert.equal(readServerText('{"op":"later"}').op, 'other');
  assert.throws(() => readServerText('{'), FrameError);
});

class FakeSocket implements SocketLike {
  binaryType = '';
  readyState = 1;
  bufferedAmount = 0;
  onopen = null;
  onclose: SocketLike['onclose'] = null;
  onmessage: SocketLike['onmessage'] = null;
  onerror = null;
  sent: (string | Uint8Array)[] = [];
  send(data: string | Uint8Array): void { this.sent.push(data); }
  close(): void { this.onclose?.({ code: 1000, reason: '' }); }
  say(frame: object): void { this.onmessage?.({ data: JSON.stringify(frame) }); }
  ops(): string[] { return this.sent.filter((s) => typeof s === 'string').map((s) => (JSON.parse(s as string) as { op: string }).op); }
}

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
