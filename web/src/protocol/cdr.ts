// CDR as ROS 2 writes it (XCDR1, little endian when written, either when read) over the types of a schema.

import type { Field, MessageType, Primitive } from './schema';

export type Value = string | number | bigint | boolean | Uint8Array | Value[] | { [name: string]: Value };
export type Message = { [name: string]: Value };

export class CdrError extends Error {}

const SHORT = 48; // bytes up to which a name is read faster by hand than by the decoder
const decoder = new TextDecoder();
const encoder = new TextEncoder();
const SIZES: Record<Primitive, number> = {
  bool: 1, byte: 1, char: 1, int8: 1, uint8: 1, int16: 2, uint16: 2, int32: 4, uint32: 4, int64: 8, uint64: 8,
  float32: 4, float64: 8, string: 4, wstring: 4,
};

class Reader {
  private at = 4;
  readonly little: boolean;

  constructor(private readonly view: DataView) {
    if (view.byteLength < 4) throw new CdrError('the message is shorter than its head');
    this.little = (view.getUint8(1) & 1) === 1;
  }

  private take(size: number): number {
    const over = (this.at - 4) % size;
    const from = over === 0 ? this.at : this.at + size - over;
    if (from + size > this.view.byteLength) throw new CdrError('the message ends too early');
    this.at = from + size;
    return from;
  }

  primitive(type: Primitive): Value {
    if (type === 'string') return this.text();
    if (type === 'wstring') throw new CdrError('wstring is not supported');
    const at = this.take(SIZES[type]);
    const { view, little } = this;
    switch (type) {
      case 'bool': return view.getUint8(at) !== 0;
      case 'byte': case 'char': case 'uint8': return view.getUint8(at);
      case 'int8': return view.getInt8(at);
      case 'int16': return view.getInt16(at, little);
      case 'uint16': return view.getUint16(at, little);
      case 'int32': return view.getInt32(at, little);
      case 'uint32': return view.getUint32(at, little);
      case 'int64': return small(view.getBigInt64(at, little));
      case 'uint64': return small(view.getBigUint64(at, little));
      case 'float32': return view.getFloat32(at, little);
      case 'float64': return view.getFloat64(at, little);
    }
  }

  private text(): string {
    const size = this.view.getUint32(this.take(4), this.little);
    if (this.at + size > this.view.byteLength) throw new CdrError('a text ends too early');
    const from = this.at, end = from + Math.max(0, size - 1);
    this.at += size;
    if (size > SHORT) return decoder.decode(new Uint8Array(this.view.buffer, this.view.byteOffset + from, end - from));
    let text = '';
    for (let i = from; i < end; i += 1) {
      const code = this.view.getUint8(i);
      if (code > 127) return decoder.decode(new Uint8Array(this.view.buffer, this.view.byteOffset + from, end - from));
      text += String.fromCharCode(code);
    }
    return text;
  }

  message(type: MessageType): Message {
    const out: Message = {};
    if (type.fields.length === 0) this.take(1);
    for (const field of type.fields) out[field.name] = field.list ? this.list(field) : this.single(field);
    return out;
  }

  private single(field: Field): Value {
    return field.message ? this.message(field.message) : this.primitive(field.type!);
  }

  private list(field: Field): Value {
    const count = field.count >= 0 ? field.count : this.view.getUint32(this.take(4), this.little);
    const left = this.view.byteLength - this.at;
    const least = field.message ? 1 : SIZES[field.type!];
    if (count > 0 && count * least > left) throw new CdrError(`'${field.name}' claims more elements than there are bytes`);
    if (field.type === 'uint8' || field.type === 'byte') {
      const from = this.at;
      this.at += count;
      return new Uint8Array(this.view.buffer, this.view.byteOffset + from, count).slice();
    }
    const out: Value[] = [];
    for (let i = 0; i < count; i += 1) out.push(this.single(field));
    return out;
  }
}

function small(value: bigint): number | bigint {
  return value >= -9007199254740991n && value <= 9007199254740991n ? Number(value) : value;
}

export function readCdr(type: MessageType, view: DataView): Message {
  return new Reader(view).message(type);
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
    const at = this.room(4, 4); // before `view` is read: it may be another one after
    this.view.setUint32(at, value, true);
  }

  primitive(type: Primitive, value: Value | undefined, name: string): void {
    if (type === 'string' || type === 'wstring') {
      const text = encoder.encode(value === undefined ? '' : String(value));
      this.length(text.length + 1);
      const at = this.room(1, text.length + 1);
      this.bytes.set(text, at);
      this.bytes[at + text.length] = 0;
      return;
    }
    const at = this.room(SIZES[type], SIZES[type]);
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
    if (Number.isNaN(number) && typeof value !== 'number') throw new CdrError(`'${name}' has to be a number`);
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
      if (field.list) this.list(field, object[field.name]);
      else this.single(field, object[field.name]);
    }
  }

  private single(field: Field, value: Value | undefined): void {
    if (field.message) this.message(field.message, value);
    else this.primitive(field.type!, value ?? initialOf(field), field.name);
  }

  private list(field: Field, value: Value | undefined): void {
    const items = value === undefined ? [] : value instanceof Uint8Array ? Array.from(value) : value;
    if (!Array.isArray(items)) throw new CdrError(`'${field.name}' has to be a list`);
    if (field.count < 0) this.length(items.length);
    const count = field.count < 0 ? items.length : field.count;
    for (let i = 0; i < count; i += 1) this.single(field, items[i]);
  }

  done(): Uint8Array {
    return this.bytes.slice(0, this.size);
  }
}

function initialOf(field: Field): Value | undefined {
  if (field.initial === null) return undefined;
  const text = field.initial.trim();
  if (field.type === 'bool') return /^(true|1)$/i.test(text);
  if (field.type === 'string') return text.replace(/^(['"])(.*)\1$/, '$2');
  return Number(text);
}

// Fields that are left out are zero, empty, or what the schema says.
export function writeCdr(type: MessageType, value: Message): Uint8Array {
  const writer = new Writer();
  writer.message(type, value);
  return writer.done();
}

// A message of the type with nothing set, for forms.
export function blank(type: MessageType): Message {
  const out: Message = {};
  for (const field of type.fields) {
    if (field.list) {
      out[field.name] = field.count > 0
        ? Array.from({ length: field.count }, () => (field.message ? blank(field.message) : zero(field)))
        : [];
    } else {
      out[field.name] = field.message ? blank(field.message) : initialOf(field) ?? zero(field);
    }
  }
  return out;
}

export function zero(field: Field): Value {
  return field.type === 'string' || field.type === 'wstring' ? '' : field.type === 'bool' ? false : 0;
}
