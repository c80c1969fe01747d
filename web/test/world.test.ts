import assert from 'node:assert/strict';
import * as THREE from 'three';
import { test } from 'node:test';
import { choicesOf, listOf, listText, valueOf } from '../src/app/form';
import { inertiaText, short } from '../src/app/details';
import { pictureOf } from '../src/app/image';
import { elements, kindOf, Parameters, splitName, textOf, valueFrom } from '../src/app/parameters';
import { Recorder } from '../src/app/recorder';
import { freeName, objectProblem, objectSdf, restHeight, type ObjectSpec } from '../src/app/sdf';
import { Signal } from '../src/app/signal';
import { placeText, readSources } from '../src/app/sources';
import { Tolerances } from '../src/app/tolerances';
import { RobotFrames, TransformStore } from '../src/app/transforms';
import type { Twin } from '../src/app/twin';
import { treeOrder } from '../src/panels/tree';
import { aroundMost } from '../src/scene/objects';
import { parseSchema, type Field } from '../src/protocol/schema';
import { beside, colladaImages, gltfFiles, mtlImages, objLibraries, texturesFolder } from '../src/robot/bundle';
import { Tree } from '../src/robot/tree';
import { parseUrdf } from '../src/robot/urdf';
import { child, parseXml } from '../src/robot/xml';

const box: ObjectSpec = { name: 'box_1', shape: { kind: 'box', size: [0.1, 0.2, 0.3] }, mass: 0.5, fixed: false, colour: [1, 0.5, 0] };

test('an object is written as SDF of one link', () => {
  const root = parseXml(objectSdf(box));
  const model = child(root, 'model')!, link = child(model, 'link')!;
  assert.equal(root.name, 'sdf');
  assert.equal(child(child(link, 'inertial')!, 'mass')!.text, '0.5');
  const size = (part: string): string => child(child(child(child(link, part)!, 'geometry')!, 'box')!, 'size')!.text;
  assert.equal(size('collision'), '0.1 0.2 0.3');
  assert.equal(size('visual'), size('collision'));
  assert.equal(child(child(child(link, 'visual')!, 'material')!, 'diffuse')!.text, '1 0.5 0 1');
  assert.equal(child(model, 'static'), undefined);
  const fixed = child(parseXml(objectSdf({ ...box, fixed: true, shape: { kind: 'mesh', uri: 'package://a/<b>&".stl', scale: 0.001 } })), 'model')!;
  assert.equal(child(fixed, 'static')!.text, 'true');
  assert.equal(child(child(fixed, 'link')!, 'inertial'), undefined);
  assert.match(objectSdf({ ...box, shape: { kind: 'mesh', uri: 'a<b', scale: 1 } }), /<uri>a&#60;b<\/uri>/);
  assert.equal(restHeight(box.shape), 0.15);
  assert.equal(freeName('ball', ['ball_1', 'ball_3']), 'ball_2');
});

test('nonsense objects are reported before anything is asked', () => {
  assert.equal(objectProblem(box), '');
  assert.match(objectProblem({ ...box, name: '<x>' }), /name/);
  assert.match(objectProblem({ ...box, shape: { kind: 'ball', radius: NaN } }), /Sizes/);
  assert.match(objectProblem({ ...box, mass: 0 }), /mass/);
  assert.equal(objectProblem({ ...box, mass: NaN, fixed: true }), '');
  assert.match(objectProblem({ ...box, shape: { kind: 'mesh', uri: '', scale: 1 } }), /mesh/);
});

test('parameters: what is typed has the type of the parameter', () => {
  assert.deepEqual(splitName('/arm.constraints.Revolute 1.goal'), { node: '/arm', name: 'constraints.Revolute 1.goal' });
  assert.deepEqual([true, 3, 2.5, 'x', [1, 2], ['a'], []].map((value) => kindOf({ name: '', value })), ['bool', 'int', 'double', 'string', 'int[]', 'string[]', 'string[]']);
  assert.equal(kindOf({ name: '', value: 3, type: 'float64' }), 'double');
  assert.equal(kindOf({ name: '', value: [], type: 'float64_array' }), 'double[]');
  assert.deepEqual(valueFrom(' 0,5 ', 'double'), { value: 0.5, type: 'float64' });
  assert.deepEqual(valueFrom('[1, 2e-1]', 'double[]'), { value: [1, 0.2], type: 'float64_array' });
  assert.deepEqual(valueFrom('"a, b", c d', 'string[]'), { value: ['a, b', 'c d'] });
  for (const [text, kind] of [['1.5', 'int'], ['', 'double'], ['yes', 'bool'], ['1, x', 'int[]']] as const) assert.throws(() => valueFrom(text, kind));
  assert.deepEqual(elements(textOf(['a "b"', 'c, d'])), ['a "b"', 'c, d']);
  assert.deepEqual(elements(' [ ] '), []);
});

test('forms: ranges, long numbers, lists, constants', () => {
  assert.equal(valueOf('-7', 'int8'), -7);
  assert.equal(valueOf('18446744073709551615', 'uint64'), 18446744073709551615n);
  assert.equal(valueOf('-.inf', 'float64'), -Infinity);
  assert.ok(Number.isNaN(valueOf('nan', 'float32')));
  for (const [text, type] of [['300', 'uint8'], ['-1', 'uint64'], ['1.5', 'int32'], ['abc', 'float64'], ['', 'float64'], ['2', 'bool']]) assert.throws(() => valueOf(text!, type!), `${text} as ${type}`);
  const types = parseSchema('a/msg/B', 'uint8 LOW=0\nuint8 LEVEL_HIGH=2\nuint8 level\nint32 other\nfloat64[3] xyz\nstring[] names\nint32 ANY=4\n');
  const { fields, constants } = types.get('a/B')!;
  const field = (name: string): Field => fields.find((one) => one.name === name)!;
  assert.deepEqual(choicesOf(field('level'), constants).map((one) => one.name), ['LEVEL_HIGH']);
  assert.deepEqual(choicesOf(field('other'), constants).map((one) => one.name), ['ANY']);
  assert.deepEqual(choicesOf(field('xyz'), constants), []);
  assert.deepEqual(listOf('1, 2 ,3', field('xyz')), [1, 2, 3]);
  assert.throws(() => listOf('1, 2', field('xyz')), /3 elements/);
  assert.deepEqual(listOf(listText(['a', 'b "c"']), field('names')), ['a', 'b "c"']);
});

test('images of each encoding become pixels; broken ones a sentence', () => {
  const image = (encoding: string, data: number[], width: number, height: number, step: number, more = {}) => pictureOf({ width, height, step, encoding, is_bigendian: 0, data: Uint8Array.from(data), ...more });
  assert.deepEqual([...image('rgb8', [1, 2, 3, 4, 5, 6, 0, 0], 2, 1, 8).rgba], [1, 2, 3, 255, 4, 5, 6, 255]);
  assert.deepEqual([...image('bgr8', [1, 2, 3], 1, 1, 3).rgba], [3, 2, 1, 255]);
  assert.deepEqual([...image('rgba8', [1, 2, 3, 4], 1, 1, 4).rgba], [1, 2, 3, 4]);
  assert.deepEqual([...image('mono8', [9, 0, 7], 1, 2, 2).rgba], [9, 9, 9, 255, 7, 7, 7, 255]); // a padding byte between the rows
  const near = image('16UC1', [0xe8, 3, 0xd0, 7, 0, 0], 3, 1, 6); // 1 m, 2 m, nothing
  assert.deepEqual([near.note, near.most], ['1.000 … 2.000 m', 2]);
  assert.equal(image('16UC1', [3, 0xe8], 1, 1, 2, { is_bigendian: 1 }).note, '1.000 … 1.000 m');
  assert.match(image('yuv422', [1], 1, 1, 1).note, /yuv422/);
  assert.match(image('rgb8', [1, 2], 1, 1, 3).note, /fewer bytes/);
  assert.match(image('rgb8', [1, 2, 3], 0, 1, 3).note, /0 × 1/);
});

test('files beside a mesh are found where the mesh is', () => {
  const base = 'package://arm/meshes/v/base.dae';
  assert.equal(beside(base, 'tex.png'), 'package://arm/meshes/v/tex.png');
  assert.equal(beside(base, './../tex%20two.png'), 'package://arm/meshes/tex two.png');
  assert.equal(beside(base, 'C:\\Users\\me\\tex.png'), 'package://arm/meshes/v/tex.png');
  assert.equal(beside(base, 'file:///home/me/tex.png'), 'package://arm/meshes/v/tex.png');
  assert.equal(beside(base, 'package://other/tex.png'), 'package://other/tex.png');
  assert.equal(beside('file:///a/b/base.obj', 'base.mtl'), 'file:///a/b/base.mtl');
  assert.deepEqual(colladaImages('<image id="i"><init_from>tex.png</init_from></image><surface><init_from>i</init_from></surface><init_from><ref>two.jpg</ref></init_from>'), ['tex.png', 'two.jpg']);
  assert.deepEqual(objLibraries('# x\nmtllib my arm.mtl\nv 0 0 0\n'), ['my arm.mtl']);
  assert.deepEqual(mtlImages('newmtl a\nKd 1 1 1\n  map_Kd -s 1 1 1 wood one.png\nbump -bm 0.5 n.png\nmap_Kd wood one.png\n'), ['wood one.png', 'n.png']);
  assert.deepEqual(gltfFiles('{"buffers":[{"uri":"a.bin"},{}],"images":[{"uri":"data:image/png;base64,AA=="}]}'), ['a.bin', 'data:image/png;base64,AA==']);
});

test('places of links and joints, in the form that editors take', () => {
  const { links, joints } = readSources('{"links":{"a":{"file":"/x/arm.xacro","line":12,"column":3},"b":null},"joints":{"j":{"file":"/x/arm.xacro","line":7}}}');
  assert.equal(placeText(links.get('a')!), '/x/arm.xacro:12:3');
  assert.equal(placeText(joints.get('j')!), '/x/arm.xacro:7');
  assert.equal(links.size, 1);
  assert.equal(readSources('nothing').links.size, 0);
});

test('numbers of the details', () => {
  assert.deepEqual([0.00012345, 0.000001, 0.012345, 12.345, -2e-7, 0].map(short), ['1.23e-4', '1e-6', '0.0123', '12.3', '-2e-7', '0']);
  const inertial = { origin: { xyz: [0, 0, 0] as [number, number, number], rpy: [0, 0, 0] as [number, number, number] }, mass: 1 };
  assert.equal(inertiaText({ ...inertial, inertia: [1, 0, 0, 2, 0, 3] }), '1  2  3 kg m²');
  assert.match(inertiaText({ ...inertial, inertia: [1, 0.5, 0, 2, 0, 3] }), /\nxy 0.5  xz 0  yz 0$/);
});

test('the tree of links comes parents first, what no joint reaches last', () => {
  const tree = new Tree(parseUrdf(`<robot name="r"><link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="lost"/>
    <joint name="1" type="fixed"><parent link="base"/><child link="a"/></joint><joint name="2" type="fixed"><parent link="a"/><child link="c"/></joint>
    <joint name="3" type="revolute"><parent link="base"/><child link="b"/><dynamics damping="0.5"/></joint></robot>`));
  const names = treeOrder(tree).map(({ link, depth }) => `${depth} ${tree.links[link]}`);
  assert.deepEqual(names, ["0 base", "1 a", "2 c", "1 b", "0 lost"]);
  assert.deepEqual(tree.jointByName.get('3')!.dynamics, { damping: 0.5, friction: 0 });
});

function fakeTwin(): Twin & { simTime: number; q: Float64Array } {
  return {
    sampled: new Signal(), robotChanged: new Signal(), controllersChanged: new Signal(), simTime: 0, client: { channel: () => ({}) }, paused: false, tree: null, q: new Float64Array(2), controllers: [],
    own: (name: string) => name,
  } as unknown as Twin & { simTime: number; q: Float64Array };
}

test('bands of tolerance: the trajectory’s while it moves, the goal’s for a while after, then none', () => {
  const twin = fakeTwin();
  const values: Record<string, number> = { '/arm.constraints.j.trajectory': 0.1, '/arm.constraints.j.goal': 0.02, '/arm.constraints.goal_time': 2 };
  const tolerances = new Tolerances(twin, { number: (name: string) => values[name] ?? NaN } as unknown as Parameters);
  const state = (time: number, position: number, velocity: number): void =>
    tolerances.take('arm', { header: { stamp: { sec: Math.floor(time), nanosec: (time % 1) * 1e9 } }, joint_names: ['j'], reference: { positions: [position], velocities: [velocity] } });
  state(1, 0, 0);
  assert.ok(Number.isNaN(tolerances.tolerance('j')) && tolerances.reference('j') === 0);
  state(2, 0.5, 1);
  assert.equal(tolerances.tolerance('j'), 0.1);
  state(3, 1, 0); // the last step of the motion
  assert.equal(tolerances.tolerance('j'), 0.1);
  state(4, 1, 0);
  assert.equal(tolerances.tolerance('j'), 0.02);
  state(5.5, 1, 0);
  assert.ok(Number.isNaN(tolerances.tolerance('j')));
  state(0.5, 1, 0); // after a reset
  assert.ok(Number.isNaN(tolerances.tolerance('j')));
  assert.ok(Number.isNaN(tolerances.reference('other')));
});

test('the recorder knows where all joints were', () => {
  const twin = fakeTwin();
  const recorder = new Recorder(twin, { reference: () => NaN, tolerance: () => NaN });
  let wall = 0;
  Object.defineProperty(performance, 'now', { value: () => wall, configurable: true }); // Node 18 permits no assignment
  try {
    for (let i = 1; i <= 100; i += 1) {
      wall = i * 20;
      twin.simTime = i * 0.02;
      twin.q.set([i, -i]);
      twin.sampled.emit();
    }
  } finally {
    delete (performance as { now?: unknown }).now;
  }
  assert.deepEqual([...recorder.positionsAt(1)!], [50, -50]);
  assert.deepEqual([...recorder.positionsAt(2)!], [100, -100]);
  assert.equal(recorder.positionsAt(2.5), null);
  assert.equal(recorder.positionsAt(-1), null);
});

test('a parameter that a node refuses says why; values follow those that change', async () => {
  const client = { onparameters: (_: unknown[]) => {}, setParameter: () => Promise.reject(new Error('out of range')), getParameters: () => Promise.resolve([]), watchParameters: () => {}, call: () => Promise.reject(new Error('no such service')) };
  const parameters = new Parameters(client as never);
  client.onparameters([{ name: '/a.b', value: 1 }, { name: '/a.c', value: 'x' }]);
  assert.equal(parameters.number('/a.b'), 1);
  assert.ok(Number.isNaN(parameters.number('/a.c')));
  client.onparameters([{ name: '/a.b' }]);
  assert.equal(parameters.values.has('/a.b'), false);
  await assert.rejects(parameters.set('/a.c', 'y', 'string'), /out of range/);
  await assert.rejects(parameters.set('/a.c', 'y', 'int'), /not a number/);
  assert.equal((await parameters.describe('/a')).size, 0);
});

test('an image of a model of Gazebo may be in its folder of textures', () => {
  assert.equal(texturesFolder('model://suv/meshes/suv.obj', 'suv.png'), 'model://suv/materials/textures/suv.png');
  assert.equal(texturesFolder('file:///m/suv/meshes/suv.dae', 'C:\\art\\suv%20a.png'), 'file:///m/suv/materials/textures/suv a.png');
});

test('an object that falls away does not decide about the picture', () => {
  const cube = (x: number, z: number): THREE.Box3 => new THREE.Box3(new THREE.Vector3(x, 0, z), new THREE.Vector3(x + 1, 1, z + 1));
  const box = aroundMost([cube(0, 0), cube(3, 0), cube(6, 0), cube(2, -5000)]);
  assert.deepEqual([box.min.x, box.max.x, box.min.z], [0, 7, 0]);
  assert.equal(aroundMost([cube(0, 0), cube(500, 0)]).max.x, 501);
  assert.ok(aroundMost([]).isEmpty());
});

test('a robot in a namespace has the frames below it, and those of its own tree', () => {
  const all = new TransformStore();
  const handlers = new Map<string, (m: unknown) => void>();
  const client = { subscribe: (topic: string, handler: (m: unknown) => void) => (handlers.set(topic, handler), () => handlers.delete(topic)) };
  const frames = new RobotFrames(client as never, all, '/left');
  const put = (child: string, x: number, parent = 'world'): void =>
    all.put({ parent, child, still: true, pose: Float64Array.of(x, 0, 0, 0, 0, 0, 1), at: 0, stamp: 0, rate: 0 });
  put('base', 1);
  put('left/base', 2);
  assert.equal(frames.linkOf('base'), null);
  assert.equal(frames.linkOf('left/base'), 'base');
  assert.equal(frames.toWorld('base')![0], 2);
  assert.equal(new RobotFrames(client as never, all, '').toWorld('base')![0], 1);
  const end = frames.listen(() => {});
  const header = { frame_id: 'world', stamp: { sec: 0, nanosec: 0 } }, rotation = { x: 0, y: 0, z: 0, w: 1 };
  handlers.get('/left/tf')!({ transforms: [{ header, child_frame_id: 'base', transform: { translation: { x: 3, y: 0, z: 0 }, rotation } }] });
  assert.equal(frames.toWorld('base')![0], 3);
  put('left/world', 10); // where the robot's own root is among all robots
  assert.equal(frames.toWorld('base')![0], 13);
  end();
  assert.equal(handlers.size, 0);
});
