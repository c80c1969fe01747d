// Several messages in one WebSocket frame: doppel's server sends them to a client whose address asks for it, the others
// ignore that. A browser handles each frame as an event of its own, and an arm at rest publishes some 400 messages a second.
export const BUNDLE_PERIOD = 16; // ms that messages wait for others of the same bundle

const OPCODE = 0x80; // not used by the Foxglove protocol
const LENGTH_BYTES = 4;

// The frames of a bundle; null: it is none.
export function framesOf(data: unknown): Uint8Array[] | null {
  if (!(data instanceof ArrayBuffer) && !ArrayBuffer.isView(data)) return null;
  const bytes = data instanceof ArrayBuffer ? new Uint8Array(data) : new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
  if (bytes[0] !== OPCODE) return null;
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const out: Uint8Array[] = [];
  for (let at = 1; at < bytes.length;) {
    const length = at + LENGTH_BYTES <= bytes.length ? view.getUint32(at, true) : Infinity;
    at += LENGTH_BYTES;
    if (at + length > bytes.length) throw new Error('a bundle of messages ends too early');
    out.push(bytes.subarray(at, at + length));
    at += length;
  }
  return out;
}
