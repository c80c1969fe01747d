// Calibrate: guides through the two poses of each joint that give its zero, direction and scale, with the pose in the picture.
import type { App, Badge, Panel } from '../app/app';
import type { Calibration, JointCalibration } from '../app/calibration';
import { button, fill, h, say, toast } from '../app/dom';
import type { Device, DeviceJoint, Devices } from '../app/devices';
import { fixed, format, meant, rangeOf, shown, unitOf } from '../app/units';
import type { CalibrationGhost } from '../scene/calibration_ghost';
import type { TreeJoint } from '../robot/tree';

const SCALE_TOLERANCE = 0.02; // see review/calibration
const AT_POSE = 0.05; // rad or m: near enough that the live value is marked
const PARTS = ['A', 'B'] as const;

type Stage = 'cannot' | 'open' | 'half' | 'refused' | 'right' | 'result' | 'written';
const STAGES: Record<Stage, [text: string, level: string]> = {
  cannot: ['range too small', ''],
  open: ['not measured', ''],
  half: ['1 of 2 poses', 'warning'],
  refused: ['no result', 'error'],
  right: ['✓ correct', 'active'],
  result: ['to be written', 'warning'],
  written: ['✓ written', 'active'],
};

function stageOf(one: JointCalibration): Stage {
  if (one.measurements.length === 0) return one.written ? 'written' : one.poses.length === 0 ? 'cannot' : 'open';
  if (one.problem) return 'refused';
  if (!one.fitted) return 'half';
  return one.corrections.length === 0 ? 'right' : 'result';
}
const isDone = (one: JointCalibration): boolean => ['right', 'written', 'cannot'].includes(stageOf(one));

export function calibratePanel(app: App, calibration: Calibration, devices: Devices, ghost: CalibrationGhost): Panel {
  const { twin } = app;
  let chosen = '';
  let visible = false;
  let step = 0; // of the chosen joint: the pose that is to be made
  const poses = new Map<string, number[]>(); // by joint, where they are other ones than suggested

  const torque = h('span', { class: 'tag' }), arm = h('p', { class: 'muted' });
  const release = button('Release the torque', 'Turn the torque of all joints off, so that a hand moves them', () =>
    app.hardware.confirm('Release the torque', 'What the arm holds falls, unless it is supported.', () => void calibration.release(), true), { id: 'calibrate-release' });
  const hold = button('Hold', 'Turn the torque on where the joints are', () => void calibration.hold(), { id: 'calibrate-hold' });
  const bar = h('progress', { max: 1, 'aria-label': 'Joints that are calibrated' });
  const progress = h('p', { class: 'muted', role: 'status' });
  const problem = h('p', { class: 'error', role: 'alert' });
  const list = h('div', { class: 'calibrate-list' });
  const writeAll = button('Write all …', 'Write the corrections of all measured joints', () => confirmWrite(calibration.joints.filter((one) => stageOf(one) === 'result')), { id: 'calibrate-write-all' });
  const undo = button('Undo', 'The overlay becomes as it was before the last correction', () => void takeBack(), { id: 'calibrate-undo' });
  const written = h('p', { class: 'muted calibrate-file' });

  interface Row {
    element: HTMLDetailsElement;
    tag: HTMLElement;
    body: HTMLElement;
    live: HTMLElement | null;
    drawn: string; // what the body shows
  }
  const rows = new Map<string, Row>();

  const treeJoint = (name: string): TreeJoint | undefined => twin.tree?.jointByName.get(name);
  function text(name: string, value: number, digits = 2): string {
    const joint = treeJoint(name);
    return joint ? `${fixed(shown(joint, value), digits)}\u00a0${unitOf(joint)}` : fixed(value, 4);
  }
  function reported(name: string): [Device, DeviceJoint] | null {
    for (const device of devices.all) {
      const joint = device.joints.find((one) => one.name === name);
      if (joint) return [device, joint];
    }
    return null;
  }
  const posesOf = (one: JointCalibration): number[] => poses.get(one.joint) ?? one.poses;
  const isMeasured = (one: JointCalibration, pose: number): boolean => one.measurements.some(({ model }) => Math.abs(model - pose) < 1e-6);

  async function takeBack(): Promise<void> {
    const joints = calibration.undoJoints.join(', ');
    if (await calibration.undo()) toast(`The correction of ${joints} is taken back.`);
  }

  function confirmWrite(all: JointCalibration[]): void {
    const what = all.length === 1 ? `Write the correction of ${all[0]!.joint}` : `Write the corrections of ${all.length} joints`;
    const changes = all.flatMap((one) => one.corrections).join('; ');
    app.hardware.confirm(what, `${changes}. It goes into the overlay beside the description, and the model changes with it. Remove driver offsets of the same joints: in both places they act twice.`, () => void write(all), true);
  }
  async function write(all: JointCalibration[]): Promise<void> {
    const names = all.map((one) => one.joint);
    if (await calibration.write(names)) toast(`Written: ${names.join(', ')}.`);
  }

  async function measure(one: JointCalibration, pose: number): Promise<void> {
    if (!(await calibration.measure(one.joint, pose))) return;
    const next = posesOf(one).findIndex((other) => other !== pose && !isMeasured(one, other));
    if (next >= 0) step = next;
    refresh(true);
  }

  // -- one joint

  function poseStep(one: JointCalibration, joint: TreeJoint, i: number): HTMLElement {
    const pose = posesOf(one)[i]!;
    const found = one.measurements.find(({ model }) => Math.abs(model - pose) < 1e-6);
    const input = h('input', { type: 'number', step: 'any', value: String(+shown(joint, pose).toFixed(4)), class: 'num', 'aria-label': `Pose ${PARTS[i]} of ${one.joint} in ${unitOf(joint)}`, disabled: found !== undefined, onchange: () => {
      const value = meant(joint, Number(input.value));
      if (input.value === '' || !Number.isFinite(value)) return;
      const all = [...posesOf(one)];
      all[i] = value;
      poses.set(one.joint, all);
      step = i;
      refresh(true);
    } });
    const current = step === i && !found;
    const show = button(`Pose ${PARTS[i]}`, `Show pose ${PARTS[i]} in the picture`, () => {
      step = i;
      refresh(true);
    }, { 'aria-pressed': String(step === i), class: 'small' });
    const take = button(calibration.measuring === one.joint ? 'Measuring …' : 'Measure', `The joint stands in pose ${PARTS[i]}: measure it`, () => void measure(one, pose), { class: current ? 'on' : '', disabled: calibration.busy || calibration.measuring !== '', id: `calibrate-measure-${i}` });
    return h('li', { class: current ? 'current' : '' },
      h('div', { class: 'row' }, show, input, h('span', { class: 'muted' }, unitOf(joint)), h('span', { class: 'spacer' }),
        found ? h('span', { class: 'calibrate-read num' }, `✓ ${text(one.joint, found.machine)}`) : take));
  }

  function handSlider(one: JointCalibration, joint: TreeJoint): HTMLElement | null {
    if (!calibration.guided || !isLoose()) return null;
    const [low, high] = rangeOf(joint);
    const slider = h('input', { type: 'range', min: String(low), max: String(high), step: 'any', value: String(twin.q[joint.index] ?? 0), 'aria-label': `Hand at ${one.joint}`, oninput: () => void calibration.guide(one.joint, Number(slider.value)) });
    return h('label', { class: 'calibrate-hand' }, h('span', {}, 'Hand of the emulation'), slider);
  }

  function resultView(one: JointCalibration): (HTMLElement | null)[] {
    if (one.problem) return [h('p', { class: 'error' }, `✗ ${one.problem}`)];
    if (!one.fitted) return [];
    const off = Math.abs(one.scale - 1) > SCALE_TOLERANCE;
    const lines: [string, string, string][] = [
      ['at the zero', text(one.joint, one.zero), Math.abs(one.zero) < 1e-9 ? 'was right' : `was wrong by ${text(one.joint, Math.abs(one.zero))}`],
      ['direction', one.direction < 0 ? 'the other way' : 'the same', one.direction < 0 ? 'was reversed' : 'was right'],
      ['scale', one.scale.toPrecision(4), off ? 'to be set in the driver' : 'within 2 % of 1'],
      ['residual', text(one.joint, one.residual), ''],
    ];
    return [
      h('table', { class: 'calibrate-result' }, h('caption', {}, 'What the machine reads'), h('tbody', {}, lines.map(([name, value, wrong]) => h('tr', {}, h('th', { scope: 'row' }, name), h('td', { class: 'num' }, value), h('td', { class: wrong.startsWith('was wrong') || wrong === 'was reversed' || (off && name === 'scale') ? 'warning' : 'muted' }, wrong))))),
      ...one.warnings.map((warning) => h('p', { class: 'warning' }, `! ${warning}`)),
      one.corrections.length === 0 ? h('p', { class: 'muted' }, 'Nothing is to be corrected.')
        : h('div', {}, h('p', { class: 'muted' }, 'The correction changes the model, not the driver:'), h('ul', { class: 'calibrate-corrections' }, one.corrections.map((line) => h('li', {}, h('code', {}, line))))),
    ];
  }

  function bodyOf(one: JointCalibration, joint: TreeJoint, row: Row): void {
    row.live = h('strong', { class: 'num' });
    if (posesOf(one).length < 2) {
      fill(row.body, h('p', { class: 'muted' }, 'The limits of this joint are less than 60° apart: two poses would not tell its scale from a reading error.'));
      return;
    }
    const believed = reported(one.joint)?.[1].believed ?? false;
    const pose = posesOf(one)[step] ?? 0;
    fill(row.body,
      h('p', {}, believed ? 'Command the joint (Joints) until the arm stands as the coloured links in the picture.' : isLoose() ? 'Bring the joint by hand to where the coloured links are in the picture.' : 'Bring the joint, by its slider (Joints) or by hand, to where the coloured links are in the picture.',
        ` Pose ${PARTS[step] ?? 'A'}: ${text(one.joint, pose)}.`),
      h('p', { class: 'calibrate-live' }, believed ? 'commanded now: ' : 'the servo reads now: ', row.live),
      handSlider(one, joint),
      h('ol', { class: 'calibrate-steps' }, PARTS.map((_, i) => poseStep(one, joint, i))),
      ...resultView(one),
      one.measurements.length > 0 ? h('div', { class: 'row' }, button('Start again', `Forget the measurements of ${one.joint}`, () => {
        step = 0;
        void calibration.forget(one.joint);
      }, { id: 'calibrate-forget', disabled: calibration.busy }), h('span', { class: 'spacer' }),
      stageOf(one) === 'result' ? button('Write …', `Write the correction of ${one.joint} into the overlay`, () => confirmWrite([one]), { class: 'on', id: 'calibrate-write', disabled: calibration.busy }) : null) : null);
  }

  // -- the whole

  // The joint's torque is off, and the component waits.
  function isLoose(): boolean {
    return devices.all.length > 0 && devices.all.every((device) => device.state === 'connected');
  }

  function choose(name: string): void {
    if (chosen === name) return;
    chosen = name;
    const one = calibration.joints.find((other) => other.joint === name);
    step = one ? Math.max(0, posesOf(one).findIndex((pose) => !isMeasured(one, pose))) : 0;
    refresh(true);
  }

  function rowOf(one: JointCalibration): Row {
    const present = rows.get(one.joint);
    if (present) return present;
    const tag = h('span', { class: 'tag' }), body = h('div', { class: 'calibrate-body' });
    const row: Row = { tag, body, live: null, drawn: '', element: h('details', { class: 'calibrate-joint', name: 'calibrate-joint', ontoggle: () => {
      if (row.element.open) choose(one.joint);
      else if (chosen === one.joint) choose('');
    } }, h('summary', {}, h('span', { class: 'calibrate-name' }, one.joint), tag), body) };
    row.element.dataset['joint'] = one.joint;
    rows.set(one.joint, row);
    return row;
  }

  function showRow(one: JointCalibration, redraw: boolean): void {
    const row = rowOf(one);
    const [label, level] = STAGES[stageOf(one)];
    say(row.tag, calibration.measuring === one.joint ? 'measuring …' : label);
    row.tag.className = `tag ${level}`;
    const joint = treeJoint(one.joint);
    if (chosen !== one.joint || !joint) return;
    const state = JSON.stringify([one, step, posesOf(one), calibration.busy, calibration.measuring, isLoose(), calibration.guided]);
    if (state === row.drawn && !redraw) return;
    row.drawn = state;
    const focused = row.body.contains(document.activeElement) ? document.activeElement?.id : '';
    bodyOf(one, joint, row);
    if (focused) document.getElementById(focused)?.focus();
  }

  function showArm(): void {
    const loose = isLoose(), unconfirmed = devices.all.some((device) => device.state === 'unconfirmed');
    const known = devices.all.length > 0;
    const believed = devices.all.some((device) => device.joints.some((one) => one.believed));
    say(torque, !known ? '' : loose ? 'torque off' : unconfirmed ? 'pose not confirmed' : 'holds');
    torque.className = `tag ${loose || unconfirmed ? 'warning' : 'active'}`;
    torque.hidden = !known;
    say(arm, loose ? 'A hand moves the joints.' : believed ? 'These servos report no position: what they are commanded is measured.' : 'Commands move the joints; without torque a hand does.');
    release.hidden = loose || believed;
    hold.hidden = !loose;
    for (const one of [release, hold]) one.disabled = calibration.busy;
  }

  function refresh(redraw = false): void {
    const all = calibration.joints;
    for (const [name, row] of rows) {
      if (all.some((one) => one.joint === name)) continue;
      row.element.remove();
      rows.delete(name);
    }
    all.forEach((one, i) => {
      const { element } = rowOf(one);
      if (list.children[i] !== element) list.insertBefore(element, list.children[i] ?? null);
      showRow(one, redraw);
    });
    const done = all.filter(isDone).length, left = all.filter((one) => !isDone(one)).map((one) => one.joint);
    bar.value = all.length === 0 ? 0 : done / all.length;
    say(progress, left.length === 0 ? 'All joints are calibrated.' : `${done} of ${all.length} joints are done. Left: ${left.join(', ')}.`);
    say(problem, calibration.problem);
    problem.hidden = calibration.problem === '';
    writeAll.hidden = all.filter((one) => stageOf(one) === 'result').length < 2;
    undo.hidden = calibration.undoJoints.length === 0;
    writeAll.disabled = undo.disabled = calibration.busy;
    say(written, calibration.file === '' ? '' : `Written: ${calibration.undoJoints.join(', ')}, to ${calibration.file}`);
    showArm();
    const one = visible ? all.find((other) => other.joint === chosen) : undefined;
    const pose = one ? posesOf(one)[step] : undefined;
    ghost.show(one && pose !== undefined ? { joint: one.joint, position: pose } : null);
    app.tabsChanged.emit();
  }

  function badge(): Badge | null {
    const waiting = calibration.joints.filter((one) => stageOf(one) === 'result').length;
    return waiting === 0 ? null : { text: String(waiting), level: 'warning', title: `${waiting} ${waiting === 1 ? 'correction is' : 'corrections are'} not written` };
  }

  // The live value, which changes too often to draw the row anew.
  function showLive(): void {
    const row = rows.get(chosen), joint = treeJoint(chosen), found = reported(chosen);
    if (!row?.live || !joint) return;
    const position = found?.[1].position ?? NaN;
    say(row.live, Number.isFinite(position) ? `${format(joint, position)} ${unitOf(joint)}` : '–');
    const one = calibration.joints.find((other) => other.joint === chosen);
    row.live.classList.toggle('there', one !== undefined && Math.abs((posesOf(one)[step] ?? NaN) - position) < AT_POSE);
  }

  calibration.changed.on(() => refresh());
  devices.changed.on(() => {
    if (!visible) return;
    refresh();
    showLive();
  });
  twin.robotChanged.on(() => {
    poses.clear();
    refresh(true);
  });
  refresh();

  return {
    id: 'calibrate', title: 'Calibrate', rate: 5,
    applies: () => calibration.offered,
    badge,
    element: h('div', { class: 'padded calibrate' },
      h('p', { class: 'muted' }, 'Two poses of a joint, at least 60° apart, give its zero, direction and scale.'),
      h('div', { class: 'row' }, torque, h('span', { class: 'spacer' }), release, hold), arm,
      bar, progress, problem, list, h('div', { class: 'row' }, writeAll, undo), written),
    update: showLive,
    shown: () => {
      visible = true;
      devices.watch('calibrate', true);
      const next = calibration.joints.find((one) => !isDone(one));
      if (chosen === '' && next) rowOf(next).element.open = true;
      refresh(true);
    },
    hidden: () => {
      visible = false;
      devices.watch('calibrate', false);
      ghost.show(null);
    },
  };
}
