// Points of PointCloud2 and LaserScan in the axes of their frame, in memory that is used again.
import { isNumbers, type Message } from '../protocol/cdr';

export const MOST_POINTS = 200_000; // of more, every second, third ... is read

interface Field {
  offset: number;
  read: (at: number) => number;
}

// sensor_msgs/PointField: bytes and reader of each datatype.
const TYPES: Record<number, [number, (view: DataView, at: number, little: boolean) => number]> = {
  1: [1, (v, at) => v.getInt8(at)],
  2: [1, (v, at) => v.getUint8(at)],
  3: [2, (v, at, little) => v.getInt16(at, little)],
  4: [2, (v, at, little) => v.getUint16(at, little)],
  5: [4, (v, at, little) => v.getInt32(at, little)],
  6: [4, (v, at, little) => v.getUint32(at, little)],
  7: [4, (v, at, little) => v.getFloat32(at, little)],
  8: [8, (v, at, little) => v.getFloat64(at, little)],
};

export class PointBuffer {
  count = 0;
  positions = new Float32Array(0); // m, x y z of each
  ranges = new Float32Array(0); // m, from the frame's origin
  intensities = new Float32Array(0);
  hasIntensity = false;
  farthest = 0; // m
  brightest = 0;

  clear(): void {
    this.count = 0;
    this.farthest = this.brightest = 0;
    this.hasIntensity = false;
  }

  private begin(size: number): void {
    this.clear();
    if (this.ranges.length >= size) return;
    const room = Math.max(size, 2 * this.ranges.length, 1024);
    this.positions = new Float32Array(3 * room);
    this.ranges = new Float32Array(room);
    this.intensities = new Float32Array(room);
  }

  private add(x: number, y: number, z: number, range: number, intensity: number): void {
    const i = this.count;
    this.count += 1;
    this.positions[3 * i] = x;
    this.positions[3 * i + 1] = y;
    this.positions[3 * i + 2] = z;
    this.ranges[i] = range;
    this.intensities[i] = intensity;
    if (range > this.farthest) this.farthest = range;
    if (intensity > this.brightest) this.brightest = intensity;
  }

  // Returns why the message cannot be read; '': it is read. Points that are not finite are left out. `scalar`: the field
  // that becomes the intensities.
  readCloud(message: Message, scalar = 'intensity'): string {
    this.clear();
    const [width, height, step, row] = ['width', 'height', 'point_step', 'row_step'].map((name) => Number(message[name])) as [number, number, number, number];
    const data = message['data'];
    if (!(data instanceof Uint8Array)) return 'The cloud has no data.';
    const total = width * height;
    if (total === 0) return '';
    if (data.length < row * (height - 1) + width * step || (height > 1 && row < width * step)) return 'The cloud has fewer bytes than its size requires.';
    const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
    const little = message['is_bigendian'] !== true;
    const fields = new Map<string, Field>();
    for (const raw of message['fields'] as Message[]) {
      const type = TYPES[Number(raw['datatype'])];
      const offset = Number(raw['offset']);
      if (type && offset + type[0] <= step) fields.set(String(raw['name']), { offset, read: (at) => type[1](view, at, little) });
    }
    const [fx, fy, fz, fi] = ['x', 'y', 'z', scalar].map((name) => fields.get(name));
    if (!fx || !fy || !fz) return 'The cloud has no fields x, y and z.';
    const every = Math.ceil(total / MOST_POINTS);
    this.begin(Math.ceil(total / every));
    for (let i = 0; i < total; i += every) {
      const at = Math.floor(i / width) * row + (i % width) * step;
      const x = fx.read(at + fx.offset), y = fy.read(at + fy.offset), z = fz.read(at + fz.offset);
      const range = Math.sqrt(x * x + y * y + z * z);
      if (Number.isFinite(range)) this.add(x, y, z, range, fi ? fi.read(at + fi.offset) : 0);
    }
    this.hasIntensity = fi !== undefined;
    return '';
  }

  // Ranges outside of [range_min, range_max] are no measurements (REP 117).
  readScan(message: Message): string {
    this.clear();
    const { ranges, intensities } = message;
    if (!isNumbers(ranges)) return 'The scan has no ranges.';
    const [angle, increment, least, most] = ['angle_min', 'angle_increment', 'range_min', 'range_max'].map((name) => Number(message[name])) as [number, number, number, number];
    const bright = isNumbers(intensities) && intensities.length === ranges.length ? intensities : null;
    this.begin(ranges.length);
    for (let i = 0; i < ranges.length; i += 1) {
      const range = Number(ranges[i]);
      if (!(range >= least && range <= most)) continue;
      const a = angle + i * increment;
      this.add(range * Math.cos(a), range * Math.sin(a), 0, range, bright ? Number(bright[i]) : 0);
    }
    this.hasIntensity = bright !== null;
    return '';
  }
}
