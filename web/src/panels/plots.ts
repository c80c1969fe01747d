// Curves of the last minutes: quantities of joints and any number in any topic; live, or held and scrubbed, with a
// ghost of the arm at that time.
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import type { App, Panel } from '../app/app';
import { curveColours } from '../app/curve_colours';
import { button, download, fill, h, say, toast } from '../app/dom';
import type { Parameters } from '../app/parameters';
import { curveWanted, QUANTITIES, TOLERANCE, type Quantity, type Recorder } from '../app/recorder';
import { settings, settingsChanged } from '../app/settings';
import { Signal } from '../app/signal';
import { fixed } from '../app/units';

const DEG = 180 / Math.PI;

export const plotWanted = new Signal<{ topic: string; path: (string | number)[] }>();

// For a joint's position or error: the series of its tolerance band. Bands are around the target, or around zero.
function bandOf(key: string): { centre: string | null; width: string } | null {
  const found = /^(joint:.*):(position|error)$/.exec(key);
  return found ? { centre: found[2] === 'position' ? `${found[1]}:target` : null, width: `${found[1]}:${TOLERANCE}` } : null;
}

// The range of the axis: noise of a joint at rest does not fill the picture.
function rangeFor(unit: string): (u: uPlot, low: number | null, high: number | null) => [number, number] {
  const least = /^(°|mm)/.test(unit) ? 0.5 : /^rad/.test(unit) ? 0.01 : 1e-3;
  return (_, low, high) => {
    if (low === null || high === null) return [0, 1];
    const middle = (low + high) / 2, half = Math.max(least / 2, ((high - low) / 2) * 1.1);
    return [middle - half, middle + half];
  };
}

export function tickTexts(_: uPlot, ticks: number[]): string[] {
  const between = ticks.length > 1 ? Math.abs(ticks[1]! - ticks[0]!) : 1;
  return ticks.map((tick) => (Math.abs(tick) >= 1e6 ? tick.toPrecision(3) : fixed(tick, Math.min(6, Math.max(0, Math.ceil(-Math.log10(between) - 1e-9))))));
}

export function plotsPanel(app: App, recorder: Recorder, parameters: Parameters): Panel {
  const { twin, world } = app;
  const shown: string[] = [];
  const host = h('div', { class: 'plot' });
  const chips = h('div', { class: 'chips' });
  let plot: uPlot | null = null;
  let bands: { key: string; centre: string | null; width: string }[] = [];
  let endLoads = (): void => {};
  let span = 15;
  let held: number | null = null; // the time that is shown, when not live
  let right = 0; // the right end of the window at that time
  let hovered: number | null = null;
  const ends = (): [number, number] => { // of the window
    const { playback } = app;
    if (!playback) return held === null ? [recorder.newest - span, recorder.newest] : [right - span, right];
    if (whole || span >= playback.length) return [0, Math.max(1e-3, playback.length)];
    const from = Math.min(playback.length - span, Math.max(0, playback.time - span / 2));
    return [from, from + span];
  };
  let whole = true; // of a recording
  let endWatch: (() => void) | null = null;

  const joint = h('select', { 'aria-label': 'Joint' });
  const quantity = h('select', { 'aria-label': 'Quantity' }, ...QUANTITIES.map((name) => h('option', { value: name }, name)));
  const all = h('option', { value: 'all' }, 'whole recording'); // of a recording only
  const width = h('select', { 'aria-label': 'Width of the window', onchange: () => {
    whole = width.value === 'all';
    if (!whole) span = Number(width.value);
  } }, ...[5, 15, 60, 180].map((s) => h('option', { value: String(s), selected: s === span }, s < 60 ? `${s} s` : `${s / 60} min`)));
  const live = button('Hold', 'Hold the curves, to look through the last minutes', () => {
    if (held === null) look(recorder.newest);
    else goLive();
  }, { id: 'plot-hold' });
  const scrub = h('input', { type: 'range', min: '0', max: '1', step: '0.001', value: '1', 'aria-label': 'Look through the last minutes', title: 'Look through the last minutes; a ghost shows where the arm was', class: 'scrub' });
  scrub.addEventListener('input', () => {
    if (Number(scrub.value) > 0.9995) goLive();
    else look(recorder.oldest + (recorder.newest - recorder.oldest) * Number(scrub.value));
  });

  function look(time: number): void {
    if (held === null) right = recorder.newest;
    held = time;
    if (time > right || time < right - span) right = Math.min(recorder.newest, time + span / 2);
    reflect();
  }

  function goLive(): void {
    held = null;
    scrub.value = '1';
    reflect();
  }

  function reflect(): void {
    say(live, held === null ? 'Hold' : 'Live');
    live.setAttribute('aria-pressed', String(held !== null));
    live.title = held === null ? 'Hold the curves, to look through the last minutes' : 'Back to live data';
    const moment = hovered ?? (app.playback ? null : held);
    world.showPast(moment === null ? null : recorder.positionsAt(moment));
    if (moment === null) {
      say(readout, '');
      return;
    }
    const row = recorder.window(moment, moment, shown);
    const i = Math.max(0, (row[0]?.length ?? 1) - 1);
    say(readout, `${moment.toFixed(2)} s${app.playback ? '' : `, ${(recorder.newest - moment).toFixed(1)} s ago`}   ` + shown.map((key, k) => ((row[k + 1]?.[i] ?? NaN) * factor(key)).toPrecision(4)).join('   '));
  }

  // In the units of the rest of the page: angles in the selected unit, lengths in millimetres.
  function factor(key: string): number {
    const own = recorder.series.get(key)?.unit ?? '';
    return settings.degrees && /^rad/.test(own) ? DEG : /^m/.test(own) ? 1000 : 1;
  }
  function unit(key: string): string {
    const own = recorder.series.get(key)?.unit ?? '';
    return (settings.degrees ? own.replace(/^rad/, '°') : own).replace(/^m/, 'mm');
  }

  function makePlot(palette: string[]): uPlot {
    const style = getComputedStyle(document.documentElement);
    const ink = style.getPropertyValue('--muted'), grid = style.getPropertyValue('--line');
    const axis = { stroke: ink, grid: { stroke: grid, width: 1 }, ticks: { stroke: grid, width: 1 }, font: '11px system-ui' };
    const units = [...new Set(shown.map(unit))];
    const scaleOf = (key: string): string => (units.indexOf(unit(key)) === 0 ? 'y' : `y${units.indexOf(unit(key))}`);
    bands = shown.flatMap((key) => {
      const band = bandOf(key);
      return band ? [{ key, ...band }] : [];
    });
    const edge = (key: string): uPlot.Series => ({ stroke: `${palette[shown.indexOf(key) % palette.length]!}99`, width: 1, dash: [2, 3], points: { show: false }, scale: scaleOf(key) });
    return new uPlot({
      width: Math.max(100, host.clientWidth), height: Math.max(60, host.clientHeight), legend: { show: false },
      cursor: { drag: { x: false, y: false } }, scales: { x: { time: false }, ...Object.fromEntries(units.map((of, i) => [i === 0 ? 'y' : `y${i}`, { range: rangeFor(of) }])) },
      axes: [{ ...axis, values: (_, ticks) => ticks.map((t) => (t < 0 ? '' : `${t.toFixed(t % 1 ? 1 : 0)} s`)), size: 26 },
        ...units.slice(0, 2).map((label, i) => ({ ...axis, scale: i === 0 ? 'y' : 'y1', side: i === 0 ? 3 : 1, grid: i === 0 ? axis.grid : { show: false }, label, space: 26, values: tickTexts, labelSize: 16, labelFont: '11px system-ui', size: 52 }))],
      series: [{}, ...shown.map((key, i) => ({ stroke: palette[i % palette.length]!, width: 1.5, points: { show: false }, scale: scaleOf(key), ...(i >= palette.length || key.endsWith(':target') ? { dash: [6, 3] } : {}) })),
        ...bands.flatMap(({ key }) => [edge(key), edge(key)])],
      bands: bands.map(({ key }, i) => ({ series: [1 + shown.length + 2 * i, 2 + shown.length + 2 * i] as uPlot.Band.Bounds, fill: `${palette[shown.indexOf(key) % palette.length]!}1c` })),
      hooks: { setCursor: [hover], draw: [drawMoment], ready: [seekByPointer] },
    }, [new Float64Array(), ...shown.map(() => new Float64Array()), ...bands.flatMap(() => [new Float64Array(), new Float64Array()])], host);
  }

  function rebuild(): void {
    plot?.destroy();
    plot = null;
    fill(host);
    const palette = curveColours();
    fill(chips, shown.map((key, i) => h('button', { type: 'button', class: 'chip', title: `Remove ${recorder.series.get(key)?.label ?? key}`, onclick: () => remove(key) },
      h('i', { style: `background:${palette[i % palette.length]}` }), h('span', { class: 'chip-name' }, recorder.series.get(key)?.label ?? key), h('span', { class: 'muted', 'aria-hidden': 'true' }, ' ×'))));
    if (shown.length === 0) {
      fill(host, h('p', { class: 'empty' }, 'Choose a joint and a quantity, or a number in Topics.'));
      return;
    }
    plot = makePlot(palette);
    update();
  }

  const readout = h('output', { class: 'readout num' });
  function hover(u: uPlot): void {
    const i = u.cursor.idx;
    const time = i === null || i === undefined || (u.cursor.left ?? -1) < 0 ? null : u.data[0][i] ?? null;
    if (time === hovered) return;
    hovered = time;
    reflect();
  }

  // In a recording a click, or a drag, sets its time.
  function seekByPointer(u: uPlot): void {
    const seek = (event: PointerEvent): void => {
      if (event.buttons & 1) app.playback?.seek(u.posToVal(event.clientX - u.over.getBoundingClientRect().left, 'x'));
    };
    u.over.addEventListener('pointerdown', (event) => {
      if (app.playback) u.over.setPointerCapture(event.pointerId);
      seek(event);
    });
    u.over.addEventListener('pointermove', seek);
  }

  function drawMoment(u: uPlot): void {
    const moment = app.playback?.time ?? held;
    if (moment === null) return;
    const x = u.valToPos(moment, 'x', true);
    const { ctx, bbox } = u;
    if (x < bbox.left - 1 || x > bbox.left + bbox.width + 1) return;
    ctx.save();
    ctx.strokeStyle = '#cc79a7';
    ctx.setLineDash([]);
    ctx.lineWidth = 2 * devicePixelRatio;
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    ctx.restore();
  }

  // Recorded with the curve, from when it is first shown.
  function record(name: string, which: Quantity): string | null {
    const found = twin.tree?.jointByName.get(name);
    if (!found) return null;
    if (which === 'position' || which === 'error') for (const needed of ['target', TOLERANCE] as const) recorder.joint(found, needed);
    return recorder.joint(found, which).key;
  }

  function add(key: string | null): void {
    if (key !== null && !shown.includes(key)) shown.push(key);
    rebuild();
  }

  function remove(key: string): void {
    shown.splice(shown.indexOf(key), 1);
    const needed = new Set(shown.flatMap((one) => [one, bandOf(one)?.centre, bandOf(one)?.width]));
    for (const one of [key, bandOf(key)?.centre, bandOf(key)?.width]) if (one && !needed.has(one)) recorder.remove(one);
    rebuild();
  }

  function update(): void {
    if (!plot || recorder.count === 0) return;
    const [from, to] = ends();
    const keys = [...shown, ...bands.flatMap(({ centre, width: w }) => [centre ?? '', w])];
    const columns = recorder.window(from, to, keys, Math.max(200, plot.width * 1.5));
    const data = columns.slice(0, 1 + shown.length);
    shown.forEach((key, i) => {
      const by = factor(key);
      if (by !== 1) data[i + 1] = data[i + 1]!.map((value) => value * by);
    });
    bands.forEach(({ key, centre }, i) => {
      const by = factor(key);
      const middle = columns[1 + shown.length + 2 * i]!, half = columns[2 + shown.length + 2 * i]!;
      const side = (sign: number): Float64Array => half.map((w, k) => ((centre ? middle[k]! : 0) + sign * w) * by);
      data.push(side(1), side(-1));
    });
    plot.setData(data.map((column, i) => (i === 0 ? column : Array.from(column, (v) => (Number.isNaN(v) ? null : v)))) as uPlot.AlignedData, false);
    plot.setScale('x', { min: from, max: to });
    if (held !== null && document.activeElement !== scrub) scrub.value = String((held - recorder.oldest) / Math.max(1e-9, recorder.newest - recorder.oldest));
  }

  twin.robotChanged.on((tree) => {
    fill(joint, tree.moving.map((j) => h('option', { value: j.name }, j.name)));
    joint.disabled = tree.size === 0;
    for (const key of [...shown]) if (!key.startsWith('topic:')) remove(key);
    for (const j of tree.moving.filter((one) => !one.mimic).slice(0, 3)) shown.push(record(j.name, 'position')!);
    goLive();
    rebuild();
  });
  app.playbackChanged.on(() => {
    const recorded = app.playback !== null;
    if (recorded) width.prepend(all);
    else all.remove();
    if (recorded) width.value = 'all';
    whole = recorded;
    live.hidden = scrub.hidden = recorded;
    host.classList.toggle('recorded', recorded);
    goLive();
  });
  curveWanted.on(({ key, on }) => {
    if (on) add(key);
    else for (const one of key === '' ? [...shown] : shown.filter((other) => other === key)) remove(one);
  });
  plotWanted.on(({ topic, path }) => add(recorder.field(topic, path).key));
  addEventListener('themechange', rebuild);
  settingsChanged.on((key) => {
    if (key === 'degrees') rebuild();
  });
  host.addEventListener('pointerleave', () => {
    hovered = null;
    reflect();
  });
  new ResizeObserver(() => plot?.setSize({ width: Math.max(100, host.clientWidth), height: Math.max(60, host.clientHeight) })).observe(host);

  return {
    id: 'plots', title: 'Plots', rate: 15, update,
    element: h('div', { class: 'plots-panel' },
      h('div', { class: 'tools' }, joint, quantity,
        button('Add', 'Add this curve', () => add(record(joint.value, quantity.value as Quantity))),
        button('All joints', 'This quantity of all joints, of the first sixteen at most', () => {
          for (const j of (twin.tree?.moving ?? []).slice(0, 16)) {
            const key = record(j.name, quantity.value as Quantity);
            if (key !== null && !shown.includes(key)) shown.push(key);
          }
          rebuild();
        }),
        button('Clear', 'Remove all curves', () => {
          for (const key of [...shown]) remove(key);
        }),
        h('span', { class: 'spacer' }), width, live,
        button('CSV', 'Save these curves, in radians and metres', () => {
          if (shown.length === 0) toast('There are no curves to save.', 'warning');
          else download('doppel.csv', 'text/csv', recorder.csv(shown));
        })),
      chips, host, h('div', { class: 'timeline' }, scrub, readout)),
    shown: () => {
      endLoads = twin.watchLoads();
      endWatch ??= parameters.watch();
      rebuild();
    },
    hidden: () => {
      endLoads();
      endWatch?.();
      endWatch = null;
      hovered = null;
      goLive();
    },
  };
}
