// The curves of a check with the range that they have to keep.
import uPlot from 'uplot';
import { curveColours } from '../app/curve_colours';
import { h } from '../app/dom';
import type { Band, Curve, CurvePanel } from '../app/validation';
import { tickTexts } from './plots';

const HEIGHT = 170; // px
const MOST_SPANS = 6; // a limit farther from the curves would make them a flat line

const finite = (value: number | null): value is number => value !== null && Number.isFinite(value);

// A step has two values at one time, which a table of columns has not: the second comes a moment later.
function apart(curve: Curve, span: number): [number[], (number | null)[]] {
  const x: number[] = [], y: (number | null)[] = [];
  curve.x.forEach((place, i) => {
    if (!finite(place)) return;
    const before = x[x.length - 1];
    x.push(before !== undefined && place <= before ? before + span * 1e-6 : place);
    y.push(curve.y[i] ?? null);
  });
  return [x, y];
}

function valueRange({ curves, bands }: CurvePanel): [number, number] {
  const values = curves.flatMap(({ y }) => y.filter(finite));
  let low = values.reduce((a, b) => Math.min(a, b), Infinity), high = values.reduce((a, b) => Math.max(a, b), -Infinity);
  if (low > high) [low, high] = [0, 1];
  const room = MOST_SPANS * Math.max(high - low, 1e-9), from = low - room, to = high + room;
  for (const limit of bands.flatMap((band) => [band.low, band.high])) {
    if (!finite(limit) || limit < from || limit > to) continue;
    low = Math.min(low, limit);
    high = Math.max(high, limit);
  }
  const margin = 0.08 * Math.max(high - low, 1e-9);
  return [low - margin, high + margin];
}

function drawBand(u: uPlot, { low, high, begin, end, label }: Band, colour: string): void {
  const { ctx, bbox } = u;
  const x = (value: number | null, other: number): number => Math.min(bbox.left + bbox.width, Math.max(bbox.left, finite(value) ? u.valToPos(value, 'x', true) : other));
  const y = (value: number | null, other: number): number => Math.min(bbox.top + bbox.height, Math.max(bbox.top, finite(value) ? u.valToPos(value, 'y', true) : other));
  const left = x(begin, bbox.left), right = x(end, bbox.left + bbox.width), top = y(high, bbox.top), bottom = y(low, bbox.top + bbox.height);
  if (right <= left) return;
  ctx.save();
  ctx.fillStyle = `${colour}22`;
  ctx.fillRect(left, top, right - left, bottom - top);
  ctx.strokeStyle = colour;
  ctx.lineWidth = devicePixelRatio;
  ctx.setLineDash([7 * devicePixelRatio, 3 * devicePixelRatio]);
  for (const [limit, at] of [[low, bottom], [high, top]] as [number | null, number][]) {
    if (!finite(limit) || at <= bbox.top || at >= bbox.top + bbox.height) continue;
    ctx.beginPath();
    ctx.moveTo(left, at);
    ctx.lineTo(right, at);
    ctx.stroke();
  }
  ctx.fillStyle = colour;
  ctx.font = `${11 * devicePixelRatio}px system-ui`;
  ctx.textAlign = 'right';
  // Below a band that is too narrow for it, else inside.
  const isNarrow = bottom - top < 16 * devicePixelRatio, below = bottom + 12 * devicePixelRatio;
  ctx.fillText(label, right - 4 * devicePixelRatio, isNarrow && below < bbox.top + bbox.height ? below : bottom - 4 * devicePixelRatio);
  ctx.restore();
}

// `end` frees what it draws with.
export function evidencePlot(panel: CurvePanel): { element: HTMLElement; end: () => void } {
  const palette = curveColours();
  const style = getComputedStyle(document.documentElement);
  const ink = style.getPropertyValue('--muted'), grid = style.getPropertyValue('--line'), good = style.getPropertyValue('--good').trim();
  const places = panel.curves.flatMap(({ x }) => x.filter(finite));
  const span = Math.max(1e-9, places.reduce((a, b) => Math.max(a, b), -Infinity) - places.reduce((a, b) => Math.min(a, b), Infinity));
  const data = panel.curves.length > 0 ? uPlot.join(panel.curves.map((curve) => apart(curve, span) as uPlot.AlignedData)) : [[]] as unknown as uPlot.AlignedData;
  const host = h('div', { class: 'evidence-plot', role: 'img', 'aria-label': `${panel.title}: ${panel.curves.map(({ label }) => label).join(', ')}` });
  const axis = { stroke: ink, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid, width: 1 }, font: '11px system-ui' };
  const plot = new uPlot({
    width: 280, height: HEIGHT, legend: { show: false }, cursor: { drag: { x: false, y: false } },
    scales: { x: { time: false }, y: { range: valueRange(panel) } },
    axes: [{ ...axis, label: panel.x_axis, labelSize: 14, labelFont: '11px system-ui', values: tickTexts, size: 24 }, { ...axis, label: panel.unit, labelSize: 14, labelFont: '11px system-ui', values: tickTexts, size: 48, space: 26 }],
    series: [{}, ...panel.curves.map((_, i) => ({ stroke: palette[i % palette.length]!, width: 1.5, points: { show: false }, ...(i > 0 ? { dash: [6, 3] } : {}) }))],
    hooks: { drawAxes: [(u) => panel.bands.forEach((band) => drawBand(u, band, good))] },
  }, data, host);
  const observer = new ResizeObserver(() => host.clientWidth > 60 && plot.setSize({ width: host.clientWidth, height: HEIGHT }));
  observer.observe(host);
  const key = h('div', { class: 'evidence-key' }, panel.curves.map(({ label }, i) => h('span', {}, h('i', { class: i > 0 ? 'dashed' : '', style: `border-color:${palette[i % palette.length]}` }), label)));
  return {
    element: h('figure', { class: 'evidence-figure' }, h('figcaption', {}, panel.title, panel.remark ? h('span', { class: 'muted' }, ` ${panel.remark}`) : null), host, key),
    end: () => {
      observer.disconnect();
      plot.destroy();
    },
  };
}
