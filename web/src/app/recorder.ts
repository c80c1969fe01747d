// The values of the last minutes, or of a whole recording: one ring of times, a ring for each series.
import type { Message, Value } from '../protocol/cdr';
import type { TreeJoint } from '../robot/tree';
import { Signal } from './signal';
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
  begin: () => () => void; // listens to what is read; returns the function that ends it
  end: () => void;
}

// For a joint: the controller's reference, NaN without one, and the tolerance around it.
export interface Allowed {
  reference(joint: string): number;
  tolerance(joint: string): number;
}

// A series of the recorder that plots show, or no longer; without a key all of them.
export const curveWanted = new Signal<{ key: string; on: boolean }>();

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
  readonly added = new Signal<Series>(); // without the values of the past
  private capacity = CAPACITY;
  private times = new Float64Array(CAPACITY);
  private next = 0;
  count = 0;
  private lastWall = 0;
  private positions = new Float32Array(); // of all joints, at every `thinned`th sample
  private thinned = 1;
  private recordedTime: (() => number) | null = null; // of a recording, s since its start
  private least = 0; // s between two samples of a recording

  constructor(private twin: Twin, private allowed: Allowed) {
    twin.sampled.on(() => this.recordedTime || this.sample());
    twin.robotChanged.on(() => this.recordedTime || this.clear());
  }

  // Curves of a whole recording: this twin is led through it, and `take` is called for each sample.
  follow(twin: Twin, time: () => number, length: number, most: number): void {
    for (const series of this.series.values()) series.end();
    this.twin = twin;
    this.allowed = { reference: () => NaN, tolerance: () => NaN };
    this.recordedTime = time;
    this.capacity = most;
    this.least = length / most;
    this.times = new Float64Array(most);
    this.positions = new Float32Array();
    for (const series of this.series.values()) {
      series.ring = new Float64Array(most);
      series.end = series.begin();
    }
    this.clear();
  }

  take(): void {
    const time = this.recordedTime!();
    if (this.count > 0 && time < this.newest) this.clear();
    if (this.count === 0 || time - this.newest >= Math.max(this.least, 1e-9)) this.keep(time);
  }

  clear(): void {
    this.next = this.count = 0;
    for (const { ring } of this.series.values()) ring.fill(NaN);
  }

  // In a recording without the state of its controller a joint has no target.
  private ownTarget(name: string, index: number): number {
    return this.recordedTime && !this.twin.referenced.has(name) ? NaN : this.twin.target[index]!;
  }

  joint(joint: TreeJoint, quantity: Quantity | typeof TOLERANCE): Series {
    const name = joint.name;
    const read = (): number => {
      const { twin } = this;
      const index = twin.tree?.jointByName.get(name)?.index ?? -1;
      if (index < 0) return NaN;
      const reference = this.allowed.reference(name);
      const target = Number.isNaN(reference) ? this.ownTarget(name, index) : reference;
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
    return this.add(`joint:${name}:${quantity}`, `${name} ${quantity}`, unit, read);
  }

  // A number that is computed for each sample.
  computed(key: string, label: string, unit: string, read: () => number): Series {
    return this.add(key, label, unit, read);
  }

  field(topic: string, path: (string | number)[]): Series {
    let last: Message | null = null;
    const begin = (): (() => void) => {
      last = null;
      return this.twin.client.subscribe(topic, (message) => (last = message));
    };
    const text = path.map((part) => (typeof part === 'number' ? `[${part}]` : `.${part}`)).join('');
    return this.add(`topic:${topic}${text}`, `${topic}${text}`, '', () => (last ? numberAt(last, path) : NaN), begin);
  }

  private add(key: string, label: string, unit: string, read: () => number, begin = () => () => {}): Series {
    const known = this.series.get(key);
    if (known) return known;
    const made: Series = { key, label, unit, read, begin, end: begin(), ring: new Float64Array(this.capacity).fill(NaN) };
    this.series.set(key, made);
    this.added.emit(made);
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
    const newest = this.count > 0 ? this.newest : -Infinity;
    if (time < newest) this.clear();
    else if (time === newest) return;
    this.lastWall = wall;
    this.keep(time);
  }

  private keep(time: number): void {
    this.times[this.next] = time;
    for (const series of this.series.values()) series.ring[this.next] = series.read();
    this.keepPositions();
    this.next = (this.next + 1) % this.capacity;
    this.count = Math.min(this.capacity, this.count + 1);
  }

  private keepPositions(): void {
    const { q } = this.twin;
    if (q.length === 0) return;
    const thinned = Math.max(1, Math.ceil((this.capacity * q.length) / MOST_POSITIONS));
    const size = Math.ceil(this.capacity / thinned) * q.length;
    if (this.positions.length !== size) this.positions = new Float32Array(size);
    this.thinned = thinned;
    if (this.next % thinned === 0) this.positions.set(q, (this.next / thinned) * q.length);
  }

  // The positions of all joints at that time; null: before or after the recorded time.
  positionsAt(time: number): Float64Array | null {
    const n = this.twin.q.length;
    if (this.count === 0 || this.positions.length < n || time < this.oldest - 1e-6 || time > this.newest + 1e-6) return null;
    const at = (this.next - this.count + this.capacity + Math.min(this.find(time), this.count - 1)) % this.capacity;
    const row = Math.floor(at / this.thinned) * n;
    return Float64Array.from(this.positions.subarray(row, row + n));
  }

  // The number of samples older than that time.
  private find(time: number): number {
    const start = this.next - this.count + this.capacity;
    let low = 0, high = this.count;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[(start + middle) % this.capacity]! < time) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  get newest(): number {
    return this.count > 0 ? this.times[(this.next + this.capacity - 1) % this.capacity]! : 0;
  }
  get oldest(): number {
    return this.count > 0 ? this.times[(this.next - this.count + this.capacity) % this.capacity]! : 0;
  }

  // The value at that time, between two samples on the line through them; NaN: before or after the recorded time.
  valueAt(key: string, time: number): number {
    const ring = this.series.get(key)?.ring;
    const i = this.find(time);
    if (!ring || this.count === 0 || i >= this.count) return NaN;
    const start = this.next - this.count + this.capacity;
    const b = (start + i) % this.capacity, a = (start + i - 1) % this.capacity;
    const to = this.times[b]!, from = this.times[a]!;
    if (i === 0 || to === from) return to - time < 1e-6 ? ring[b]! : NaN;
    return ring[a]! + ((ring[b]! - ring[a]!) * (time - from)) / (to - from);
  }

  // Columns of a time range, with at most `most` rows.
  window(from: number, to: number, keys: string[], most = Infinity): Float64Array[] {
    const start = this.next - this.count + this.capacity;
    const at = (i: number): number => (start + i) % this.capacity;
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
