import assert from 'node:assert/strict';
import { test } from 'node:test';
import { COLOUR_MAP, colourStep, roundAbove, SteadyScale, turbo } from '../src/app/colour_map';
import { fileOf, ImagePainter, pictureOf, Pixels } from '../src/app/image';
import { MOST_POINTS, PointBuffer } from '../src/app/points';
import { pictureTopics, readSensors, shortTopics } from '../src/app/sensors';
import { Signal } from '../src/app/signal';
import { forceOf, readTouches } from '../src/app/touches';
import { RobotFrames, TransformStore } from '../src/app/transforms';
import { anglesOf } from '../src/panels/sensor_views';
import type { Message } from '../src/protocol/cdr';
import { STRIDE, Tree } from '../src/robot/tree';
import { parseUrdf } from '../src/robot/urdf';
import { frustumLines, lensOf, rayOf } from '../src/scene/camera_views';
import { between, FramePoses, PoseHistory } from '../src/scene/frame_poses';

const FLOAT32 = 7, FLOAT64 = 8, UINT16 = 4, INT16 = 3;
const close = (a: ArrayLike<number>, b: number[], eps = 1e-5): void => {
  assert.equal(a.length, b.length);
  b.forEach((value, i) => assert.ok(Math.abs(a[i]! - value) <= eps, `${i}: ${a[i]} is not ${value}`));
};

interface Layout { step: number; rowPadding?: number; big?: boolean; fields: [name: string, offset: number, datatype: number][] }

// A cloud of these points, rows of `width`, written by DataView alone; what is between the fields is not zero.
function cloud(points: number[][], width: number, { step, rowPadding = 0, big = false, fields }: Layout): Message {
  const height = points.length / width;
  const row = width * step + rowPadding;
  const data = new Uint8Array(row * height + 5).fill(0xa5).subarray(5); // not aligned
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  points.forEach((point, i) => fields.forEach(([, offset, datatype], k) => {
    const at = Math.floor(i / width) * row + (i % width) * step + offset;
    if (datatype === FLOAT32) view.setFloat32(at, point[k]!, !big);
    else if (datatype === FLOAT64) view.setFloat64(at, point[k]!, !big);
    else if (datatype === UINT16) view.setUint16(at, point[k]!, !big);
    else view.setInt16(at, point[k]!, !big);
  }));
  return { width, height, point_step: step, row_step: row, is_bigendian: big, data, fields: fields.map(([name, offset, datatype]) => ({ name, offset, datatype, count: 1 })) };
}

const XYZ: Layout['fields'] = [['x', 0, FLOAT32], ['y', 4, FLOAT32], ['z', 8, FLOAT32]];

test('points of a cloud are read with padding after points and rows', () => {
  const buffer = new PointBuffer();
  assert.equal(buffer.readCloud(cloud([[1, 2, 2], [3, 4, 0], [0, 0, 5], [6, 0, 8]], 2, { step: 24, rowPadding: 7, fields: XYZ })), '');
  assert.equal(buffer.count, 4);
  close(buffer.positions.subarray(0, 12), [1, 2, 2, 3, 4, 0, 0, 0, 5, 6, 0, 8]);
  close(buffer.ranges.subarray(0, 4), [3, 5, 5, 10]);
  assert.deepEqual([buffer.farthest, buffer.hasIntensity], [10, false]);
});

test('points of a cloud are read in big endian, of mixed types, in any order of fields', () => {
  const fields: Layout['fields'] = [['z', 0, FLOAT64], ['intensity', 9, UINT16], ['x', 11, INT16], ['y', 13, FLOAT32]];
  for (const big of [false, true]) {
    const buffer = new PointBuffer();
    assert.equal(buffer.readCloud(cloud([[-2, 500, -1, 2], [0.25, 7, 3, -4]], 2, { step: 19, big, fields })), '');
    close(buffer.positions.subarray(0, 6), [-1, 2, -2, 3, -4, 0.25]);
    close(buffer.intensities.subarray(0, 2), [500, 7]);
    assert.deepEqual([buffer.hasIntensity, buffer.brightest], [true, 500]);
  }
});

test('points without a finite place are left out', () => {
  const buffer = new PointBuffer();
  buffer.readCloud(cloud([[NaN, 0, 0], [1, 0, 0], [Infinity, 0, 0], [0, 2, 0], [0, NaN, 0]], 5, { step: 12, fields: XYZ }));
  assert.equal(buffer.count, 2);
  close(buffer.positions.subarray(0, 6), [1, 0, 0, 0, 2, 0]);
});

test('clouds that contradict themselves are refused with the reason, and none of their points stays', () => {
  const good = cloud([[1, 0, 0], [2, 0, 0]], 2, { step: 12, fields: XYZ });
  const buffer = new PointBuffer();
  for (const [change, reason] of [
    [{ data: (good['data'] as Uint8Array).subarray(0, 23) }, /fewer bytes/],
    [{ height: 2 }, /fewer bytes/],
    [{ height: 2, row_step: 1 }, /fewer bytes/],
    [{ fields: [{ name: 'x', offset: 0, datatype: FLOAT32, count: 1 }] }, /no fields x, y and z/],
    [{ fields: (good['fields'] as Message[]).map((field) => ({ ...field, offset: 10 })) }, /no fields x, y and z/],
    [{ fields: (good['fields'] as Message[]).map((field) => ({ ...field, datatype: 99 })) }, /no fields x, y and z/],
  ] as [Message, RegExp][]) {
    assert.equal(buffer.readCloud(good), '');
    assert.match(buffer.readCloud({ ...good, ...change }), reason);
    assert.equal(buffer.count, 0);
  }
  assert.equal(buffer.readCloud({ ...good, width: 0, data: new Uint8Array() }), '');
});

test('a large cloud is thinned evenly, and its memory is used again', () => {
  const points = Array.from({ length: MOST_POINTS + 1 }, (_, i) => [i + 1, 0, 0]);
  const large = cloud(points, points.length, { step: 12, fields: XYZ });
  const buffer = new PointBuffer();
  buffer.readCloud(large);
  assert.equal(buffer.count, Math.ceil(points.length / 2));
  close(buffer.positions.subarray(0, 9), [1, 0, 0, 3, 0, 0, 5, 0, 0]);
  const { positions } = buffer;
  buffer.readCloud(cloud([[1, 0, 0]], 1, { step: 12, fields: XYZ }));
  buffer.readCloud(large);
  assert.equal(buffer.positions, positions);
});

test('a scan has its rays by the angles, and no points where nothing was hit', () => {
  const scan = {
    angle_min: -Math.PI / 2, angle_increment: Math.PI / 2, range_min: 0.5, range_max: 10,
    ranges: Float32Array.of(1, 2, 3, 4, 0.4, 11, Infinity, -Infinity, NaN), intensities: Float32Array.of(10, 20, 30, 40, 0, 0, 0, 0, 0),
  };
  const buffer = new PointBuffer();
  assert.equal(buffer.readScan(scan), '');
  close(buffer.positions.subarray(0, 3 * buffer.count), [0, -1, 0, 2, 0, 0, 0, 3, 0, -4, 0, 0]);
  close(buffer.intensities.subarray(0, 4), [10, 20, 30, 40]);
  buffer.readScan({ ...scan, intensities: new Float32Array() });
  assert.equal(buffer.hasIntensity, false);
  assert.match(buffer.readScan({ ...scan, ranges: 'none' }), /no ranges/);
});

test('colours go from blue over green to red without a jump', () => {
  const strongest = (value: number): number => turbo(value).indexOf(Math.max(...turbo(value)));
  assert.deepEqual([0.1, 0.5, 0.9].map(strongest), [2, 1, 0]);
  for (let i = 3; i < COLOUR_MAP.length; i += 1) assert.ok(Math.abs(COLOUR_MAP[i]! - COLOUR_MAP[i - 3]!) <= 6, `step ${Math.floor(i / 3)}`);
  assert.deepEqual([colourStep(-1, 5), colourStep(0, 5), colourStep(5, 5), colourStep(50, 5), colourStep(1, 0)], [0, 0, 255, 255, 0]);
});

test('a scale ends at a round number, grows at once and shrinks late', () => {
  assert.deepEqual([0.3, 1, 1.1, 2, 3, 5, 7, 10, 0.012, 0, NaN, Infinity].map(roundAbove).map((x) => +x.toPrecision(6)), [0.5, 1, 2, 2, 5, 5, 10, 10, 0.02, 0, 0, 0]);
  const scale = new SteadyScale();
  assert.equal(scale.take(3, 0), 5);
  assert.equal(scale.take(8, 10), 10);
  assert.equal(scale.take(1, 20), 10);
  assert.equal(scale.take(8, 2900), 10);
  assert.equal(scale.take(1, 5800), 10);
  assert.equal(scale.take(1, 6000), 1);
});

test('depths have the colours of distances, on the scale that is kept; no data and what is too far are black', () => {
  const floats = new DataView(new ArrayBuffer(20));
  [1, 2, Infinity, NaN, -Infinity].forEach((value, i) => floats.setFloat32(4 * i, value, true));
  const message = { width: 5, height: 1, step: 20, encoding: '32FC1', is_bigendian: 0, data: new Uint8Array(floats.buffer) };
  const pixels = new Pixels();
  pixels.scale.take(4);
  const { rgba, most, note } = pictureOf(message, pixels);
  assert.deepEqual([most, note], [5, '1.000 … 2.000 m']);
  const at = (metres: number): number[] => [...COLOUR_MAP.subarray(Math.round((metres / 5) * 255) * 3, Math.round((metres / 5) * 255) * 3 + 3), 255];
  assert.deepEqual([...rgba.subarray(0, 8)], [...at(1), ...at(2)]);
  assert.deepEqual([...rgba.subarray(8)], [0, 0, 0, 255, 0, 0, 0, 255, 0, 0, 0, 255]);
  assert.equal(pictureOf(message, pixels).rgba, rgba); // the same memory
  assert.match(pictureOf({ ...message, data: message.data.subarray(0, 19) }).note, /fewer bytes/);
  assert.match(pictureOf({ ...message, step: 19 }).note, /fewer bytes/);
});

test('the file of a compressed picture is its data, behind the header that compressed depths have', () => {
  const data = Uint8Array.from({ length: 16 }, (_, i) => i);
  assert.deepEqual([...fileOf({ format: 'rgb8; jpeg compressed bgr8', data })], [...data]);
  assert.deepEqual([...fileOf({ format: '32FC1; compressedDepth png', data })], [12, 13, 14, 15]);
});

test('while a picture is decoded, later ones replace the one that waits, and a canvas of its size is kept', async () => {
  const globals = globalThis as Record<string, unknown>;
  const decoding: { size: number; done: (bitmap: unknown) => void }[] = [];
  globals['createImageBitmap'] = (blob: Blob) => new Promise((done) => decoding.push({ size: blob.size, done }));
  globals['requestAnimationFrame'] = (done: () => void) => setTimeout(done, 0);
  const turn = (): Promise<void> => new Promise((done) => setTimeout(done, 5));
  const drawn: number[] = [];
  let widths = 0;
  const canvas = {
    height: 0, getContext: () => ({ drawImage: (bitmap: { id: number }) => drawn.push(bitmap.id) }), get width() { return widths === 0 ? 0 : 2; }, set width(_: number) { widths += 1; },
  };
  const painter = new ImagePainter(canvas as never);
  const finish = async (holds: () => boolean): Promise<void> => {
    const { size, done } = decoding.at(-1)!;
    done({ id: size, width: 2, height: 1, close: () => {} });
    for (let i = 0; i < 1000 && !holds(); ++i) await turn();
    await turn();
  };
  for (const size of [1, 2, 3]) painter.take({ format: 'jpeg', data: new Uint8Array(size) });
  assert.equal(decoding.length, 1);
  await finish(() => decoding.length > 1);
  assert.deepEqual(decoding.map(({ size }) => size), [1, 3]);
  painter.take({ format: 'jpeg', data: new Uint8Array(4) });
  painter.drop();
  await finish(() => drawn.length > 1);
  assert.deepEqual([drawn, decoding.length, painter.drawn, widths], [[1, 3], 2, 2, 1]);
});

test('of pictures that show the same the smallest topic is taken, with a name that distinguishes it', () => {
  const schemas: Record<string, string> = {
    '/c/image': 'sensor_msgs/Image', '/c/image/compressed': 'sensor_msgs/CompressedImage', '/c/depth_image': 'sensor_msgs/Image', '/c/points': 'sensor_msgs/PointCloud2',
    '/s/labels_map': 'sensor_msgs/Image', '/s/colored_map': 'sensor_msgs/Image', '/s/camera_info': 'sensor_msgs/CameraInfo', '/lone/labels_map': 'sensor_msgs/Image',
  };
  const of = (...topics: string[]): string[] => pictureTopics(topics, (topic) => schemas[topic] ?? '');
  assert.deepEqual(of('/c/image', '/c/image/compressed', '/c/depth_image', '/c/points'), ['/c/image/compressed', '/c/depth_image']);
  assert.deepEqual(of('/s/labels_map', '/s/colored_map', '/s/camera_info'), ['/s/colored_map']);
  assert.deepEqual(of('/lone/labels_map'), ['/lone/labels_map']);
  assert.deepEqual(shortTopics(['/c/image/compressed', '/c/depth_image']), ['image', 'depth_image']);
  assert.deepEqual(shortTopics(['/stereo/left/image_raw/compressed', '/stereo/right/image_raw/compressed']), ['left', 'right']);
  assert.deepEqual(shortTopics(['/camera/image_raw']), ['/camera/image_raw']);
});

test('the list of sensors has their rates and the samples left out', () => {
  const [sensor] = readSensors({ sensors: [{ name: 'r/l/s', type: 'camera', topics: ['/a'], frame: 'f', rate: 30, reached: 29.5, samples: 90n, left_out: 3n, cost: 0.001, revision: 7n, origin_frame: 'l', origin: { x: 1, y: 2, z: 3 } }] });
  assert.deepEqual(sensor, { name: 'r/l/s', type: 'camera', topics: ['/a'], frame: 'f', rate: 30, reached: 29.5, leftOut: 3, revision: '7', originFrame: 'l', origin: [1, 2, 3] });
});

test('contacts of either message have the forces on the own collision', () => {
  const force = (x: number): Message => ({ force: { x, y: 0, z: 0 }, torque: { x: 0, y: 0, z: 0 } });
  const point = { x: 1, y: 2, z: 3 };
  const [contact] = readTouches({ header: {}, contacts: [{ collision1: { name: 'finger' }, collision2: { name: 'can' }, positions: [point, point], wrenches: [{ body_1_wrench: force(3), body_2_wrench: force(-3) }, { body_1_wrench: force(4), body_2_wrench: force(-4) }] }] });
  assert.deepEqual([contact!.own, contact!.other, contact!.points.length, forceOf(contact!)], ['finger', 'can', 2, 7]);
  const [bump] = readTouches({ header: {}, states: [{ collision1_name: 'a', collision2_name: 'b', contact_positions: [point], wrenches: [force(-2)] }] });
  assert.deepEqual([bump!.own, bump!.other, forceOf(bump!)], ['a', 'b', 2]);
  assert.deepEqual(readTouches({ header: {}, contacts: [] }), []);
});

test('roll, pitch and yaw of a quaternion', () => {
  const h = Math.SQRT1_2;
  close(anglesOf({ x: h, y: 0, z: 0, w: h }), [90, 0, 0]);
  close(anglesOf({ x: 0, y: 0.5, z: 0, w: Math.sqrt(0.75) }), [0, 60, 0]);
  close(anglesOf({ x: 0, y: 0, z: -h, w: h }), [0, 0, -90]);
});

test('a frustum has the picture’s corners half a pixel beyond the centres of the outer pixels', () => {
  const info = { width: 4, height: 2, k: Float64Array.of(2, 0, 1.5, 0, 2, 0.5, 0, 0, 1), distortion_model: 'plumb_bob' };
  const lens = lensOf(info)!;
  close(rayOf(lens, -0.5, -0.5), [-1, -0.5, 1]);
  close(rayOf(lens, 3.5, 1.5), [1, 0.5, 1]);
  const lines = frustumLines(lens);
  close(lines.slice(0, 6), [0, 0, 0, -1, -0.5, 1]);
  assert.equal(lines.length % 6, 0);
  assert.equal(lensOf({ ...info, k: new Float64Array(9) }), null);
  const fisheye = lensOf({ width: 101, height: 101, k: Float64Array.of(100 / Math.PI, 0, 50, 0, 100 / Math.PI, 50, 0, 0, 1), distortion_model: 'equidistant' })!;
  close(rayOf(fisheye, 100, 50), [1, 0, 0]); // 180 degrees: a right angle to the axis
  close(rayOf(fisheye, 50, 50), [0, 0, 1]);
});

// A base that TF has at the odometry's place, and the picture at its true one.
test('a frame is where the robot truly is, and a frame of the world is not moved with it', () => {
  const all = new TransformStore();
  const put = (parent: string, child: string, x: number): void =>
    all.put({ parent, child, still: true, pose: Float64Array.of(x, 0, 0, 0, 0, 0, 1), at: 0, stamp: 0, rate: 0 });
  put('odom', 'base', 5);
  put('base', 'camera', 0.1);
  put('camera', 'camera_optical', 0.01);
  put('world', 'wall/scan', 7);
  const tree = new Tree(parseUrdf('<robot name="r"><link name="base"/><link name="camera"/><joint name="j" type="fixed"><parent link="base"/><child link="camera"/></joint></robot>'));
  const poses = new Float64Array(2 * STRIDE);
  poses.set([3, 0, 0, 0, 0, 0, 1], 0);
  poses.set([3.1, 0, 0, 0, 0, 0, 1], STRIDE);
  const client = { subscribe: () => () => {} } as never;
  const placed = new Signal<number>();
  const twin = { robots: ['', '/other'], space: '', frames: new RobotFrames(client, all, ''), tree, poses, placed, robotChanged: new Signal() };
  put('odom', 'other/base', 50);
  put('other/base', 'other/scan', 1);
  const other = { frames: new RobotFrames(client, all, '/other'), inTruth: () => Float64Array.of(0, 2, 0, 0, 0, 0, 1) };
  const frames = new FramePoses(twin as never, { get: (space: string) => (space === '/other' ? other : undefined) } as never);
  const x = (frame: string, topic = '/t'): number[] | null => {
    const pose = frames.pose(frame, topic);
    return pose && [+pose[0]!.toFixed(6), +pose[1]!.toFixed(6)];
  };
  assert.deepEqual(x('camera_optical'), [3.11, 0]);
  assert.deepEqual(x('base'), [3, 0]);
  assert.deepEqual(x('wall/scan'), [7, 0]);
  assert.deepEqual(x('world'), [0, 0]);
  assert.deepEqual(x('other/scan', '/other/t'), [51, 2]);
  assert.deepEqual(x('wall/scan', '/other/t'), [7, 0]);
  assert.deepEqual(x('world', '/other/t'), [0, 0]);
  assert.equal(x('nowhere'), null);

  // The base moves by 1 m from 1 s to 2 s, and the camera with it.
  const at = (stamp: number, topic = '/t', frame = 'camera'): number | string | null => {
    const pose = frames.poseAt(frame, topic, stamp);
    return pose === 'later' ? pose : pose && +pose[0]!.toFixed(6);
  };
  const move = (stamp: number, by: number): void => {
    poses[0] = 3 + by;
    poses[STRIDE] = 3.1 + by;
    placed.emit(stamp);
  };
  assert.equal(at(1), 3.1); // nothing is recorded before the first question
  move(1, 0);
  assert.equal(at(1.25), 'later');
  move(2, 1);
  assert.deepEqual([at(1), at(1.25), at(2), at(0.5), at(2.1)], [3.1, 3.35, 4.1, 3.1, 'later']);
  assert.equal(at(1.25, '/other/t', 'other/scan'), 51);
});

test('a frame’s poses are those at a stamp, also after time was set back', () => {
  const pose = (yaw: number): Float64Array => Float64Array.of(yaw, 0, 0, 0, 0, Math.sin(yaw / 2), Math.cos(yaw / 2));
  const middle = between(pose(0.1), pose(0.2), 0.5);
  close(middle, [...pose(0.15)], 1e-6);
  close(between(pose(0.1), pose(0.2).map((value, i) => (i < 3 ? value : -value)), 0.5), [...middle], 1e-9); // -q is the same turn
  const history = new PoseHistory();
  assert.equal(history.at(1), null);
  for (let i = 0; i <= 100; i += 1) history.add(10 + i * 0.02, pose(i));
  history.add(11.99, pose(0)); // of another publisher, too late
  assert.equal((history.at(11.99) as Float64Array)[0], 99.5);
  history.add(12, pose(7)); // more is known of the same time
  assert.equal((history.at(12) as Float64Array)[0], 7);
  history.add(0.1, pose(1));
  assert.deepEqual([history.at(11.5), (history.at(0.05) as Float64Array)[0]], ['later', 1]);
});
