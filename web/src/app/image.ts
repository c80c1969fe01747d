// Pixels of images for the browser. Depths have the colours of distances.
import type { Message } from '../protocol/cdr';
import { COLOUR_MAP, colourStep, SteadyScale } from './colour_map';

export interface Picture {
  width: number;
  height: number;
  rgba: Uint8ClampedArray;
  note: string; // the range of a depth, or the reason why nothing is shown
  most: number; // m, the end of the scale of depths; 0: no depths
}

const MOST = 64_000_000; // pixels

type Put = (from: Uint8Array, at: number, to: Uint8ClampedArray, o: number) => void;

function put(to: Uint8ClampedArray, o: number, r: number, g: number, b: number, a: number): void {
  to[o] = r;
  to[o + 1] = g;
  to[o + 2] = b;
  to[o + 3] = a;
}

const COLOURS: Record<string, [number, Put]> = { // bytes of a pixel
  rgb8: [3, (f, i, t, o) => put(t, o, f[i]!, f[i + 1]!, f[i + 2]!, 255)],
  bgr8: [3, (f, i, t, o) => put(t, o, f[i + 2]!, f[i + 1]!, f[i]!, 255)],
  rgba8: [4, (f, i, t, o) => put(t, o, f[i]!, f[i + 1]!, f[i + 2]!, f[i + 3]!)],
  bgra8: [4, (f, i, t, o) => put(t, o, f[i + 2]!, f[i + 1]!, f[i]!, f[i + 3]!)],
  mono8: [1, (f, i, t, o) => put(t, o, f[i]!, f[i]!, f[i]!, 255)],
};
const SAME: Record<string, string> = { '8UC1': 'mono8', '8UC3': 'bgr8', '8UC4': 'bgra8', mono16: '16UC1' };
const DEPTHS: Record<string, [number, number]> = { '16UC1': [2, 0.001], '32FC1': [4, 1] }; // bytes, m

function problem(note: string): Picture {
  return { width: 0, height: 0, rgba: new Uint8ClampedArray(), note, most: 0 };
}

// The tools that draw images, kept from one image to the next: the memory of its pixels and the scale of its depths.
export class Pixels {
  readonly scale = new SteadyScale();
  private rgba = new Uint8ClampedArray();
  private depths = new Float32Array();

  of(width: number, height: number): Uint8ClampedArray {
    const size = width * height * 4;
    if (this.rgba.length !== size) this.rgba = new Uint8ClampedArray(size);
    return this.rgba;
  }

  depthsOf(width: number, height: number): Float32Array {
    const size = width * height;
    if (this.depths.length !== size) this.depths = new Float32Array(size);
    return this.depths;
  }
}

function depths(data: Uint8Array, width: number, height: number, step: number, kind: string, little: boolean, pixels: Pixels): Picture {
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const [size, unit] = DEPTHS[kind]!;
  const values = pixels.depthsOf(width, height);
  let least = Infinity, most = -Infinity;
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) {
      const at = y * step + x * size;
      const value = unit * (size === 2 ? view.getUint16(at, little) || NaN : view.getFloat32(at, little)); // 0: no depth
      values[y * width + x] = value;
      if (!Number.isFinite(value)) continue;
      if (value < least) least = value;
      if (value > most) most = value;
    }
  }
  const end = most >= least ? pixels.scale.take(most) : 0;
  const rgba = pixels.of(width, height);
  for (let i = 0; i < values.length; i += 1) {
    const value = values[i]!;
    const o = Number.isFinite(value) ? colourStep(value, end) * 3 : -1;
    if (o < 0) put(rgba, i * 4, 0, 0, 0, 255);
    else put(rgba, i * 4, COLOUR_MAP[o]!, COLOUR_MAP[o + 1]!, COLOUR_MAP[o + 2]!, 255);
  }
  return { width, height, rgba, note: most >= least ? `${least.toFixed(3)} … ${most.toFixed(3)} m` : 'no depths', most: end };
}

export function pictureOf(message: Message, pixels = new Pixels()): Picture {
  const width = Number(message['width']), height = Number(message['height']), step = Number(message['step']);
  const data = message['data'];
  const encoding = String(message['encoding']);
  const kind = SAME[encoding] ?? encoding;
  if (!(data instanceof Uint8Array)) return problem('This message contains no pixels.');
  const size = COLOURS[kind]?.[0] ?? DEPTHS[kind]?.[0];
  if (size === undefined) return problem(`Images of the encoding '${encoding}' are not drawn.`);
  if (!(width > 0 && height > 0 && width * height <= MOST)) return problem(`An image of ${width} × ${height} pixels.`);
  if (step < width * size || data.length < step * (height - 1) + width * size) return problem('The image has fewer bytes than its size requires.');
  if (DEPTHS[kind]) return depths(data, width, height, step, kind, Number(message['is_bigendian']) === 0, pixels);
  const [bytes, copy] = COLOURS[kind]!;
  const rgba = pixels.of(width, height);
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) copy(data, y * step + x * bytes, rgba, (y * width + x) * 4);
  }
  return { width, height, rgba, note: '', most: 0 };
}

export function isImage(schema: string): boolean {
  return /^sensor_msgs\/(msg\/)?(Compressed)?Image$/.test(schema);
}

// The bytes of a picture's file. Source: compressed_depth_image_transport, whose header has 12 bytes.
export function fileOf(message: Message): Uint8Array {
  const data = message['data'] as Uint8Array;
  return /compressedDepth/.test(String(message['format'])) ? data.subarray(12) : data;
}

// Draws images into a canvas, one at a time: while one is decoded, later ones take the place of the one that waits.
export class ImagePainter {
  readonly pixels = new Pixels();
  note = ''; // about the last one: its size and encoding, or why it is not drawn
  most = 0; // m, the end of the scale of depths; 0: no depths
  drawn = 0; // number of images
  onpainted: () => void = () => {};
  private waiting: Message | null = null;
  private busy = false;

  constructor(readonly canvas: HTMLCanvasElement) {}

  take(message: Message): void {
    this.waiting = message;
    if (!this.busy) void this.work();
  }

  // Forgets the one that waits.
  drop(): void {
    this.waiting = null;
  }

  private async work(): Promise<void> {
    this.busy = true;
    while (this.waiting) {
      const message = this.waiting;
      this.waiting = null;
      this.note = await this.paint(message);
      this.onpainted();
      await new Promise(requestAnimationFrame); // not more often than the browser shows pictures
    }
    this.busy = false;
  }

  // A canvas of the same size keeps its picture until the next one is drawn.
  private fit(width: number, height: number): CanvasRenderingContext2D {
    const { canvas } = this;
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    return canvas.getContext('2d')!;
  }

  private async paint(message: Message): Promise<string> {
    if (message['encoding'] !== undefined) {
      const picture = pictureOf(message, this.pixels);
      if (picture.width === 0) return picture.note;
      this.most = picture.most;
      this.fit(picture.width, picture.height).putImageData(new ImageData(picture.rgba, picture.width, picture.height), 0, 0);
      this.drawn += 1;
      return [`${picture.width} × ${picture.height}`, String(message['encoding']), picture.note].filter(Boolean).join(', ');
    }
    const format = String(message['format']);
    try {
      const bitmap = await createImageBitmap(new Blob([fileOf(message) as BlobPart]));
      const context = this.fit(bitmap.width, bitmap.height);
      context.drawImage(bitmap, 0, 0);
      bitmap.close();
      this.drawn += 1;
      this.most = 0;
      return `${this.canvas.width} × ${this.canvas.height}, ${/jpe?g|png/i.exec(format)?.[0] ?? format}, ${((message['data'] as Uint8Array).length / 1024).toFixed(0)} KiB`;
    } catch {
      return `The browser cannot read this image of the format '${format}'.`;
    }
  }
}
