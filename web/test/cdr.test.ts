import assert from 'node:assert/strict';
import { test } from 'node:test';
import { parse } from '@foxglove/rosmsg';
import { MessageWriter } from '@foxglove/rosmsg2-serialization';
import { blank, CdrError, readCdr, writeCdr, type Message } from '../src/protocol/cdr';
import { BUILTIN } from '../src/protocol/builtin';
import { parseSchema, shortName, SchemaError } from '../src/protocol/schema';
import { sameTypes } from './same_types';

const view = (bytes: Uint8Array): DataView => new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
const typeOf = (name: string, text: string) => parseSchema(name, text).get(shortName(name))!;

test('a schema has fields, lists, arrays, constants, defaults and nested types', () => {
  const type = typeOf('a_msgs/msg/A', [
    'uint8 LOW=1 # why', 'string WORD=some text # kept', '# a comment', 'int32 x 5', 'float64[9] k', 'string<=10[] names',
    'a_msgs/B[<=4] bs', 'Inner inner # same package', '='.repeat(80), 'MSG: a_msgs/B', 'bool on true', '='.repeat(80),
    'MSG: a_msgs/Inner', 'builtin_interfaces/Time stamp',
  ].join('\n'));
  assert.deepEqual(type.constants.map((c) => [c.name, c.value]), [['LOW', '1'], ['WORD', 'some text # kept']]);
  assert.deepEqual(type.fields.map((f) => [f.name, f.isArray, f.arrayLength]), [
    ['x', false, undefined], ['k', true, 9], ['names', true, undefined], ['bs', true, undefined], ['inner', false, undefined],
  ]);
  assert.equal(type.fields[3]!.message!.fields[0]!.defaultValue, true);
  assert.equal(type.fields[4]!.message!.fields[0]!.message!.name, 'builtin_interfaces/Time');
});

test('a schema means what it means to the Foxglove parser', () => {
  const made = ['byte a', 'char b', 'uint8 LOW=1', 'string<=5[<=3] c', 'int64 d -5', "string e 'it'", 'bool f true', 'float32[4] g', 'builtin_interfaces/Time h', 'builtin_interfaces/Duration[2] i'].join('\n');
  for (const [name, text] of [...Object.entries(BUILTIN), ['a/msg/A', made] as const]) sameTypes(name, text, parse(text, { ros2: true }));
});

test('what a schema does not define is refused by name', () => {
  assert.throws(() => parseSchema('a/msg/A', 'b/Gone x'), (e: Error) => e instanceof SchemaError && /b\/Gone/.test(e.message));
});

test('CDR bytes are those of ROS 2', () => {
  const type = typeOf('a/msg/A', 'uint8 a\nfloat64 b\nstring c\nuint16[] d\n');
  const bytes = writeCdr(type, { a: 7, b: 1.5, c: 'hi', d: [1, 2] });
  assert.equal(Buffer.from(bytes).toString('hex'),
    '00010000' + '07' + '00'.repeat(7) + '000000000000f83f' + '03000000' + '686900' + '00' + '02000000' + '0100' + '0200');
  assert.deepEqual(readCdr(type, view(bytes)), { a: 7, b: 1.5, c: 'hi', d: Uint16Array.of(1, 2) });
});

test('a big-endian message is read', () => {
  const type = typeOf('a/msg/A', 'int32 a\n');
  assert.deepEqual(readCdr(type, view(Uint8Array.of(0, 0, 0, 0, 0, 0, 1, 2))), { a: 258 });
});

test('every primitive comes back as it was', () => {
  const type = typeOf('a/msg/A', ['bool', 'byte', 'char', 'int8', 'uint8', 'int16', 'uint16', 'int32', 'uint32', 'int64', 'uint64', 'float32', 'float64', 'string']
    .map((name) => `${name} f_${name}`).join('\n'));
  const message: Message = {
    f_bool: true, f_byte: 200, f_char: 65, f_int8: -5, f_uint8: 250, f_int16: -30000, f_uint16: 60000, f_int32: -2e9,
    f_uint32: 4e9, f_int64: -9007199254740993n, f_uint64: 12n, f_float32: 0.5, f_float64: Math.PI, f_string: 'Größe 🤖',
  };
  assert.deepEqual(readCdr(type, view(writeCdr(type, message))), message);
});

test('an empty message is one byte, a trajectory is what the program sends', () => {
  const empty = typeOf('std_srvs/srv/Empty_Request', '');
  assert.equal(writeCdr(empty, {}).length, 5);
  assert.deepEqual(readCdr(empty, view(writeCdr(empty, {}))), {});
  const type = typeOf('trajectory_msgs/msg/JointTrajectory', BUILTIN['trajectory_msgs/msg/JointTrajectory']!);
  const message = { joint_names: ['Revolute 1'], points: [{ positions: [1], time_from_start: { sec: 1, nanosec: 5 } }] };
  const back = readCdr(type, view(writeCdr(type, message)));
  assert.deepEqual(back['joint_names'], ['Revolute 1']);
  const [point] = back['points'] as Message[];
  assert.deepEqual(point!['positions'], Float64Array.of(1));
  assert.deepEqual(point!['time_from_start'], { sec: 1, nanosec: 5 });
});

test('a message of any size is written whole', () => {
  const type = typeOf('a/msg/A', 'string[] a\nfloat64[] b\nint8[] c\n');
  for (let size = 0; size < 400; size += 1) {
    const message = { a: ['x'.repeat(size), 'name'], b: Float64Array.of(1, 2), c: Int8Array.of(3) };
    assert.deepEqual(readCdr(type, view(writeCdr(type, message))), message, `${size}`);
  }
  const names = { a: ['', 'é', 'joint_1', 'ü'.repeat(60), 'x'.repeat(47), 'x'.repeat(48)], b: new Float64Array(), c: new Int8Array() };
  assert.deepEqual(readCdr(type, view(writeCdr(type, names))), names);
});

test('hostile messages are refused, not believed', () => {
  const type = typeOf('a/msg/A', 'float64[] a\nstring b\n');
  assert.throws(() => readCdr(type, view(Uint8Array.of(0, 1, 0))), CdrError);
  assert.throws(() => readCdr(type, view(Uint8Array.of(0, 1, 0, 0, 255, 255, 255, 255))), CdrError);
  const good = writeCdr(type, { a: [1, 2, 3], b: 'text' });
  for (let size = 0; size < good.length; size += 1) {
    assert.throws(() => readCdr(type, view(good.slice(0, size))), CdrError, `${size} bytes`);
  }
});

test('what a field cannot hold is refused by name; lists of numbers of any kind are written', () => {
  const type = typeOf('a/msg/A', 'float64[] a\nint64 b\nint64[] c\nint16[3] d\na/B e\na/B[] f\n' + '='.repeat(80) + '\nMSG: a/B\nstring on\n');
  const wrong: [Message, RegExp][] = [
    [{ z: 1 }, /a\/msg\/A has no field 'z'/], [{ e: { off: true } }, /a\/B has no field 'off'/], [{ f: [{}, { off: true }] }, /no field 'off'/],
    [{ a: 1 }, /'a' must be a list/], [{ a: ['x'] }, /'a' must be a number/],
  ];
  for (const [message, reason] of wrong) assert.throws(() => writeCdr(type, message), (e: Error) => e instanceof CdrError && reason.test(e.message), String(reason));
  const good = { a: Float64Array.of(1), b: 5n, c: BigInt64Array.of(-1n), d: Int16Array.of(1, 2, 0), e: { on: 'x' }, f: [{ on: '' }] };
  for (const message of [good, { ...good, a: [1], b: 5, c: [-1], d: [1, 2] }]) assert.deepEqual(readCdr(type, view(writeCdr(type, message))), good);
  assert.deepEqual(readCdr(type, view(writeCdr(type, {}))), { a: new Float64Array(), b: 0n, c: new BigInt64Array(), d: new Int16Array(3), e: { on: '' }, f: [] });
});

test('the Foxglove writer cuts texts that are not ASCII, which is why the page has its own; once this fails, that can go', () => {
  const schema = 'string name\n', type = typeOf('a/msg/A', schema);
  const theirs = new MessageWriter(parse(schema, { ros2: true })).writeMessage({ name: 'Größe' });
  assert.deepEqual(readCdr(type, view(theirs)), { name: 'Grö\0' });
  assert.deepEqual(readCdr(type, view(writeCdr(type, { name: 'Größe' }))), { name: 'Größe' });
});

test('a blank message has every field', () => {
  const type = typeOf('a/msg/A', 'int32 x 5\nfloat64[3] k\nstring s "on"\nbool b\nint8[] l\n');
  assert.deepEqual(blank(type), { x: 5, k: [0, 0, 0], s: 'on', b: false, l: [] });
});
