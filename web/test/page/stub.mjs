// A stub of a twin: the protocol's own server library with invented state, for what a running twin does not show on
// demand (a thousand joints, a loop that is late, contacts).
//   node test/page/stub.mjs [--port 8791] [--joints 1000]
import protocol from '@foxglove/ws-protocol';
import { parse } from '@foxglove/rosmsg';
import { MessageReader, MessageWriter } from '@foxglove/rosmsg2-serialization';
import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { dirname, extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { WebSocketServer } from 'ws';

const dist = join(dirname(fileURLToPath(import.meta.url)), '../../dist');
// In the format of the program.
const POLICY = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self' ws: wss: blob:; font-src 'self'; base-uri 'none'; form-action 'none'";
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css' };
const RULE = '='.repeat(80);
const part = (name, ...fields) => `${RULE}\nMSG: ${name}\n${fields.join('\n')}\n`;
const HEADER = part('std_msgs/Header', 'builtin_interfaces/Time stamp', 'string frame_id') + part('builtin_interfaces/Time', 'int32 sec', 'uint32 nanosec');
const VECTOR = part('geometry_msgs/Vector3', 'float64 x', 'float64 y', 'float64 z');
const TIMES = ['control', 'physics', 'publish', 'bus', 'idle'];
const SCHEMAS = {
  'std_msgs/msg/String': 'string data\n',
  'sensor_msgs/msg/JointState': `std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n${HEADER}`,
  'tf2_msgs/msg/TFMessage': `geometry_msgs/TransformStamped[] transforms\n${part('geometry_msgs/TransformStamped', 'std_msgs/Header header', 'string child_frame_id', 'geometry_msgs/Transform transform')}`
    + part('geometry_msgs/Transform', 'geometry_msgs/Vector3 translation', 'geometry_msgs/Quaternion rotation') + VECTOR
    + part('geometry_msgs/Quaternion', 'float64 x', 'float64 y', 'float64 z', 'float64 w') + HEADER,
  'doppel_msgs/msg/TwinStatus': ['sim_time', 'wall_time'].map((f) => `float64 ${f}\n`).join('') + 'uint64 steps\nfloat64 real_time_factor\nbool paused\nfloat64 speed\n'
    + ['lateness_p50', 'lateness_p99', 'lateness_max', ...TIMES.map((t) => `time_${t}`)].map((f) => `float64 ${f}\n`).join('') + 'uint64 overruns\nuint64 skipped\nstring divergence\nstring[] real_hardware\n',
  'doppel_msgs/msg/JointLoads': `std_msgs/Header header\nstring[] joint_names\n${['efforts', 'gravity_torques', 'sags', 'margins', 'effort_limits'].map((f) => `float64[] ${f}\n`).join('')}${HEADER}`,
  'gazebo_msgs/msg/ContactsState': `std_msgs/Header header\ngazebo_msgs/ContactState[] states\n${part('gazebo_msgs/ContactState', 'string info', 'string collision1_name', 'string collision2_name',
    'geometry_msgs/Wrench[] wrenches', 'geometry_msgs/Wrench total_wrench', 'geometry_msgs/Vector3[] contact_positions', 'geometry_msgs/Vector3[] contact_normals', 'float64[] depths')}`
    + part('geometry_msgs/Wrench', 'geometry_msgs/Vector3 force', 'geometry_msgs/Vector3 torque') + VECTOR + HEADER,
};

// A comb: chains of ten joints on a common bar, made of boxes.
export function comb(joints, teeth = Math.ceil(joints / 10)) {
  const box = (size, colour) => `<geometry><box size="${size}"/></geometry><material name="${colour}"/>`;
  const out = ['<robot name="comb">', '<material name="a"><color rgba="0.3 0.5 0.7 1"/></material><material name="b"><color rgba="0.8 0.6 0.3 1"/></material>',
    `<link name="base"><visual><origin xyz="${teeth * 0.03} 0 0.02"/>${box(`${teeth * 0.06} 0.05 0.04`, 'a')}</visual></link>`];
  for (let i = 0; i < joints; i += 1) {
    const tooth = i % teeth, row = Math.floor(i / teeth);
    const parent = row === 0 ? 'base' : `link_${i - teeth}`;
    out.push(`<link name="link_${i}"><visual><origin xyz="0 0 0.03"/>${box('0.03 0.03 0.05', i % 2 ? 'a' : 'b')}</visual></link>`,
      `<joint name="joint_${i}" type="revolute"><parent link="${parent}"/><child link="link_${i}"/><origin xyz="${row === 0 ? `${tooth * 0.06 + 0.03} 0 0.04` : '0 0 0.06'}"/>`,
      '<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="5" velocity="2"/></joint>');
  }
  return [...out, '</robot>'].join('\n');
}

export class Stub {
  joints = [];
  status = { sim_time: 0, wall_time: 0, steps: 0n, real_time_factor: 1, paused: false, speed: 1, lateness_p50: 1e-5, lateness_p99: 2e-4, lateness_max: 1e-3,
    time_control: 40, time_physics: 300, time_publish: 20, time_bus: 10, time_idle: 630, overruns: 3n, skipped: 0n, divergence: '', real_hardware: [] };
  positions = new Map();
  #server = new protocol.FoxgloveServer({ name: 'stub', capabilities: ['clientPublish'], supportedEncodings: ['cdr'] });
  #channels = new Map();
  #latched = new Map();
  #timers = [];

  constructor(urdf) {
    this.joints = [...urdf.matchAll(/<joint name="([^"]+)"/g)].map((m) => m[1]);
    for (const name of this.joints) this.positions.set(name, 0);
    this.topic('/robot_description', 'std_msgs/msg/String');
    this.topic('/joint_states', 'sensor_msgs/msg/JointState');
    this.topic('/tf', 'tf2_msgs/msg/TFMessage');
    this.topic('/doppel/status', 'doppel_msgs/msg/TwinStatus');
    this.topic('/doppel/joint_loads', 'doppel_msgs/msg/JointLoads');
    this.topic('/gazebo/contacts', 'gazebo_msgs/msg/ContactsState');
    this.topic('/joint_command', 'sensor_msgs/msg/JointState');
    this.publish('/robot_description', { data: urdf }, true);
    this.tell({});
    this.#server.on('subscribe', (id) => {
      const payload = this.#latched.get(id);
      if (payload) this.#server.sendMessage(id, 0n, payload);
    });
    const reader = new MessageReader(parse(SCHEMAS['sensor_msgs/msg/JointState'], { ros2: true }));
    this.#server.on('message', ({ channel, data }) => {
      if (channel.topic !== '/joint_command') return;
      const { name, position } = reader.readMessage(data);
      name.forEach((one, i) => this.positions.set(one, position[i]));
    });
  }

  topic(name, type) {
    const id = this.#server.addChannel({ topic: name, encoding: 'cdr', schemaName: type, schema: SCHEMAS[type], schemaEncoding: 'ros2msg' });
    this.#channels.set(name, { id, writer: new MessageWriter(parse(SCHEMAS[type], { ros2: true })) });
  }

  publish(topic, message, latched = false) {
    const { id, writer } = this.#channels.get(topic);
    const payload = writer.writeMessage(message);
    if (latched) this.#latched.set(id, payload);
    this.#server.sendMessage(id, 0n, payload);
  }

  // Changes the status and publishes it.
  tell(change) {
    Object.assign(this.status, change);
    this.publish('/doppel/status', this.status, true);
  }

  #header() {
    return { stamp: { sec: Math.floor(this.status.sim_time), nanosec: 0 }, frame_id: 'world' };
  }

  #step(dt) {
    if (!this.status.paused) this.status.sim_time += dt;
    const name = this.joints, position = name.map((one) => this.positions.get(one)), none = name.map(() => 0);
    this.publish('/joint_states', { header: this.#header(), name, position, velocity: none, effort: none });
    this.publish('/tf', { transforms: name.map((one, i) => ({ header: this.#header(), child_frame_id: `link_${i}`,
      transform: { translation: { x: 0, y: 0, z: 0.06 }, rotation: { x: Math.sin(position[i] / 2), y: 0, z: 0, w: Math.cos(position[i] / 2) } } })) });
  }

  #loads() {
    const column = (value) => this.joints.map((_, i) => value(i));
    this.publish('/doppel/joint_loads', { header: this.#header(), joint_names: this.joints, efforts: column((i) => (i % 5) - 2), gravity_torques: column((i) => (i % 7) - 1),
      sags: column(() => 0.002), margins: column((i) => 5 - Math.abs((i % 7) - 1)), effort_limits: column(() => 5) });
  }

  async start(port) {
    this.http = createServer((request, response) => {
      const path = normalize(new URL(request.url, 'http://x').pathname);
      const file = join(dist, path === '/' ? 'index.html' : path);
      readFile(file).then((bytes) => response.writeHead(200, { 'content-type': TYPES[extname(file)] ?? 'application/octet-stream', 'content-security-policy': POLICY }).end(bytes),
        () => response.writeHead(404).end());
    });
    const sockets = new WebSocketServer({ server: this.http, handleProtocols: (offered) => this.#server.handleProtocols(offered) });
    sockets.on('connection', (socket, request) => this.#server.handleConnection(socket, request.socket.remoteAddress));
    await new Promise((done) => this.http.listen(port, '127.0.0.1', done));
    this.#timers = [setInterval(() => this.#step(1 / 60), 1000 / 60), setInterval(() => this.tell({}), 250), setInterval(() => this.#loads(), 200)];
    this.sockets = sockets;
    return `http://127.0.0.1:${this.http.address().port}/`;
  }

  stop() {
    for (const timer of this.#timers) clearInterval(timer);
    for (const socket of this.sockets.clients) socket.terminate();
    this.http.close();
  }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const option = (name, otherwise) => {
    const at = process.argv.indexOf(`--${name}`);
    return at < 0 ? otherwise : Number(process.argv[at + 1]);
  };
  console.log(await new Stub(comb(option('joints', 1000))).start(option('port', 8791)));
}
