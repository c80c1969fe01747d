// The running program with the protocol's own client library, and the page's parser of schemas compared with another
// one.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { MessageReader } from '@foxglove/rosmsg2-serialization';
import { readCdr } from '../../src/protocol/cdr';
import { parseSchema, shortName } from '../../src/protocol/schema';
import { sameTypes } from '../same_types';
import { bytesOf, definitions, encode, Peer, Program, sleep, until } from './harness';

const program = new Program();
let peer: Peer;
before(async () => {
  await program.start();
  peer = new Peer(program.port);
  await until('services and topics', () => peer.info && peer.channels.has('/joint_states') && peer.services.has('/gazebo/get_state')
    && peer.channels.has('/omarm_arm_controller/controller_state'));
  await sleep(300); // further channels are advertised in the next tick
});
after(() => {
  peer?.close();
  program.stop();
});

const has = (capability: string): boolean => (peer.info!['capabilities'] as string[]).includes(capability);

// Lists as plain arrays, whole numbers as plain numbers if they are exact.
function plain(value: unknown): unknown {
  if (typeof value === 'bigint') return value >= -9007199254740991n && value <= 9007199254740991n ? Number(value) : value;
  if (ArrayBuffer.isView(value)) return Array.from(value as unknown as ArrayLike<unknown>, plain);
  if (Array.isArray(value)) return value.map(plain);
  if (typeof value !== 'object' || value === null) return value;
  return Object.fromEntries(Object.entries(value).map(([name, part]) => [name, plain(part)]));
}

// With the page's schema the bytes give the same values as with the other parser's.
function agree(name: string, schema: string, bytes: Uint8Array): unknown {
  const theirs = plain(new MessageReader(definitions(schema)).readMessage(bytes));
  const type = parseSchema(name, schema).get(shortName(name))!;
  assert.deepEqual(plain(readCdr(type, new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength))), theirs, name);
  return theirs;
}

test('the server says who it is and what it can do', () => {
  for (const capability of ['clientPublish', 'services', 'parameters', 'parametersSubscribe', 'connectionGraph', 'time', 'assets']) {
    assert.ok(has(capability), capability);
  }
  assert.deepEqual([...(peer.info!['supportedEncodings'] as string[])].sort(), ['cdr', 'json']);
  assert.ok(String(peer.info!['sessionId']).length > 0);
});

test('every channel and service has a schema that others can parse, in which the page finds the same types', () => {
  assert.ok(peer.channels.size > 10);
  for (const channel of peer.channels.values()) {
    assert.equal(channel.encoding, 'cdr');
    assert.equal(channel.schemaEncoding, 'ros2msg');
    sameTypes(channel.schemaName, channel.schema, definitions(channel.schema));
  }
  for (const service of peer.services.values()) {
    for (const part of [service.request!, service.response!]) {
      assert.equal(part.encoding, 'cdr');
      sameTypes(part.schemaName, part.schema, definitions(part.schema));
    }
  }
});

test('one message of each type has the same values by both parsers', { timeout: 60_000 }, async (t) => {
  const wanted = new Map([...peer.channels.values()].map((channel) => [channel.schemaName, channel.schema]));
  const got = new Map<string, Uint8Array>();
  const topics = new Map<number, { schemaName: string }>();
  const listen = (event: { subscriptionId: number; data: DataView }): void => {
    const channel = topics.get(event.subscriptionId);
    if (channel && !got.has(channel.schemaName)) got.set(channel.schemaName, bytesOf(event.data));
  };
  peer.client.on('message', listen);
  for (const channel of peer.channels.values()) topics.set(peer.client.subscribe(channel.id), channel);
  t.after(() => {
    peer.client.off('message', listen);
    for (const id of topics.keys()) peer.client.unsubscribe(id);
  });

  // Messages that need a trigger: a goal causes feedback and status, command topics are echoed.
  const joints = peer.channels.get('/joint_states')!;
  await until('joint states', () => got.has(joints.schemaName));
  const state = agree(joints.schemaName, joints.schema, got.get(joints.schemaName)!) as { name: string[] };
  assert.ok(state.name.includes('Revolute 1'));
  const send = (topic: string, message: object): void => {
    const channel = peer.channels.get(topic);
    if (!channel) return;
    const id = peer.client.advertise({ topic, encoding: 'cdr', schemaName: channel.schemaName });
    peer.client.sendMessage(id, encode(channel.schema, message));
  };
  const now = await peer.call('/gazebo/get_state', {});
  const { names, positions } = plain(now.message) as { names: string[]; positions: number[] };
  const controllers = plain((await peer.call('/controller_manager/list_controllers', {})).message) as { controller: { name: string; claimed_interfaces: string[] }[] };
  const arm = controllers.controller.find((c) => c.name === 'omarm_arm_controller')!.claimed_interfaces.map((claim) => claim.slice(0, claim.lastIndexOf('/')));
  const trajectory = { joint_names: arm, points: [{ positions: arm.map((name) => positions[names.indexOf(name)]!), time_from_start: { sec: 0, nanosec: 300_000_000 } }] };
  const goal = '/omarm_arm_controller/follow_joint_trajectory/_action/send_goal';
  if (peer.services.has(goal)) {
    const answer = await peer.call(goal, { goal_id: { uuid: Uint8Array.from({ length: 16 }, (_, i) => i) }, goal: { trajectory } });
    assert.equal(answer.message['accepted'], true);
  }
  send('/omarm_arm_controller/joint_trajectory', trajectory);
  send('/omarm_arm_controller/speed_scaling_input', { factor: 1 });
  send('/rosout', { stamp: { sec: 1, nanosec: 2 }, level: 20, name: 'peer', msg: 'ünïcode', file: 'a.cpp', function: 'f', line: 7 });
  const far = { position: { x: 5, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };
  const crate = { header: { frame_id: 'world' }, id: 'crate', pose: far, primitives: [{ type: 1, dimensions: [0.1, 0.2, 0.3] }], subframe_names: ['top'], subframe_poses: [far] };
  send('/collision_object', crate);
  send('/attached_collision_object', { link_name: 'tool_link_1', object: { ...crate, id: 'peg' }, touch_links: ['gripper_base_1'] });
  send('/planning_scene_world', { collision_objects: [crate], octomap: { octomap: { id: 'OcTree', resolution: 0.1, binary: true, data: [-1, 1] } } });
  const gripper = ['omarm_gripper_controller'];
  await peer.call('/controller_manager/switch_controller', { deactivate_controllers: gripper, strictness: 2 });
  await peer.call('/controller_manager/switch_controller', { activate_controllers: gripper, strictness: 2 });
  await peer.call('/omarm_arm_controller/set_parameters', { parameters: [{ name: 'constraints.goal_time', value: { type: 3, double_value: 0.5 } }] });
  const missing = (): string[] => [...wanted.keys()].filter((name) => !got.has(name));
  await until(`messages of ${missing().join(', ')}`, () => missing().length === 0).catch(() => {
    throw new Error(`no message came of ${missing().join(', ')}`);
  });
  for (const [name, schema] of wanted) agree(name, schema, got.get(name)!);
});

test('services answer, with the same values by both parsers; failures name the call', async () => {
  for (const [name, service] of peer.services) {
    if (!/\/(list_|get_state$|get_model_state$|query_state$|describe_parameters$|get_parameters$)/.test(name)) continue;
    const { bytes } = await peer.call(name, {});
    agree(service.response!.schemaName, service.response!.schema, bytes);
  }
  const service = peer.services.get('/gazebo/step')!;
  const failure = await peer.next<{ callId: number; message: string }>('serviceCallFailure', (one) => one.callId === 77,
    () => peer.client.sendServiceCallRequest({ serviceId: service.id, callId: 77, encoding: 'cdr', data: Uint8Array.of(0, 1, 0, 0, 1) }));
  assert.ok(failure.message.length > 0);
  await peer.next<{ callId: number }>('serviceCallFailure', (one) => one.callId === 78,
    () => peer.client.sendServiceCallRequest({ serviceId: 999_999, callId: 78, encoding: 'cdr', data: Uint8Array.of(0, 1, 0, 0) }));
});

test('a client publishes as CDR and as JSON, and the arm follows both', async () => {
  const topic = '/omarm_gripper_controller/joint_trajectory';
  const channel = peer.channels.get(topic)!;
  const states = peer.channels.get('/joint_states')!;
  const reader = new MessageReader(definitions(states.schema));
  const at = new Map<string, number>();
  const listen = (event: { subscriptionId: number; data: DataView }): void => {
    if (event.subscriptionId !== watching) return;
    const { name, position } = reader.readMessage(event.data) as { name: string[]; position: Float64Array };
    name.forEach((one, i) => at.set(one, position[i]!));
  };
  peer.client.on('message', listen);
  const watching = peer.client.subscribe(states.id);
  const list = plain((await peer.call('/controller_manager/list_controllers', {})).message) as { controller: { name: string; claimed_interfaces: string[] }[] };
  const claim = list.controller.find((c) => c.name === 'omarm_gripper_controller')!.claimed_interfaces[0]!;
  const joint = claim.slice(0, claim.lastIndexOf('/'));
  const start = await until('the gripper', () => (at.has(joint) ? { value: at.get(joint)! } : null));
  for (const [encoding, offset] of [['cdr', 0.2], ['json', 0.1]] as const) {
    const goal = start.value + offset;
    const id = peer.client.advertise({ topic, encoding, schemaName: channel.schemaName });
    const nanoseconds = 300_000_000;
    const message = (time: object): object => ({ joint_names: [joint], points: [{ positions: [goal], time_from_start: time }] });
    peer.client.sendMessage(id, encoding === 'cdr' ? encode(channel.schema, message({ sec: 0, nanosec: nanoseconds }))
      : new TextEncoder().encode(JSON.stringify(message({ sec: 0, nanosec: nanoseconds }))));
    await until(`the goal sent as ${encoding} (${goal}, is ${at.get(joint)})`, () => Math.abs(at.get(joint)! - goal) < 0.03);
    peer.client.unadvertise(id);
  }
  peer.client.off('message', listen);
  peer.client.unsubscribe(watching);
});

test('parameters are read, set and watched', async () => {
  type Values = { id?: string; parameters: { name: string; value: unknown }[] };
  const all = await peer.next<Values>('parameterValues', (v) => v.id === 'all', () => peer.client.getParameters([], 'all'));
  assert.ok(all.parameters.length > 20);
  const chosen = all.parameters.find((p) => /omarm_arm_controller\.constraints\..*goal$/.test(p.name))!;
  const one = await peer.next<Values>('parameterValues', (v) => v.id === 'one', () => peer.client.getParameters([chosen.name], 'one'));
  assert.deepEqual(one.parameters, [chosen]);
  peer.client.subscribeParameterUpdates([chosen.name]);
  await sleep(1500); // the first check of the watcher is the reference for later ones
  const set = await peer.next<Values>('parameterValues', (v) => v.id === 'set',
    () => peer.client.setParameters([{ name: chosen.name, value: 0.123, type: 'float64' }], 'set'));
  assert.equal(set.parameters.find((p) => p.name === chosen.name)?.value, 0.123);
  const watcher = new Peer(program.port);
  await until('a second client', () => watcher.info);
  watcher.client.subscribeParameterUpdates([chosen.name]);
  await sleep(1500);
  const changed = await watcher.next<Values>('parameterValues', (v) => v.id === undefined && v.parameters.some((p) => p.value === 0.321),
    () => peer.client.setParameters([{ name: chosen.name, value: 0.321, type: 'float64' }]));
  assert.deepEqual(changed.parameters.map((p) => p.name), [chosen.name]);
  watcher.close();
  const refused = await peer.next<Values>('parameterValues', (v) => v.id === 'refused',
    () => peer.client.setParameters([{ name: chosen.name, value: 'no number' }], 'refused'));
  assert.notEqual(refused.parameters.find((p) => p.name === chosen.name)?.value, 'no number');
  peer.client.unsubscribeParameterUpdates([chosen.name]);
});

test('the connection graph names publishers, subscribers and providers', async () => {
  type Graph = { publishedTopics: { name: string; publisherIds: string[] }[]; subscribedTopics: { name: string; subscriberIds: string[] }[]; advertisedServices: { name: string }[] };
  const graph = await peer.next<Graph>('connectionGraphUpdate', () => true, () => peer.client.subscribeConnectionGraph());
  assert.ok(graph.publishedTopics.find((t) => t.name === '/joint_states')!.publisherIds.includes('/joint_state_broadcaster'));
  assert.ok(graph.subscribedTopics.find((t) => t.name === '/omarm_arm_controller/joint_trajectory')!.subscriberIds.length > 0);
  assert.ok(graph.advertisedServices.some((s) => s.name === '/gazebo/pause_physics'));
  peer.client.unsubscribeConnectionGraph();
});

test('time comes while somebody listens, and runs forward', async () => {
  const id = peer.client.subscribe(peer.channels.get('/clock')!.id);
  const times: bigint[] = [];
  const listen = (event: { timestamp: bigint }): void => void times.push(event.timestamp);
  peer.client.on('time', listen);
  await until('three times', () => times.length >= 3);
  peer.client.off('time', listen);
  peer.client.unsubscribe(id);
  for (let i = 1; i < times.length; i += 1) assert.ok(times[i]! > times[i - 1]!);
});

test('assets: the meshes of the robot, and no other file of the machine', async () => {
  const channel = peer.channels.get('/robot_description')!;
  let id = -1;
  const described = await peer.next<{ subscriptionId: number; data: DataView }>('message', (m) => m.subscriptionId === id,
    () => (id = peer.client.subscribe(channel.id)));
  peer.client.unsubscribe(id);
  const urdf = (new MessageReader(definitions(channel.schema)).readMessage(described.data) as { data: string }).data;
  const mesh = /<mesh[^>]*filename="([^"]+)"/.exec(urdf)![1]!;
  type Answer = { requestId: number; status: number; error?: string; data?: DataView };
  let request = 1;
  const ask = (uri: string): Promise<Answer> => {
    const requestId = request++;
    return peer.next<Answer>('fetchAssetResponse', (a) => a.requestId === requestId, () => peer.client.fetchAsset(uri, requestId));
  };
  const good = await ask(mesh);
  assert.equal(good.status, 0, good.error);
  assert.equal(good.data!.byteLength, 84 + 50 * good.data!.getUint32(80, true), 'a whole binary STL');
  const folder = mesh.slice(0, mesh.lastIndexOf('/'));
  const up = '../'.repeat(12), hidden = '%2e%2e/'.repeat(12), twice = '%2e%2e%2f'.repeat(12);
  for (const uri of ['file:///etc/passwd', '/etc/passwd', 'etc/passwd', '', 'package://', `${folder}/${up}etc/passwd`, `${folder}/${hidden}etc/passwd`, `${folder}/${twice}etc/passwd`,
    `file://localhost/etc/passwd`, `file:////etc/passwd`, `${mesh}/${up}etc/passwd`, `${mesh}\0.png`, `http://127.0.0.1:${program.port}/health`, `package://../../${up}etc/passwd`, folder, `${folder}/../package.xml`]) {
    const answer = await ask(uri);
    assert.equal(answer.status, 1, `'${uri}' was answered`);
    assert.ok((answer.error ?? '').length > 0, `'${uri}' is refused without a reason`);
    assert.ok(!(answer.error ?? '').includes('root:'), uri);
  }
});
