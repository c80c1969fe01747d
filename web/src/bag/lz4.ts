// LZ4 frames (lz4_Frame_format.md and lz4_Block_format.md, version 1.6.4). Own code: the packages for it do not check
// lengths, so that a damaged chunk keeps them busy for seconds. Check sums are those of the MCAP chunk.
const MAGIC = 0x184d2204;
const BLOCK_SUM = 0x10,
  CONTENT_SIZE = 0x08,
  CONTENT_SUM = 0x04,
  DICTIONARY = 0x01; // flags
const STORED = 0x80000000; // the block is not compressed
const SHORTEST_MATCH = 4;

class Block {
  constructor(
    private readonly from: Uint8Array,
    private readonly to: Uint8Array,
  ) {}

  // A length of 15 goes on in further bytes, until one that is not 255. Returns it and the next position.
  private length(start: number, at: number, end: number): [number, number] {
    let length = start;
    if (start < 15) return [length, at];
    for (let position = at; position < end; position += 1) {
      length += this.from[position]!;
      if (this.from[position]! < 255) return [length, position + 1];
    }
    throw new Error('a length is cut off');
  }

  // Returns the end of what is written at `out`.
  read(begin: number, end: number, begunOut: number): number {
    const { from, to } = this;
    let at = begin,
      out = begunOut;
    while (at < end) {
      const token = from[at]!;
      let literals: number, match: number;
      [literals, at] = this.length(token >> 4, at + 1, end);
      if (at + literals > end || out + literals > to.length) throw new Error('it is longer than it says');
      to.set(from.subarray(at, at + literals), out);
      at += literals;
      out += literals;
      if (at === end) break; // the last sequence has no match
      if (at + 2 > end) throw new Error('an offset is cut off');
      const offset = from[at]! | (from[at + 1]! << 8);
      [match, at] = this.length(token & 15, at + 2, end);
      match += SHORTEST_MATCH;
      if (offset === 0 || offset > out || out + match > to.length) throw new Error('a match is outside of the data');
      if (offset >= match) to.copyWithin(out, out - offset, out - offset + match);
      else for (let i = 0; i < match; i += 1) to[out + i] = to[out + i - offset]!;
      out += match;
    }
    return out;
  }
}

export function unlz4(bytes: Uint8Array, size: number): Uint8Array {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  if (bytes.length < 7 || view.getUint32(0, true) !== MAGIC) throw new Error('it is no LZ4 frame');
  const flags = bytes[4]!;
  if (flags & DICTIONARY) throw new Error('it needs a dictionary');
  const to = new Uint8Array(size);
  const block = new Block(bytes, to);
  let at = 7 + (flags & CONTENT_SIZE ? 8 : 0),
    out = 0;
  for (;;) {
    if (at + 4 > bytes.length) throw new Error('it ends early');
    const head = view.getUint32(at, true);
    at += 4;
    if (head === 0) break;
    const length = head & ~STORED;
    if (at + length > bytes.length) throw new Error('it ends early');
    if (head >= STORED) {
      if (out + length > size) throw new Error('it is longer than it says');
      to.set(bytes.subarray(at, at + length), out);
      out += length;
    } else {
      out = block.read(at, at + length, out);
    }
    at += length + (flags & BLOCK_SUM ? 4 : 0);
  }
  if (flags & CONTENT_SUM && at + 4 > bytes.length) throw new Error('it ends early');
  return to.subarray(0, out);
}
