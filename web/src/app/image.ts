// Pixels of sensor_msgs/Image for the browser. Depths are drawn dark for near and light for far.
import type { Message } from '../protocol/cdr';

export interface Picture {
  width: number;
  height: number;
  rgba: Uint8ClampedArray;
  note: string; // the range of a depth, or the reason why nothing is shown
}

const MOST = 64_000_000; // pixels

type Put = (from: Uint8Array, at: number, to: Uint8ClampedArray, o: number) => void;

const COLOURS: Record<string, [number, Put]> = { // bytes of a pixel
  rgb8: [3, (f, i, t, o) => t.set([f[i]!, f[i + 1]!, f[i + 2]!, 255], o)],
  bgr8: [3, (f, i, t, o) => t.set([f[i + 2]!, f[i + 1]!, f[i]!, 255], o)],
  rgba8: [4, (f, i, t, o) => t.set([f[i]!, f[i + 1]!, f[i + 2]!, f[i + 3]!], o)],
  bgra8: [4, (f, i, t, o) => t.set([f[i + 2]!, f[i + 1]!, f[i]!, f[i + 3]!], o)],
  mono8: [1, (f, i, t, o) => t.set([f[i]!, f[i]!, f[i]!, 255], o)],
};
const SAME: Record<string, string> = { '8UC1': 'mono8', '8UC3': 'bgr8', '8UC4': 'bgra8', mono16: '16UC1' };
const DEPTHS: Record<string, number> = { '16UC1': 2, '32FC1': 4 };

function problem(note: string): Picture {
  return { width: 0, height: 0, rgba: new Uint8ClampedArray(), note };
}

function depths(data: Uint8Array, width: number, height: number, step: number, kind: string, little: boolean): Picture {
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const size = DEPTHS[kind]!;
  const values = new Float32Array(width * height);
  let least = Infinity, most = -Infinity;
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) {
      const at = y * step + x * size;
      const value = size === 2 ? view.getUint16(at, little) || NaN : view.getFloat32(at, little); // 0: no depth
      values[y * width + x] = value;
      if (Number.isFinite(value)) {
        least = Math.min(least, value);
        most = Math.max(most, value);
      }
    }
  }
  const rgba = new Uint8ClampedArray(width * height * 4);
  const scale = most > least ? 225 / (most - least) : 0;
  values.forEach((value, i) => {
    const grey = Number.isFinite(value) ? 30 + (value - least) * scale : 0;
    rgba.set([grey, grey, grey, 255], i * 4);
  });
  const factor = kind === '16UC1' ? 0.001 : 1; // millimetres, metres
  return { width, height, rgba, note: most >= least ? `${(least * factor).toFixed(3)} … ${(most * factor).toFixed(3)} m` : 'no depths' };
}

export function pictureOf(message: Message): Picture {
  const width = Number(message['width']), height = Number(message['height']), step = Number(message['step']);
  const data = message['data'];
  const encoding = String(message['encoding']);
  const kind = SAME[encoding] ?? encoding;
  if (!(data instanceof Uint8Array)) return problem('This message contains no pixels.');
  const size = COLOURS[kind]?.[0] ?? DEPTHS[kind];
  if (size === undefined) return problem(`Images of the encoding '${encoding}' are not drawn.`);
  if (!(width > 0 && height > 0 && width * height <= MOST)) return problem(`An image of ${width} × ${height} pixels.`);
  if (step < width * size || data.length < step * (height - 1) + width * size) return problem('The image has fewer bytes than its size requires.');
  if (DEPTHS[kind]) return depths(data, width, height, step, kind, Number(message['is_bigendian']) === 0);
  const [bytes, put] = COLOURS[kind]!;
  const rgba = new Uint8ClampedArray(width * height * 4);
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) put(data, y * step + x * bytes, rgba, (y * width + x) * 4);
  }
  return { width, height, rgba, note: '' };
}

export function isImage(schema: string): boolean {
  return /^sensor_msgs\/(msg\/)?(Compressed)?Image$/.test(schema);
}

// Draws either type of image; returns the line below it.
export async function drawImage(message: Message, canvas: HTMLCanvasElement): Promise<string> {
  const context = canvas.getContext('2d')!;
  if (message['encoding'] !== undefined) {
    const picture = pictureOf(message);
    if (picture.width === 0) return picture.note;
    [canvas.width, canvas.height] = [picture.width, picture.height];
    context.putImageData(new ImageData(picture.rgba, picture.width, picture.height), 0, 0);
    return [`${picture.width} × ${picture.height}`, String(message['encoding']), picture.note].filter(Boolean).join(', ');
  }
  const format = String(message['format']);
  const data = message['data'] as Uint8Array;
  try {
    const bitmap = await createImageBitmap(new Blob([(/compressedDepth/.test(format) ? data.subarray(12) : data) as BlobPart])); // 12: the header of a compressed depth
    [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
    context.drawImage(bitmap, 0, 0);
    bitmap.close();
    return `${canvas.width} × ${canvas.height}, ${format}, ${(data.length / 1024).toFixed(0)} KiB`;
  } catch {
    return `The browser cannot read this image of the format '${format}'.`;
  }
}
