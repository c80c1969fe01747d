// Messages as CDR for the types of a schema: XCDR1 as in ROS 2, written in little endian, read in either byte order.
// The Foxglove library reads. Writing is own code (1.0 KiB compressed), because the library's writer takes the number
// of UTF-16 units for that of bytes and truncates every text that is not ASCII, such as the name of a joint or an
// object (@foxglove/cdr 3.5.0; a test fails once that is fixed). The library also sends zeros for a misspelt field,
// where this writer reports it.

import type { MessageDefinition } from '@foxglove/message-definition';
// Imported by file: the package's index includes its writer, 1.6 KiB compressed that are not used.
import { MessageReader } from '@foxglove/rosmsg2-serialization/dist/MessageReader';
import type { Field, MessageType } from './schema';

// A list of numbers as read; byte lists are views of the frame, not copies.
export type Numbers =
  | Int8Array | Uint8Array | Int16Array | Uint16Array | Int32Array | Uint32Array | BigInt64Array | BigUint64Array
  | Float32Array | Float64Array;
export type Value = string | number | bigint | boolean | Numbers | Value[] | { [name: string]: Value };
export type Message = { [name: string]: Value };

export class CdrError extends Error {}

export function isNumbers(value: unknown): value is Numbers {
  return ArrayBuffer.isView(value);
}

const encoder = new TextEncoder();
const SIZES: Record<string, number> = {
  bool: 1, int8: 1, uint8: 1, int16: 2, uint16: 2, int32: 4, uint32: 4, int64: 8, uint64: 8, float32: 4, float64: 8,
};
const readers = new WeakMap<MessageType, MessageReader<Message>>();

// The type itself first, then the types that it uses.
function definitionsOf(type: MessageType, known: Map<string, MessageDefinition>): Map<string, MessageDefinition> {
  known.set(type.name, { name: type.name, definitions: type.fields });
  for (const { message } of type.fields) if (message && !known.has(message.name)) definitionsOf(message, known);
  return known;
}

export function readCdr(type: MessageType, data: ArrayBufferView): Message {
  let reader = readers.get(type);
  if (!reader) {
    reader = new MessageReader([...definitionsOf(type, new Map()).values()]);
    readers.set(type, reader);
  }
  try {
    const message = reader.readMessage(data);
    if (reader.lastReadByteLength() <= data.byteLength) return message;
  } catch (problem) {
    throw new CdrError(`${type.name} cannot be read: ${(problem as Error).message}`);
  }
  throw new CdrError(`${type.name} cannot be read: it ends inside its last string`);
}

class Writer {
  private bytes = new Uint8Array(256);
  private view = new DataView(this.bytes.buffer);
  private size = 4;

  constructor() {
    this.bytes[1] = 1;
  }

  private room(align: number, size: number): number {
    const over = (this.size - 4) % align;
    const from = over === 0 ? this.size : this.size + align - over;
    if (from + size > this.bytes.length) {
      const grown = new Uint8Array(Math.max(this.bytes.length * 2, from + size));
      grown.set(this.bytes);
      this.bytes = grown;
      this.view = new DataView(grown.buffer);
    }
    this.size = from + size;
    return from;
  }

  private length(value: number): void {
    const at = this.room(4, 4); // before `view` is read: it may be replaced by this
    this.view.setUint32(at, value, true);
  }

  primitive(type: string, value: Value | undefined, name: string): void {
    if (type === 'string' || type === 'wstring') {
      const text = encoder.encode(value === undefined ? '' : String(value));
      this.length(text.length + 1);
      const at = this.room(1, text.length + 1);
      this.bytes.set(text, at);
      this.bytes[at + text.length] = 0;
      return;
    }
    const at = this.room(SIZES[type]!, SIZES[type]!);
    const { view } = this;
    if (type === 'bool') {
      view.setUint8(at, value ? 1 : 0);
      return;
    }
    if (type === 'int64' || type === 'uint64') {
      const whole = typeof value === 'bigint' ? value : BigInt(Math.trunc(Number(value ?? 0)));
      if (type === 'int64') view.setBigInt64(at, whole, true);
      else view.setBigUint64(at, whole, true);
      return;
    }
    const number = value === undefined ? 0 : Number(value);
    if (Number.isNaN(number) && typeof value !== 'number') throw new CdrError(`'${name}' must be a number`);
    switch (type) {
      case 'int8': view.setInt8(at, number); break;
      case 'int16': view.setInt16(at, number, true); break;
      case 'uint16': view.setUint16(at, number, true); break;
      case 'int32': view.setInt32(at, number, true); break;
      case 'uint32': view.setUint32(at, number, true); break;
      case 'float32': view.setFloat32(at, number, true); break;
      case 'float64': view.setFloat64(at, number, true); break;
      default: view.setUint8(at, number);
    }
  }

  message(type: MessageType, value: Value | undefined): void {
    const object = (value ?? {}) as Message;
    if (type.fields.length === 0) this.bytes[this.room(1, 1)] = 0;
    for (const name of Object.keys(object)) {
      if (!type.fields.some((field) => field.name === name)) throw new CdrError(`${type.name} has no field '${name}'`);
    }
    for (const field of type.fields) {
      if (field.isArray) this.list(field, object[field.name]);
      else this.single(field, object[field.name]);
    }
  }

  private single(field: Field, value: Value | undefined): void {
    if (field.message) this.message(field.message, value);
    else this.primitive(field.type, value ?? (field.defaultValue as Value | undefined), field.name);
  }

  private list(field: Field, value: Value | undefined): void {
    const items = value ?? [];
    if (!Array.isArray(items) && !isNumbers(items)) throw new CdrError(`'${field.name}' must be a list`);
    if (field.arrayLength === undefined) this.length(items.length);
    const count = field.arrayLength ?? items.length;
    for (let i = 0; i < count; i += 1) this.single(field, items[i]);
  }

  done(): Uint8Array {
    return this.bytes.slice(0, this.size);
  }
}

// Missing fields are zero, empty, or the default of the schema.
export function writeCdr(type: MessageType, value: Message): Uint8Array {
  const writer = new Writer();
  writer.message(type, value);
  return writer.done();
}

// A message of the type with default values, for forms.
export function blank(type: MessageType): Message {
  const one = (field: Field): Value => (field.message ? blank(field.message) : (field.defaultValue as Value | undefined) ?? zero(field));
  return Object.fromEntries(type.fields.map((field) => [
    field.name, field.isArray ? Array.from({ length: field.arrayLength ?? 0 }, () => one(field)) : one(field),
  ]));
}

function zero({ type }: Field): Value {
  return type === 'string' || type === 'wstring' ? '' : type === 'bool' ? false : 0;
}
