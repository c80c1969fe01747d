// Message types from "ros2msg" text: the definition, then the definitions that it uses, each after a line of '=' and
// "MSG: package/Name". Fields have the shape that the Foxglove reader and writer of CDR use. Own code, because
// @foxglove/rosmsg includes the grammar of ROS 1: 12.9 KiB compressed against 1.0 KiB here, 7 % of what the page loads
// before its first picture (npm run bench:protocol). The tests compare the two on every type of the program.

import type { MessageDefinitionField } from '@foxglove/message-definition';

// Primitive types by their names in a schema; rosidl defines 'byte' and 'char' as 8-bit numbers.
const PRIMITIVES = new Map<string, string>([
  ['byte', 'uint8'], ['char', 'uint8'],
  ...['bool', 'int8', 'uint8', 'int16', 'uint16', 'int32', 'uint32', 'int64', 'uint64', 'float32', 'float64', 'string', 'wstring']
    .map((name): [string, string] => [name, name]),
]);

export interface Field extends MessageDefinitionField {
  message: MessageType | null; // null: a primitive
}

export interface Constant {
  name: string;
  type: string;
  value: string;
}

export interface MessageType {
  name: string;
  fields: Field[];
  constants: Constant[];
}

export class SchemaError extends Error {}

// "sensor_msgs/JointState" and "sensor_msgs/msg/JointState" are one type.
export function shortName(name: string): string {
  return name.replace(/\/(msg|srv|action)\//, '/');
}

const CONSTANT = /^(\S+)\s+([A-Z][A-Z0-9_]*)\s*=\s*(.*)$/;
const FIELD = /^([A-Za-z][\w/]*)(<=\d+)?(\[(<=)?(\d*)\])?\s+([A-Za-z]\w*)(?:\s+(.*))?$/;

export function parseSchema(name: string, text: string): Map<string, MessageType> {
  const types = new Map<string, MessageType>();
  const sections: { name: string; lines: string[] }[] = [{ name, lines: [] }];
  let afterRule = false;
  for (const raw of text.split('\n')) {
    const line = raw.trim();
    if (/^={5,}$/.test(line)) {
      afterRule = true;
    } else if (afterRule && line.startsWith('MSG:')) {
      sections.push({ name: line.slice(4).trim(), lines: [] });
      afterRule = false;
    } else {
      sections[sections.length - 1]!.lines.push(line);
    }
  }
  for (const section of sections) {
    types.set(shortName(section.name), { name: section.name, fields: [], constants: [] });
  }
  for (const section of sections) {
    const type = types.get(shortName(section.name))!;
    for (const line of section.lines) readLine(line, type, types);
  }
  return types;
}

function readLine(raw: string, type: MessageType, types: Map<string, MessageType>): void {
  if (raw === '' || raw.startsWith('#')) return;
  const constant = CONSTANT.exec(raw);
  if (constant) {
    const [, typeName, name, value] = constant as unknown as [string, string, string, string];
    type.constants.push({ type: PRIMITIVES.get(typeName) ?? typeName, name, value: typeName.startsWith('string') ? value : value.replace(/\s*#.*$/, '') });
    return;
  }
  const field = FIELD.exec(raw.replace(/\s*#.*$/, ''));
  if (!field) throw new SchemaError(`'${raw}' in ${type.name} is not a field`);
  const primitive = PRIMITIVES.get(field[1]!);
  const message = primitive ? null : resolve(field[1]!, type.name, types);
  const isArray = field[3] !== undefined;
  const size = field[5];
  type.fields.push({
    name: field[6]!,
    type: primitive ?? message!.name,
    message,
    isComplex: message !== null,
    isArray,
    arrayLength: field[4] === undefined && size ? Number(size) : undefined,
    defaultValue: primitive && !isArray && field[7] !== undefined ? literal(primitive, field[7].trim()) : undefined,
  });
}

function literal(type: string, text: string): string | number | bigint | boolean {
  if (type === 'bool') return /^(true|1)$/i.test(text);
  if (type === 'string' || type === 'wstring') return text.replace(/^(['"])(.*)\1$/, '$2');
  return type === 'int64' || type === 'uint64' ? BigInt(text) : Number(text);
}

function resolve(name: string, within: string, types: Map<string, MessageType>): MessageType {
  const own = within.split('/')[0]!;
  for (const candidate of [shortName(name), `${own}/${name}`, name === 'Header' ? 'std_msgs/Header' : name]) {
    const found = types.get(candidate);
    if (found) return found;
  }
  const builtin = /^(?:builtin_interfaces\/(?:msg\/)?)?(?:([Tt]ime)|[Dd]uration)$/.exec(name);
  if (!builtin) throw new SchemaError(`${within} uses '${name}', which its schema does not define`);
  const made = `builtin_interfaces/${builtin[1] ? 'Time' : 'Duration'}`;
  return types.get(made) ?? parseSchema(made, 'int32 sec\nuint32 nanosec').get(made)!;
}
