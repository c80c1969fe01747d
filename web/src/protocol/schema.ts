// Message types out of "ros2msg" text: the definition, then the definitions of what it uses, each after a line of
// '=' and "MSG: package/Name".

export type Primitive =
  | 'bool' | 'byte' | 'char' | 'int8' | 'uint8' | 'int16' | 'uint16' | 'int32' | 'uint32' | 'int64' | 'uint64'
  | 'float32' | 'float64' | 'string' | 'wstring';

const PRIMITIVES = new Set<string>([
  'bool', 'byte', 'char', 'int8', 'uint8', 'int16', 'uint16', 'int32', 'uint32', 'int64', 'uint64', 'float32',
  'float64', 'string', 'wstring',
]);

export interface Field {
  name: string;
  type: Primitive | null; // null: a message
  message: MessageType | null;
  typeName: string;
  list: boolean;
  count: number; // of a fixed array; -1: any number
  initial: string | null;
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
    const text = constant[1]!.startsWith('string') ? constant[3]! : constant[3]!.replace(/\s*#.*$/, '');
    type.constants.push({ type: constant[1]!, name: constant[2]!, value: text });
    return;
  }
  const field = FIELD.exec(raw.replace(/\s*#.*$/, ''));
  if (!field) throw new SchemaError(`'${raw}' in ${type.name} is no field`);
  const typeName = field[1]!;
  const primitive = PRIMITIVES.has(typeName);
  const message = primitive ? null : resolve(typeName, type.name, types);
  const size = field[5];
  type.fields.push({
    name: field[6]!,
    type: primitive ? (typeName as Primitive) : null,
    message,
    typeName,
    list: field[3] !== undefined,
    count: field[4] === undefined && size ? Number(size) : -1,
    initial: field[7] ?? null,
  });
}

function resolve(name: string, within: string, types: Map<string, MessageType>): MessageType {
  const own = within.split('/')[0]!;
  const candidates = [shortName(name), `${own}/${name}`, name === 'Header' ? 'std_msgs/Header' : name];
  if (name === 'time' || name === 'builtin_interfaces/Time') candidates.push('builtin_interfaces/Time');
  for (const candidate of candidates) {
    const found = types.get(candidate);
    if (found) return found;
  }
  const builtin = /^(?:builtin_interfaces\/(?:msg\/)?)?(Time|Duration|time|duration)$/.exec(name);
  if (builtin) {
    const made: MessageType = { name: `builtin_interfaces/${builtin[1]}`, constants: [], fields: [] };
    for (const part of ['int32 sec', 'uint32 nanosec']) readLine(part, made, types);
    return made;
  }
  throw new SchemaError(`${within} uses '${name}', which its schema does not define`);
}
