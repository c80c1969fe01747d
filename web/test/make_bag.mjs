// Recordings for tests, by the writer of @mcap/core and the CDR writer of Foxglove, in the shape of rosbag2: an arm of two joints
// and a finger that moves on a known path, a log, a picture, a mesh, an event.
import { McapWriter } from '@mcap/core';
import { MessageWriter } from '@foxglove/rosmsg2-serialization';
import { parse } from '@foxglove/rosmsg';
import { compress as lz4 } from 'lz4js';

const TIME = 'int32 sec\nuint32 nanosec\n';
const RULE = `${'='.repeat(80)}\n`;
const HEADER = `${RULE}MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n${RULE}MSG: builtin_interfaces/Time\n${TIME}`;
const VECTOR = `${RULE}MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n`;
const SCHEMAS = {
  'std_msgs/msg/String': 'string data\n',
  'sensor_msgs/msg/JointState': `std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n${HEADER}`,
  'rcl_interfaces/msg/Log': `builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line\n${RULE}MSG: builtin_interfaces/Time\n${TIME}`,
  'sensor_msgs/msg/Image': `std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n${HEADER}`,
  'tf2_msgs/msg/TFMessage': `geometry_msgs/TransformStamped[] transforms\n${RULE}MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n`
    + `${RULE}MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n${VECTOR}${RULE}MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n${HEADER}`,
};

export const START = 1_700_000_000_000_000_000n; // ns
export const MESH = 'package://small_arm/meshes/hand.stl';

const link = (name, length, colour) => `<link name="${name}"><visual><origin xyz="0 0 ${length / 2}"/><geometry><cylinder radius="0.035" length="${length}"/></geometry><material name="${name}"><color rgba="${colour} 1"/></material></visual></link>`;
const joint = (name, type, parent, child, z, axis, lower, upper) => `<joint name="${name}" type="${type}"><parent link="${parent}"/><child link="${child}"/><origin xyz="0 0 ${z}"/><axis xyz="${axis}"/><limit lower="${lower}" upper="${upper}" effort="20" velocity="2"/></joint>`;
export const URDF = `<robot name="small_arm"><link name="base"><visual><origin xyz="0 0 0.03"/><geometry><cylinder radius="0.09" length="0.06"/></geometry></visual></link>
${link('upper', 0.3, '0.2 0.45 0.7')}${link('fore', 0.25, '0.85 0.5 0.15')}<link name="hand"><visual><geometry><mesh filename="${MESH}"/></geometry></visual></link>
${joint('shoulder', 'revolute', 'base', 'upper', 0.06, '0 1 0', -2, 2)}${joint('elbow', 'revolute', 'upper', 'fore', 0.3, '0 1 0', -2.5, 2.5)}${joint('finger', 'prismatic', 'fore', 'hand', 0.25, '0 0 1', 0, 0.05)}</robot>`;

// A pyramid as a binary STL file.
export function meshBytes() {
  const corners = [[-0.03, -0.03, 0], [0.03, -0.03, 0], [0.03, 0.03, 0], [-0.03, 0.03, 0], [0, 0, 0.07]];
  const faces = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [0, 3, 2], [0, 2, 1]];
  const view = new DataView(new ArrayBuffer(84 + 50 * faces.length));
  view.setUint32(80, faces.length, true);
  faces.forEach((face, i) => face.forEach((corner, k) => corners[corner].forEach((value, axis) => view.setFloat32(84 + 50 * i + 12 + 12 * k + 4 * axis, value, true))));
  return new Uint8Array(view.buffer);
}

export const shoulderAt = (time, offset = 0) => 0.9 * Math.sin(0.8 * time) + offset;
export const elbowAt = (time) => 0.7 * Math.cos(0.5 * time);
export const fingerAt = (time) => 0.02 + 0.01 * Math.sin(time);

// A frame of zstd with one block that is not compressed.
function zstd(bytes) {
  const size = bytes.length;
  const block = (size << 3) | 1;
  return Uint8Array.of(0x28, 0xb5, 0x2f, 0xfd, 0xa0, size & 255, (size >> 8) & 255, (size >> 16) & 255, size >>> 24, block & 255, (block >> 8) & 255, (block >> 16) & 255, ...bytes);
}
const COMPRESS = { lz4: (bytes) => Uint8Array.from(lz4(bytes)), zstd };

class Memory {
  parts = [];
  size = 0n;
  position() {
    return this.size;
  }
  async write(bytes) {
    this.parts.push(bytes.slice());
    this.size += BigInt(bytes.length);
  }
}

const stampOf = (time) => ({ sec: Math.floor(time), nanosec: Math.round((time - Math.floor(time)) * 1e9) });

// `seconds`, `rate` of the joint states, `offset` of the shoulder's position, `from` and `to`: only the messages of that part, as
// in one of several files; `describe`: with /robot_description; `mesh`: with the mesh as an attachment; `large`: bytes of a further one; `spaces`: the namespaces of several robots, each 0.2 rad from the one before; `compression`: '', 'lz4',
// or a name that is not known; `chunks`: false writes messages outside of chunks.
export async function makeBag({ seconds = 10, rate = 50, offset = 0, from = 0, to = Infinity, describe = true, mesh = true, large = 0, spaces = [''], library = 'test', compression = '', chunks = true, chunkSize = 16 * 1024 } = {}) {
  const memory = new Memory();
  const writer = new McapWriter({ writable: memory, useChunks: chunks, chunkSize, compressChunk: compression ? (bytes) => ({ compression, compressedData: COMPRESS[compression]?.(bytes) ?? bytes }) : undefined });
  await writer.start({ profile: 'ros2', library });
  const channels = new Map();
  const writers = new Map();
  const channel = async (topic, type, durability = 2) => {
    const schemaId = await writer.registerSchema({ name: type, encoding: 'ros2msg', data: new TextEncoder().encode(SCHEMAS[type]) });
    writers.set(topic, new MessageWriter(parse(SCHEMAS[type], { ros2: true })));
    channels.set(topic, await writer.registerChannel({ schemaId, topic, messageEncoding: 'cdr', metadata: new Map([['offered_qos_profiles', `- history: 1\n  durability: ${durability}\n`]]) }));
  };
  for (const space of describe ? spaces : []) await channel(`${space}/robot_description`, 'std_msgs/msg/String', 1);
  if (spaces.length > 1) for (const name of ['/doppel/status', ...spaces.map((space) => `${space}/doppel/health`)]) await channel(name, 'std_msgs/msg/String', 1);
  await channel('/tf_static', 'tf2_msgs/msg/TFMessage', 1);
  for (const space of spaces) await channel(`${space}/joint_states`, 'sensor_msgs/msg/JointState');
  await channel('/rosout', 'rcl_interfaces/msg/Log', 1);
  await channel('/camera/image_raw', 'sensor_msgs/msg/Image');

  const events = [];
  const put = (time, topic, message) => events.push({ time, topic, message });
  for (const space of describe ? spaces : []) put(0.005, `${space}/robot_description`, { data: URDF });
  put(0.005, '/tf_static', { transforms: [{ header: { stamp: stampOf(0), frame_id: 'world' }, child_frame_id: 'base', transform: { translation: { x: 0, y: 0, z: 0 }, rotation: { x: 0, y: 0, z: 0, w: 1 } } }] });
  const count = Math.round(seconds * rate);
  for (let i = 0; i <= count; i += 1) {
    const time = i / rate;
    for (const [k, space] of spaces.entries()) put(time, `${space}/joint_states`, { header: { stamp: stampOf(time), frame_id: '' }, name: ['shoulder', 'elbow', 'finger'], position: [shoulderAt(time, offset + 0.2 * k), elbowAt(time), fingerAt(time)],
      velocity: [0.72 * Math.cos(0.8 * time), -0.35 * Math.sin(0.5 * time), 0.01 * Math.cos(time)], effort: [2, 1, 0.1] });
  }
  for (let i = 0; i * 0.2 <= seconds; i += 1) {
    const time = i * 0.2 + 0.01;
    put(time, '/camera/image_raw', { header: { stamp: stampOf(time), frame_id: 'hand' }, height: 8, width: 8, encoding: 'mono8', is_bigendian: 0, step: 8, data: new Uint8Array(64).fill(i) });
  }
  for (let time = 1; time < seconds; time += 1) {
    const level = time === 3 ? 30 : time === 6 ? 40 : 20;
    put(time + 0.003, '/rosout', { stamp: stampOf(time), level, name: 'planner', msg: level === 40 ? 'the goal is out of reach' : level === 30 ? 'the goal is near a limit' : `second ${time}`, file: 'planner.cpp', function: 'plan', line: 12 });
  }
  events.sort((a, b) => a.time - b.time);
  let sequence = 0;
  for (const { time, topic, message } of events) {
    if (time < from || time >= to) continue;
    const logTime = START + BigInt(Math.round(time * 1e9));
    await writer.addMessage({ channelId: channels.get(topic), sequence: sequence += 1, logTime, publishTime: logTime, data: writers.get(topic).writeMessage(message) });
  }
  if (mesh) await writer.addAttachment({ name: MESH, mediaType: 'model/stl', logTime: START, createTime: START, data: meshBytes() });
  if (large > 0) await writer.addAttachment({ name: 'film.mp4', mediaType: 'video/mp4', logTime: START + 2_000_000_000n, createTime: START, data: new Uint8Array(large) });
  if (from === 0) {
    await writer.addAttachment({ name: 'note.txt', mediaType: 'text/plain', logTime: START + 4_000_000_000n, createTime: START, data: new TextEncoder().encode('here it began') });
    await writer.addMetadata({ name: 'event', metadata: new Map([['time', String(START + 5_000_000_000n)], ['text', 'the light went out']]) });
  }
  await writer.end();
  const out = new Uint8Array(Number(memory.size));
  let position = 0;
  for (const part of memory.parts) {
    out.set(part, position);
    position += part.length;
  }
  return out;
}
