// Views of the values of a sensor, one for each type of message: a picture, a plot of a scan, or numbers.
import { COLOUR_MAP, colourStep, gradient, SteadyScale } from '../app/colour_map';
import { openDialog } from '../app/dialog';
import { fill, h, say } from '../app/dom';
import { ImagePainter } from '../app/image';
import { PointBuffer } from '../app/points';
import { forceOf, readTouches } from '../app/touches';
import { fixed } from '../app/units';
import type { Message, Value } from '../protocol/cdr';

export interface View {
  element: HTMLElement;
  take: (message: Message) => void;
  update: () => void; // several times a second while it is visible
  stop: () => void; // no messages from now on
}

type Vector = { x: number; y: number; z: number };

function vectorOf(value: Value | undefined): Vector {
  return value as unknown as Vector;
}

// The number of events a second, over the last second or more.
class Rate {
  value = 0;
  private at = performance.now();
  private count = 0;

  update(count: number): number {
    const now = performance.now();
    if (now - this.at < 1000) return this.value;
    this.value = ((count - this.count) / (now - this.at)) * 1000;
    this.at = now;
    this.count = count;
    return this.value;
  }
}

// The picture, larger in a dialog as long as it is open.
function enlarge(name: string, canvas: HTMLCanvasElement, home: HTMLElement): void {
  const close = h('button', { type: 'button', onclick: () => dialog.close() }, 'Close');
  canvas.style.setProperty('--shape', String(canvas.height / canvas.width));
  const dialog = h('dialog', { class: 'large-picture', 'aria-label': name }, h('div', { class: 'row' }, h('strong', {}, name), h('span', { class: 'spacer' }), close), canvas);
  dialog.addEventListener('close', () => {
    home.append(canvas);
    home.focus();
  });
  openDialog(dialog, true);
}

export function pictureView(name: string): View {
  const canvas = h('canvas', { width: 4, height: 3, role: 'img', 'aria-label': `Picture of ${name}` });
  const painter = new ImagePainter(canvas);
  const caption = h('figcaption', { class: 'muted num' }, 'Waiting for a picture.');
  const most = h('span', { class: 'num' });
  const scale = h('div', { class: 'scale', hidden: true }, h('span', { class: 'num' }, '0'), h('i', { class: 'legend-key colours', style: `--key: ${gradient()}` }), most);
  const home: HTMLButtonElement = h('button', { type: 'button', class: 'picture', title: 'Enlarge', 'aria-label': `Enlarge the picture of ${name}`, onclick: () => enlarge(name, canvas, home) }, canvas);
  const rate = new Rate();
  return {
    element: h('figure', { class: 'sensor-picture' }, home, scale, caption),
    take: (message) => painter.take(message),
    update: () => {
      const hertz = rate.update(painter.drawn);
      if (painter.note) say(caption, painter.drawn > 0 && hertz > 0 ? `${painter.note}, drawn at ${fixed(hertz, 1)} Hz` : painter.note);
      scale.hidden = painter.most === 0;
      say(most, `${painter.most} m`);
    },
    stop: () => {
      painter.drop();
      canvas.closest('dialog')?.close();
    },
  };
}

const PLOT = 240; // CSS pixels

// The scan from above, the sensor's x axis upwards.
export function scanView(name: string): View {
  const canvas = h('canvas', { class: 'scan-plot', role: 'img', 'aria-label': `Scan of ${name}, seen from above` });
  const caption = h('div', { class: 'muted num' }, 'Waiting for a scan.');
  const buffer = new PointBuffer();
  const scale = new SteadyScale();
  let last: Message | null = null;

  function draw(): void {
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const side = Math.round(PLOT * ratio);
    if (canvas.width !== side) canvas.width = canvas.height = side;
    const context = canvas.getContext('2d')!;
    const style = getComputedStyle(canvas);
    const most = scale.take(buffer.farthest);
    const middle = side / 2, metre = most > 0 ? (middle - 4 * ratio) / most : 0;
    context.clearRect(0, 0, side, side);
    context.strokeStyle = style.getPropertyValue('--line');
    context.fillStyle = style.getPropertyValue('--muted');
    context.font = `${11 * ratio}px system-ui, sans-serif`;
    context.lineWidth = ratio;
    for (const share of [0.5, 1]) {
      context.beginPath();
      context.arc(middle, middle, share * most * metre, 0, 2 * Math.PI);
      context.stroke();
      if (most > 0) context.fillText(`${+(share * most).toPrecision(2)} m`, middle + 3 * ratio, middle - share * most * metre + 12 * ratio);
    }
    const dot = 2.5 * ratio;
    for (let i = 0; i < buffer.count; i += 1) {
      const o = colourStep(buffer.ranges[i]!, most) * 3;
      context.fillStyle = `rgb(${COLOUR_MAP[o]}, ${COLOUR_MAP[o + 1]}, ${COLOUR_MAP[o + 2]})`;
      context.fillRect(middle - buffer.positions[3 * i + 1]! * metre - dot / 2, middle - buffer.positions[3 * i]! * metre - dot / 2, dot, dot);
    }
    context.fillStyle = style.getPropertyValue('--ink');
    context.beginPath();
    context.moveTo(middle, middle - 7 * ratio);
    context.lineTo(middle + 4 * ratio, middle + 4 * ratio);
    context.lineTo(middle - 4 * ratio, middle + 4 * ratio);
    context.fill();
  }

  return {
    element: h('div', { class: 'scan' }, canvas, caption),
    take: (message) => (last = message),
    update: () => {
      if (!last) return;
      const total = (last['ranges'] as ArrayLike<number>).length;
      const problem = buffer.readScan(last);
      last = null;
      draw();
      const nearest = buffer.ranges.subarray(0, buffer.count).reduce((least, range) => Math.min(least, range), Infinity);
      say(caption, problem || `${buffer.count} of ${total} rays hit${buffer.count > 0 ? `, nearest at ${nearest.toFixed(3)} m` : ''}`);
    },
    stop: () => {},
  };
}

export function rangeView(): View {
  const bar = h('i', {}), value = h('output', { class: 'num' }, '–'), ends = h('span', { class: 'muted num' });
  let last: Message | null = null;
  return {
    element: h('div', { class: 'range' }, value, h('span', { class: 'gauge' }, bar), ends),
    take: (message) => (last = message),
    update: () => {
      if (!last) return;
      const [range, least, most] = ['range', 'min_range', 'max_range'].map((name) => Number(last![name])) as [number, number, number];
      say(value, range > most ? 'nothing in sight' : range < least ? 'too near' : `${fixed(range, 3)} m`);
      say(ends, `${+least.toPrecision(3)} … ${+most.toPrecision(3)} m`);
      bar.style.width = `${Number.isFinite(range) ? Math.min(100, Math.max(0, ((range - least) / (most - least)) * 100)) : 0}%`;
    },
    stop: () => {},
  };
}

type Line = [label: string, unit: string, read: (message: Message) => number[] | null]; // x y z, and their magnitude

// Vectors with their magnitudes, a line of a table for each; a line that reads null is missing from the message.
function vectorsView(lines: Line[]): View {
  const rows = lines.map(([label, unit]) => ({ cells: [0, 1, 2, 3].map(() => h('td', { class: 'num' }, '–')), label, unit }));
  const element = h('table', { class: 'vectors' },
    h('thead', {}, h('tr', {}, ['', 'x', 'y', 'z', 'total'].map((t) => h('th', { scope: 'col' }, t)))),
    h('tbody', {}, rows.map(({ cells, label, unit }) => h('tr', {}, h('th', { scope: 'row' }, label, h('small', {}, ` ${unit}`)), cells))));
  let last: Message | null = null;
  return {
    element,
    take: (message) => (last = message),
    update: () => {
      const message = last;
      if (!message) return;
      lines.forEach(([, , read], i) => {
        const values = read(message);
        rows[i]!.cells.forEach((cell, k) => say(cell, values && k < values.length ? fixed(values[k]!, 3) : '–'));
      });
    },
    stop: () => {},
  };
}

function withTotal({ x, y, z }: Vector): number[] {
  return [x, y, z, Math.hypot(x, y, z)];
}

const DEG = 180 / Math.PI;

// Roll, pitch, yaw in degrees.
export function anglesOf({ x, y, z, w }: Vector & { w: number }): number[] {
  return [
    Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)) * DEG,
    Math.asin(Math.min(1, Math.max(-1, 2 * (w * y - z * x)))) * DEG,
    Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) * DEG,
  ];
}

function imuView(): View {
  return vectorsView([
    ['acceleration', 'm/s²', (m) => withTotal(vectorOf(m['linear_acceleration']))],
    ['angular velocity', 'rad/s', (m) => withTotal(vectorOf(m['angular_velocity']))],
    // Without an orientation the first of its covariance is -1 (REP 145).
    ['roll, pitch, yaw', '°', (m) => ((m['orientation_covariance'] as ArrayLike<number>)[0] === -1 ? null : anglesOf(m['orientation'] as unknown as Vector & { w: number }))],
  ]);
}

function wrenchView(): View {
  const part = (name: string) => (m: Message): number[] => withTotal(vectorOf((m['wrench'] as Message)[name]));
  return vectorsView([['force', 'N', part('force')], ['torque', 'N m', part('torque')]]);
}

const MOST_TOUCHES = 8;

function touchesView(): View {
  const element = h('div', { class: 'touches' }, h('p', { class: 'muted' }, 'Waiting for a message.'));
  let last: Message | null = null;
  return {
    element,
    take: (message) => (last = message),
    update: () => {
      if (!last) return;
      const touches = readTouches(last);
      last = null;
      const lines = touches.slice(0, MOST_TOUCHES).map((touch) => h('div', { class: 'touch' },
        h('span', {}, touch.own, h('span', { class: 'muted' }, ' touches '), touch.other),
        h('span', { class: 'num' }, `${fixed(forceOf(touch), 2)} N`)));
      const more = touches.length - lines.length;
      fill(element, lines.length === 0 ? h('p', { class: 'muted' }, 'Nothing touches.') : lines, more > 0 ? h('p', { class: 'muted' }, `and ${more} more`) : null);
    },
    stop: () => {},
  };
}

// The views by the type of the messages; undefined: the panel has no view of it.
export const VIEWS: Record<string, ((name: string) => View) | undefined> = {
  'sensor_msgs/CompressedImage': pictureView,
  'sensor_msgs/Image': pictureView,
  'sensor_msgs/LaserScan': scanView,
  'sensor_msgs/Range': rangeView,
  'sensor_msgs/Imu': imuView,
  'geometry_msgs/WrenchStamped': wrenchView,
  'ros_gz_interfaces/Contacts': touchesView,
  'gazebo_msgs/ContactsState': touchesView,
};
