// The frames of the Foxglove WebSocket protocol, version 1 (github.com/foxglove/ws-protocol). Knows nothing of
// sockets. Numbers on the wire are little endian, times nanoseconds.

export const SUBPROTOCOL = 'foxglove.websocket.v1';

export interface ChannelOffer {
  id: number;
  topic: string;
  encoding: string;
  schemaName: string;
  schema: string;
}

export interface ServiceOffer {
  id: number;
  name: string;
  type: string;
  requestSchema: string;
  responseSchema: string;
  requestName: string;
  responseName: string;
}

export type ServerText =
  | { op: 'serverInfo'; name: string; capabilities: string[]; sessionId?: string }
  | { op: 'status'; level: number; message: string }
  | { op: 'advertise'; channels: ChannelOffer[] }
  | { op: 'unadvertise'; channelIds: number[] }
  | { op: 'advertiseServices'; services: ServiceOffer[] }
  | { op: 'unadvertiseServices'; serviceIds: number[] }
  | { op: 'serviceCallFailure'; serviceId: number; callId: number; message: string }
  | { op: 'parameterValues'; parameters: Parameter[]; id?: string }
  | { op: 'connectionGraphUpdate'; publishedTopics: Named[]; subscribedTopics: Named[]; removedTopics: string[] }
  | { op: 'other' };

export interface Named {
  name: string;
  publisherIds?: string[];
  subscriberIds?: string[];
}

export type ParameterValue = boolean | number | string | boolean[] | number[] | string[];

export interface Parameter {
  name: string; // "/node.parameter"
  value?: ParameterValue; // absent: there is none of this name
  type?: string; // "float64", "float64_array": numbers that are no whole ones by type
}

export type ServerBinary =
  | { kind: 'message'; subscription: number; stamp: bigint; payload: DataView }
  | { kind: 'time'; now: bigint }
  | { kind: 'response'; service: number; call: number; encoding: string; payload: DataView }
  | { kind: 'asset'; request: number; error: string | null; data: Uint8Array }
  | { kind: 'unknown' };

export class FrameError extends Error {}

const decoder = new TextDecoder();
const encoder = new TextEncoder();

function rest(view: DataView, from: number): DataView {
  return new DataView(view.buffer, view.byteOffset + from, view.byteLength - from);
}

function textAt(view: DataView, at: number): { text: string; end: number } {
  const size = view.getUint32(at, true);
  const end = at + 4 + size;
  if (end > view.byteLength) throw new FrameError('the frame ends too early');
  return { text: decoder.decode(new Uint8Array(view.buffer, view.byteOffset + at + 4, size)), end };
}

export function readServerBinary(bytes: ArrayBuffer): ServerBinary {
  const view = new DataView(bytes);
  try {
    switch (view.getUint8(0)) {
      case 1:
        return {
          kind: 'message',
          subscription: view.getUint32(1, true),
          stamp: view.getBigUint64(5, true),
          payload: rest(view, 13),
        };
      case 2:
        return { kind: 'time', now: view.getBigUint64(1, true) };
      case 3: {
        const { text, end } = textAt(view, 9);
        return {
          kind: 'response',
          service: view.getUint32(1, true),
          call: view.getUint32(5, true),
          encoding: text,
          payload: rest(view, end),
        };
      }
      case 4: {
        const failed = view.getUint8(5) !== 0;
        const { text, end } = textAt(view, 6);
        return {
          kind: 'asset',
          request: view.getUint32(1, true),
          error: failed ? text || 'refused' : null,
          data: new Uint8Array(bytes, end),
        };
      }
      default:
        return { kind: 'unknown' };
    }
  } catch (problem) {
    if (problem instanceof RangeError) throw new FrameError('the frame ends too early');
    throw problem;
  }
}

type Loose = Record<string, unknown>;

function serviceOffer(raw: Loose): ServiceOffer {
  const part = (key: string, old: string): [string, string] => {
    const nested = raw[key] as Loose | undefined;
    if (nested) return [String(nested['schema'] ?? ''), String(nested['schemaName'] ?? '')];
    return [String(raw[old] ?? ''), ''];
  };
  const [requestSchema, requestName] = part('request', 'requestSchema');
  const [responseSchema, responseName] = part('response', 'responseSchema');
  return {
    id: Number(raw['id']),
    name: String(raw['name']),
    type: String(raw['type']),
    requestSchema,
    responseSchema,
    requestName,
    responseName,
  };
}

export function readServerText(text: string): ServerText {
  let raw: Loose;
  try {
    raw = JSON.parse(text) as Loose;
  } catch {
    throw new FrameError('the text frame is no JSON');
  }
  switch (raw['op']) {
    case 'advertiseServices':
      return { op: 'advertiseServices', services: ((raw['services'] ?? []) as Loose[]).map(serviceOffer) };
    case 'connectionGraphUpdate':
      return {
        op: 'connectionGraphUpdate',
        publishedTopics: (raw['publishedTopics'] ?? []) as Named[],
        subscribedTopics: (raw['subscribedTopics'] ?? []) as Named[],
        removedTopics: (raw['removedTopics'] ?? []) as string[],
      };
    case 'parameterValues':
      return { op: 'parameterValues', parameters: (raw['parameters'] ?? []) as Parameter[], id: raw['id'] as string | undefined };
    case 'serverInfo':
    case 'status':
    case 'advertise':
    case 'unadvertise':
    case 'unadvertiseServices':
    case 'serviceCallFailure':
      return raw as unknown as ServerText;
    default:
      return { op: 'other' };
  }
}

export function messageFrame(channel: number, payload: Uint8Array): Uint8Array {
  const frame = new Uint8Array(5 + payload.length);
  frame[0] = 1;
  new DataView(frame.buffer).setUint32(1, channel, true);
  frame.set(payload, 5);
  return frame;
}

export function callFrame(service: number, call: number, payload: Uint8Array, encoding = 'cdr'): Uint8Array {
  const name = encoder.encode(encoding);
  const frame = new Uint8Array(13 + name.length + payload.length);
  const view = new DataView(frame.buffer);
  frame[0] = 2;
  view.setUint32(1, service, true);
  view.setUint32(5, call, true);
  view.setUint32(9, name.length, true);
  frame.set(name, 13);
  frame.set(payload, 13 + name.length);
  return frame;
}
