// A row for each joint: slider between limits, value, target, effort.
import type { App, Panel } from '../app/app';
import { copyText, pasteText } from '../app/clipboard';
import { button, fill, h, say, toast } from '../app/dom';
import { parsePose } from '../app/pose_yaml';
import { Seen } from '../app/seen';
import { set, settings, settingsChanged } from '../app/settings';
import { waypointsYaml } from '../app/trajectories';
import { format, meant, rangeOf, unitOf } from '../app/units';
import type { TreeJoint } from '../robot/tree';

const SEARCHED = 12; // joints, from which on there is a field to search them

interface Row {
  joint: TreeJoint;
  element: HTMLElement;
  why: HTMLElement; // why the joint cannot be moved from here
  slider: HTMLInputElement;
  now: HTMLElement;
  value: HTMLElement;
  target: HTMLInputElement;
  effort: HTMLElement;
  filled: boolean; // rows are filled when first visible: there may be a thousand
  held: boolean; // by the user's hand
}

function limitTitle(joint: TreeJoint, end: 'Lower' | 'Upper'): string {
  const limited = Number.isFinite(joint.lower) && Number.isFinite(joint.upper) && joint.upper > joint.lower;
  return limited ? `${end} limit` : 'This joint has no limits';
}

function makeSpeedShare(): HTMLElement {
  const input = h('input', { type: 'range', min: '5', max: '100', value: String(settings.speedShare * 100), 'aria-label': 'Share of the velocity limits' });
  const out = h('output', { class: 'num' }, `${Math.round(settings.speedShare * 100)} %`);
  input.addEventListener('input', () => {
    set('speedShare', Number(input.value) / 100);
    say(out, `${input.value} %`);
  });
  return h('label', { title: 'Share of the velocity limits that commands from this page use' }, 'speed ', input, out);
}

export function jointsPanel(app: App): Panel {
  const { twin, commander } = app;
  const list = h('div', { class: 'joints' });
  const none = h('p', { class: 'empty' });
  const search = h('input', { type: 'text', placeholder: 'search joints', 'aria-label': 'Search joints', spellcheck: false, oninput: () => arrange() });
  const searchRow = h('div', { class: 'search-row', hidden: true }, search);
  let rows: Row[] = [];
  let order = ''; // which of the rows can be moved
  let endLoads = (): void => {};
  const seen = new Seen<Row>((row) => {
    if (!row.filled) fillRow(row);
    show(row);
  });

  function makeRow(joint: TreeJoint): Row {
    const [low, high] = rangeOf(joint);
    const slider = h('input', { type: 'range', min: '0', max: '1', step: 'any', class: 'slider', 'aria-label': `Target of ${joint.name}` });
    const now = h('i', { class: 'now' });
    const effort = h('i', { class: 'effort' });
    const value = h('output', { class: 'value num', title: 'actual position' });
    const target = h('input', { class: 'target num', inputMode: 'decimal', 'aria-label': `Target of ${joint.name} as a number`, title: 'target', spellcheck: false });
    const why = h('span', { class: 'why' });
    const row: Row = { joint, why, slider, now, value, target, effort, filled: false, held: false, element: h('div', { class: `joint${joint.mimic ? ' mimic' : ''}` }) };
    slider.min = String(low);
    slider.max = String(high);
    const command = (): void => commander.set(joint, Number(slider.value));
    slider.addEventListener('input', () => {
      row.held = true;
      command();
    });
    for (const name of ['change', 'blur', 'pointerup']) slider.addEventListener(name, () => (row.held = false));
    slider.addEventListener('keydown', (event) => {
      const fine = (high - low) / (event.shiftKey ? 1000 : 100);
      const step = { ArrowRight: fine, ArrowUp: fine, ArrowLeft: -fine, ArrowDown: -fine }[event.key];
      if (step === undefined) return;
      event.preventDefault();
      commander.set(joint, twin.target[joint.index]! + step);
    });
    target.addEventListener('change', () => {
      const typed = Number(target.value.replace(',', '.'));
      if (Number.isFinite(typed) && target.value.trim() !== '') commander.set(joint, meant(joint, typed));
      target.blur();
    });
    return row;
  }

  function fillRow(row: Row): void {
    const { joint } = row;
    const [low, high] = rangeOf(joint);
    row.filled = true;
    fill(row.element,
      h('button', { type: 'button', class: 'name', title: `${joint.kind}, between ${joint.parent} and ${joint.child}`, onclick: () => app.select({ link: joint.childLink }) }, joint.name),
      joint.mimic ? h('span', { class: 'tag', title: `follows: ${joint.mimic.multiplier} × ${joint.mimic.joint} + ${joint.mimic.offset}` }, `↳ ${joint.mimic.joint}`) : null,
      row.value, joint.mimic ? null : [row.target, h('span', { class: 'unit' }, unitOf(joint))],
      joint.mimic ? null : row.why,
      h('div', { class: 'track' }, row.now, row.slider),
      h('span', { class: 'limit num', title: limitTitle(joint, 'Lower') }, format(joint, low)),
      h('div', { class: 'effort-bar', title: joint.effort > 0 ? `effort; the bar is full at ${joint.effort} ${joint.kind === 'prismatic' ? 'N' : 'N m'}` : 'effort' }, row.effort),
      h('span', { class: 'limit num', title: limitTitle(joint, 'Upper') }, format(joint, high)));
    enableRow(row);
  }

  function build(): void {
    rows = (twin.tree?.moving ?? []).map(makeRow);
    searchRow.hidden = rows.length <= SEARCHED;
    if (searchRow.hidden) search.value = '';
    arrange();
  }

  // Joints that can be moved come first, in the order of the description.
  function arrange(): void {
    const wanted = search.value.trim().toLowerCase();
    const fitting = rows.filter(({ joint }) => joint.name.toLowerCase().includes(wanted));
    const movable = new Map(rows.map((row) => [row, commander.hasMover(row.joint)]));
    const shown = [...fitting.filter((row) => movable.get(row)), ...fitting.filter((row) => !movable.get(row))];
    order = rows.map((row) => Number(movable.get(row))).join('');
    fill(list, shown.length > 0 ? shown.map((row) => row.element) : rows.length > 0 ? h('p', { class: 'empty' }, 'No match.')
      : twin.tree ? h('p', { class: 'empty' }, 'This robot has no joints that move.') : none);
    seen.watch(shown.map((row) => [row.element, row]));
  }

  function enableRow(row: Row): void {
    const can = commander.canMove(row.joint) && !commander.stopped && twin.client.phase !== 'lost';
    const why = row.joint.mimic ? '' : commander.refusal(row.joint);
    row.slider.disabled = row.target.disabled = !can;
    row.element.classList.toggle('off', !can);
    row.element.classList.toggle('fixed', why !== '');
    say(row.why, why);
    row.why.title = why;
    row.slider.title = row.target.title = can ? 'target' : why || (twin.client.phase === 'open' ? 'The emergency stop is on.' : 'There is no connection.');
  }

  function enable(): void {
    if (rows.map((row) => Number(commander.hasMover(row.joint))).join('') !== order) arrange();
    for (const row of rows) if (row.filled) enableRow(row);
    for (const one of [...moves, speedShare]) one.hidden = twin.isReadOnly;
  }

  function update(): void {
    say(none, twin.missing);
    element.classList.toggle('effortless', commander.viewing);
    for (const row of seen) show(row);
  }

  function show(row: Row): void {
    const { joint } = row;
    const [low, high] = [Number(row.slider.min), Number(row.slider.max)];
    const q = twin.q[joint.index]!;
    const target = row.joint.mimic ? q : twin.target[joint.index]!;
    const share = (x: number): number => Math.min(1, Math.max(0, (x - low) / (high - low)));
    row.now.style.transform = `translateX(${(share(q) * 100).toFixed(2)}%)`;
    say(row.value, format(joint, q));
    if (!row.held) row.slider.value = String(target);
    row.slider.style.setProperty('--share', `${(share(Number(row.slider.value)) * 100).toFixed(2)}%`);
    if (document.activeElement !== row.target) {
      const text = format(joint, target);
      if (row.target.value !== text) row.target.value = text;
    }
    const effort = twin.effort[joint.index]!;
    const part = Number.isFinite(effort) && joint.effort > 0 ? Math.max(-1, Math.min(1, effort / joint.effort)) : 0;
    row.effort.style.transform = `scaleX(${part.toFixed(3)})`;
    row.effort.classList.toggle('high', Math.abs(part) > 0.8);
    row.effort.parentElement!.title = Number.isFinite(effort)
      ? `effort ${effort.toFixed(3)} ${joint.kind === 'prismatic' ? 'N' : 'N m'}${joint.effort > 0 ? ` of ${joint.effort}` : ''}` : 'effort not known';
  }

  function all(value: (joint: TreeJoint) => number): void {
    commander.setMany((twin.tree?.moving ?? []).filter((j) => !j.mimic).map((j) => [j, value(j)]));
  }

  // All joints at once: on hardware after a confirmation.
  function allAtOnce(what: string, move: () => void): () => void {
    return () => app.hardware.confirm(what, `All joints move at once, with ${Math.round(settings.speedShare * 100)} % of their velocity limits.`, move);
  }

  function zero(): void {
    const stays = (twin.tree?.moving ?? []).filter((j) => !j.mimic && (j.lower > 0 || j.upper < 0));
    all((j) => (stays.includes(j) ? twin.target[j.index]! : 0));
    if (stays.length > 0) toast(`Zero is outside the limits of ${stays.map((j) => j.name).join(', ')}.`);
  }

  function copy(): void {
    const joints = (twin.tree?.moving ?? []).filter((joint) => !joint.mimic);
    // The duration of the motion from the middle of the limits, so that it can be published from any position.
    const middle = Float64Array.from(twin.tree?.moving ?? [], (j) => (Number.isFinite(j.lower) ? (j.lower + j.upper) / 2 : 0));
    const time = Math.max(2, Math.ceil(2 * commander.timeFor(joints, middle, twin.q)));
    const text = waypointsYaml(twin, commander, [{ time, positions: Float64Array.from(twin.q) }]);
    void copyText(text, 'The pose, as a YAML trajectory,');
  }

  function take(text: string): void {
    const pose = parsePose(text);
    if (!pose) {
      toast('The clipboard contains no trajectory with joint_names and positions.', 'warning');
      return;
    }
    const known: [TreeJoint, number][] = [];
    for (const [name, value] of pose) {
      const joint = twin.tree?.jointByName.get(name);
      if (joint && joint.index >= 0) known.push([joint, value]);
    }
    allAtOnce('Paste', () => {
      commander.setMany(known);
      toast(`${known.length} of ${pose.size} joints of the clipboard are here.`);
    })();
  }

  const unit = (label: string, degrees: boolean): HTMLButtonElement => button(label, degrees ? 'Angles in degrees' : 'Angles in radians', () => set('degrees', degrees), { 'aria-pressed': String(settings.degrees === degrees) });
  const unitButtons = [unit('deg', true), unit('rad', false)];
  const units = h('div', { class: 'segments units', role: 'group', 'aria-label': 'Unit of angles', id: 'units' }, unitButtons);
  // A recording has none of them.
  const moves = [
    button('Zero', 'All joints to zero; one whose limits exclude that stays', allAtOnce('Zero', zero)),
    button('Centre', 'All joints to the middle of their limits', allAtOnce('Centre', () => all((j) => (Number.isFinite(j.lower) ? (j.lower + j.upper) / 2 : 0)))),
    button('Random', 'All joints somewhere within their limits', allAtOnce('Random', () => all((j) => {
      const [low, high] = rangeOf(j);
      return low + (high - low) * Math.random();
    }))),
    button('Paste', 'Go to the pose on the clipboard', () => void pasteText('Go to a pose', take)),
  ];
  const speedShare = makeSpeedShare();
  const element = h('div', { class: 'joints-panel' },
    h('div', { class: 'tools' },
      moves.slice(0, 3), button('Copy', 'Copy the pose as a YAML trajectory', copy), moves.slice(3),
      h('span', { class: 'spacer' }), units),
    searchRow, list,
    h('div', { class: 'legend' },
      h('span', {}, h('i', { class: 'key now-key' }), 'actual'), h('span', {}, h('i', { class: 'key target-key' }), 'target'),
      h('span', { class: 'effort-legend' }, h('i', { class: 'key effort-key' }), 'effort'), h('span', { class: 'spacer' }),
      speedShare));

  fill(list, none);
  twin.robotChanged.on(build);
  twin.controllersChanged.on(enable);
  twin.phaseChanged.on(enable);
  enable();
  commander.stopChanged.on(enable);
  settingsChanged.on((key) => {
    if (key !== 'degrees') return;
    unitButtons.forEach((one, i) => one.setAttribute('aria-pressed', String(settings.degrees === (i === 0))));
    build();
  });
  app.selected.on((selection) => {
    for (const row of rows) row.element.classList.toggle('selected', selection?.link === row.joint.childLink);
    rows.find((row) => selection?.link === row.joint.childLink)?.element.scrollIntoView({ block: 'nearest' });
  });
  return {
    id: 'joints', title: 'Joints', element, rate: 20, update,
    shown: () => (endLoads = twin.watchLoads()),
    hidden: () => endLoads(),
  };
}
