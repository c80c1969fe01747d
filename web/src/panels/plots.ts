// Curves of the last minutes: joints' quantities and any number of any topic; live, or held and looked through.
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import type { App, Panel } from '../app/app';
import { button, download, fill, h } from '../app/dom';
import { QUANTITIES, type Quantity, type Recorder } from '../app/recorder';
import { Signal } from '../app/signal';

// Okabe and Ito's colours, told apart by all; past eight the dashes change.
const LIGHT = ['#0072b2', '#d55e00', '#009e73', '#cc79a7', '#b8860b', '#56b4e9', '#5d4a9c', '#444444'];
const DARK = ['#56b4e9', '#f0814a', '#35c296', '#e39cc8', '#f0d25a', '#8fd0ff', '#b3a3ee', '#d0d0d0'];

export const plotWanted = new Signal<{ topic: string; path: (string | number)[] }>();

export function plotsPanel(app: App, recorder: Recorder): Panel {
  const { twin } = app;
  const shown: string[] = [];
  const host = h('div', { class: 'plot' });
  const chips = h('div', { class: 'chips' });
  let plot: uPlot | null = null;
  let endLoads = (): void => {};
  let span = 15;
  let held: number | null = null; // the right end, when not live

  const joint = h('select', { 'aria-label': 'Joint' });
  const quantity = h('select', { 'aria-label': 'Quantity' }, ...QUANTITIES.map((name) => h('option', { value: name }, name)));
  const width = h('select', { 'aria-label': 'Width of the window', onchange: () => (span = Number(width.value)) },
    ...[5, 15, 60, 180].map((s) => h('option', { value: String(s), selected: s === span }, s < 60 ? `${s} s` : `${s / 60} min`)));
  const live = button('Hold', 'Hold the curves, to look through the last minutes', () => {
    held = held === null ? recorder.newest : null;
    reflect();
  }, { id: 'plot-hold' });
  const scrub = h('input', { type: 'range', min: '0', max: '1', step: 'any', value: '1', 'aria-label': 'Look through the last minutes', class: 'scrub' });
  scrub.addEventListener('input', () => {
    held = recorder.oldest + (recorder.newest - recorder.oldest) * Number(scrub.value);
    if (Number(scrub.value) > 0.999) held = null;
    reflect();
  });

  function reflect(): void {
    live.textContent = held === null ? 'Hold' : 'Live';
    live.setAttribute('aria-pressed', String(held !== null));
    if (held === null) scrub.value = '1';
  }

  function colours(): string[] {
    return document.documentElement.dataset['theme'] === 'dark' ? DARK : LIGHT;
  }

  function rebuild(): void {
    plot?.destroy();
    plot = null;
    fill(host);
    const palette = colours();
    fill(chips, shown.map((key, i) => h('button', { type: 'button', class: 'chip', title: `Take away ${recorder.series.get(key)?.label ?? key}`, onclick: () => remove(key) },
      h('i', { style: `background:${palette[i % palette.length]}` }), recorder.series.get(key)?.label ?? key, ' ×')));
    if (shown.length === 0) {
      fill(host, h('p', { class: 'empty' }, 'Choose a joint and a quantity, or a number in Topics.'));
      return;
    }
    const style = getComputedStyle(document.documentElement);
    const ink = style.getPropertyValue('--muted'), grid = style.getPropertyValue('--line');
    const axis = { stroke: ink, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid, width: 1 }, font: '11px system-ui' };
    const units = [...new Set(shown.map((key) => recorder.series.get(key)?.unit ?? ''))];
    plot = new uPlot({
      width: Math.max(100, host.clientWidth), height: Math.max(60, host.clientHeight), legend: { show: false },
      cursor: { drag: { x: false, y: false } }, scales: { x: { time: false }, ...Object.fromEntries(units.slice(1).map((_, i) => [`y${i + 1}`, { auto: true }])) },
      axes: [{ ...axis, values: (_, ticks) => ticks.map((t) => (t < 0 ? '' : `${t.toFixed(t % 1 ? 1 : 0)} s`)), size: 26 },
        ...units.slice(0, 2).map((unit, i) => ({ ...axis, scale: i === 0 ? 'y' : 'y1', side: i === 0 ? 3 : 1, grid: i === 0 ? axis.grid : { show: false }, label: unit, labelSize: 16, labelFont: '11px system-ui', size: 52 }))],
      series: [{}, ...shown.map((key, i) => {
        const unit = units.indexOf(recorder.series.get(key)?.unit ?? '');
        return { stroke: palette[i % palette.length]!, width: 1.5, points: { show: false }, scale: unit === 0 ? 'y' : `y${unit}`, ...(i >= palette.length || key.endsWith(':target') ? { dash: [6, 3] } : {}) };
      })],
      hooks: { setCursor: [values] },
    }, [new Float64Array(), ...shown.map(() => new Float64Array())], host);
    update();
  }

  const readout = h('output', { class: 'readout num' });
  function values(u: uPlot): void {
    const i = u.cursor.idx;
    readout.textContent = i === null || i === undefined ? ''
      : `${u.data[0][i]!.toFixed(2)} s   ` + shown.map((_, k) => (u.data[k + 1]?.[i] ?? NaN).toPrecision(4)).join('   ');
  }

  function add(key: string): void {
    if (!shown.includes(key)) shown.push(key);
    rebuild();
  }

  function remove(key: string): void {
    shown.splice(shown.indexOf(key), 1);
    recorder.remove(key);
    rebuild();
  }

  function update(): void {
    if (!plot || recorder.count === 0) return;
    const to = held ?? recorder.newest;
    const data = recorder.window(to - span, to, shown, Math.max(200, plot.width * 1.5));
    plot.setData(data as unknown as uPlot.AlignedData, false);
    plot.setScale('x', { min: to - span, max: to });
    if (held !== null) scrub.value = String((held - recorder.oldest) / Math.max(1e-9, recorder.newest - recorder.oldest));
  }

  twin.robotChanged.on((tree) => {
    fill(joint, tree.moving.map((j) => h('option', { value: j.name }, j.name)));
    for (const key of [...shown]) if (!key.startsWith('topic:')) remove(key);
    for (const j of tree.moving.filter((one) => !one.mimic).slice(0, 3)) shown.push(recorder.joint(j, 'position').key);
    rebuild();
  });
  plotWanted.on(({ topic, path }) => add(recorder.field(topic, path).key));
  addEventListener('themechange', rebuild);
  new ResizeObserver(() => plot?.setSize({ width: Math.max(100, host.clientWidth), height: Math.max(60, host.clientHeight) })).observe(host);

  return {
    id: 'plots', title: 'Plots', rate: 15, update,
    element: h('div', { class: 'plots-panel' },
      h('div', { class: 'tools' }, joint, quantity,
        button('Add', 'Add this curve', () => {
          const found = twin.tree?.jointByName.get(joint.value);
          if (found) add(recorder.joint(found, quantity.value as Quantity).key);
        }),
        button('All joints', 'This quantity of all joints', () => {
          for (const j of (twin.tree?.moving ?? []).slice(0, 16)) {
            const { key } = recorder.joint(j, quantity.value as Quantity);
            if (!shown.includes(key)) shown.push(key);
          }
          rebuild();
        }),
        button('Clear', 'Take all curves away', () => {
          for (const key of [...shown]) remove(key);
        }),
        h('span', { class: 'spacer' }), width, live, scrub,
        button('CSV', 'Save the last minutes of these curves', () => download('doppel.csv', 'text/csv', recorder.csv(shown)))),
      chips, host, readout),
    shown: () => {
      endLoads = twin.watchLoads();
      rebuild();
    },
    hidden: () => endLoads(),
  };
}
