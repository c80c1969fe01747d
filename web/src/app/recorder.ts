// The values of the last minutes: one ring of times, a ring for each series.
import type { Message, Value } from '../protocol/cdr';
import type { TreeJoint } from '../robot/tree';
import type { Twin } from './twin';

export const CAPACITY = 12_000; // at 50 Hz four minutes
const MOST_POSITIONS = 4_000_000; // positions of all joints that are kept; with many joints the times are fewer
const SPACING = 0.0195; // s of wall-clock time, the minimum between samples

export interface Series {
  key: string;
  label: string;
  unit: string;
  read: () => number;
  ring: Float64Array;
  end: () => void;
}

// For a joint: the controller's reference, NaN without one, and the tolerance around it.
export interface Allowed {
  reference(joint: string): number;
  tolerance(joint: string): number;
}

export const QUANTITIES = ['position', 'target', 'error', 'velocity', 'effort'] as const;
export const TOLERANCE = 'tolerance'; // half the width of the band around the target
export type Quantity = (typeof QUANTITIES)[number];

export function numberAt(message: Value | undefined, path: (string | number)[]): number {
  let at: Value | undefined = message;
  for (const part of path) {
    if (at === null || typeof at !== 'object') return NaN;
    at = (at as Record<string | number, Value>)[part];
  }
  return typeof at === 'number' ? at : typeof at === 'bigint' ? Number(at) : typeof at === 'boolean' ? Number(at) : NaN;
}

export class Recorder {
  readonly series = new Map<string, Series>();
  private readonly times = new Float64Array(CAPACITY);
  private next = 0;
  count = 0;
  private lastWall = 0;
  private positions = new Float32Array(); // of all joints, at every `thinned`th sample
  private thinned = 1;

  constructor(private readonly twin: Twin, private readonly allowed: Allowed) {
    twin.sampled.on(() => this.sample());
    twin.robotChanged.on(() => this.clear());
  }

  clear(): void {
    this.next = this.count = 0;
    for (const { ring } of this.series.values()) ring.fill(NaN);
  }

  joint(joint: TreeJoint, quantity: Quantity | typeof TOLERANCE): Series {
    const { twin } = this;
    const name = joint.name;
    const read = (): number => {
      const index = twin.tree?.jointByName.get(name)?.index ?? -1;
      if (index < 0) return NaN;
      const reference = this.allowed.reference(name);
      const target = Number.isNaN(reference) ? twin.target[index]! : reference;
      switch (quantity) {
        case 'position': return twin.q[index]!;
        case 'target': return target;
        case 'error': return target - twin.q[index]!;
        case 'tolerance': return this.allowed.tolerance(name);
        case 'velocity': return twin.velocity[index]!;
        case 'effort': return twin.effort[index]!;
      }
    };
    const slides = joint.kind === 'prismatic';
    const unit = { position: slides ? 'm' : 'rad', target: slides ? 'm' : 'rad', error: slides ? 'm' : 'rad', tolerance: slides ? 'm' : 'rad', velocity: slides ? 'm/s' : 'rad/s', effort: slides ? 'N' : 'N m' }[quantity];
    return this.add(`joint:${name}:${quantity}`, `${name} ${quantity}`, unit, read, () => {});
  }

  field(topic: string, path: (string | number)[]): Series {
    let last: Message | null = null;
    const end = this.twin.client.subscribe(topic, (message) => (last = message));
    const text = path.map((part) => (typeof part === 'number' ? `[${part}]` : `.${part}`)).join('');
    return this.add(`topic:${topic}${text}`, `${topic}${text}`, '', () => (last ? numberAt(last, path) : NaN), end);
  }

  private add(key: string, label: string, unit: string, read: () => number, end: () => void): Series {
    const known = this.series.get(key);
    if (known) {
      end();
      return known;
    }
    const made: Series = { key, label, unit, read, end, ring: new Float64Array(CAPACITY).fill(NaN) };
    this.series.set(key, made);
    return made;
  }

  remove(key: string): void {
    this.series.get(key)?.end();
    this.series.delete(key);
  }

  private sample(): void {
    const wall = performance.now() / 1000;
    const time = this.twin.client.channel('/clock') ? this.twin.simTime : wall; // a view has no clock
    if (wall - this.lastWall < SPACING || this.twin.paused) return;
    const newest = this.count > 0 ? this.times[(this.next + CAPACITY - 1) % CAPACITY]! : -Infinity;
    if (time < newest) this.clear();
    else if (time === newest) return;
    this.lastWall = wall;
    this.times[this.next] = time;
    for (const series of this.series.values()) series.ring[this.next] = series.read();
    this.keepPositions();
    this.next = (this.next + 1) % CAPACITY;
    this.count = Math.min(CAPACITY, this.count + 1);
  }

  private keepPositions(): void {
    const { q } = this.twin;
    if (q.length === 0) return;
    const thinned = Math.max(1, Math.ceil((CAPACITY * q.length) / MOST_POSITIONS));
    const size = Math.ceil(CAPACITY / thinned) * q.length;
    if (this.positions.length !== size) this.positions = new Float32Array(size);
    this.thinned = thinned;
    if (this.next % thinned === 0) this.positions.set(q, (this.next / thinned) * q.length);
  }

  // The positions of all joints at that time; null: before or after the recorded time.
  positionsAt(time: number): Float64Array | null {
    const n = this.twin.q.length;
    if (this.count === 0 || this.positions.length < n || time < this.oldest - 1e-6 || time > this.newest + 1e-6) return null;
    const at = (this.next - this.count + CAPACITY + Math.min(this.find(time), this.count - 1)) % CAPACITY;
    const row = Math.floor(at / this.thinned) * n;
    return Float64Array.from(this.positions.subarray(row, row + n));
  }

  // The number of samples older than that time.
  private find(time: number): number {
    const start = this.next - this.count + CAPACITY;
    let low = 0, high = this.count;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[(start + middle) % CAPACITY]! < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  get newest(): number {
    return this.count > 0 ? this.times[(this.next + CAPACITY - 1) % CAPACITY]! : 0;
  }
  get oldest(): number {
    return this.count > 0 ? this.times[(this.next - this.count + CAPACITY) % CAPACITY]! : 0;
  }

  // Columns of a time range, with at most `most` rows.
  window(from: number, to: number, keys: string[], most = Infinity): Float64Array[] {
    const start = this.next - this.count + CAPACITY;
    const at = (i: number): number => (start + i) % CAPACITY;
    const first = Math.max(0, this.find(from) - 1), last = Math.min(this.count, this.find(to) + 1);
    const stride = Math.max(1, Math.ceil((last - first) / most));
    const rows = Math.ceil((last - first) / stride);
    const columns = [this.times, ...keys.map((key) => this.series.get(key)?.ring)];
    return columns.map((ring) => {
      const out = new Float64Array(rows);
      for (let i = 0; i < rows; i += 1) out[i] = ring ? ring[at(first + i * stride)]! : NaN;
      return out;
    });
  }

  csv(keys: string[]): string {
    const columns = this.window(-Infinity, Infinity, keys);
    const quote = (text: string): string => (/[",\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text);
    const head = ['time [s]', ...keys.map((key) => {
      const series = this.series.get(key);
      return series ? series.label + (series.unit ? ` [${series.unit}]` : '') : key;
    })].map(quote).join(',');
    const lines = [head];
    for (let i = 0; i < (columns[0]?.length ?? 0); i += 1) lines.push(columns.map((c) => (Number.isFinite(c[i]!) ? String(c[i]) : '')).join(','));
    return lines.join('\n') + '\n';
  }
}
