// The devices of the robot, and the twin beside real hardware.
import type { App, Panel } from '../app/app';
import { button, fill, h, say, toast } from '../app/dom';
import type { Device, DeviceJoint, Devices, MirrorJoint } from '../app/devices';
import { settings } from '../app/settings';
import { fixed, format, meant, shown, unitOf } from '../app/units';
import type { EvidenceGhost } from '../scene/evidence_ghost';

const COLUMNS = ['joint', 'id', 'position', 'goal', 'load', '°C', 'V', 'age', 'faults'];
const BESIDE = ['joint', 'error', 'rms', 'delay', 'alarm'];
const HIGH = 0.8, WARM = 60;

// The states of a device: in words, and how they are marked.
const STATES: Record<string, [text: string, level: string]> = {
  disconnected: ['not connected', 'error'],
  connected: ['connected, torque off', 'warning'],
  unconfirmed: ['pose not confirmed', 'warning'],
  holding: ['holds', 'active'],
  active: ['follows commands', 'active'],
  gentle: ['follows commands at a quarter of the speed', 'warning'],
  degraded: ['answers are missing: all joints hold', 'error'],
  fault: ['fault', 'error'],
};
const MODES: Record<string, string> = {
  shadow: 'shadow: the twin gets the commands of the hardware, and the ghost is where it is',
  rehearse: 'rehearse: a goal runs on the twin first, and is sent if nothing forbids it; then the twin gets the same commands',
  follow: 'follow: the twin is where the measured joints are',
  off: 'off: the twin gets nothing',
};

interface Row {
  cells: HTMLElement[];
  bar: HTMLElement;
}

interface Head {
  tag: HTMLElement;
  facts: HTMLElement;
  fault: HTMLElement;
  activate: HTMLButtonElement;
  pose: HTMLElement; // the form of its confirmation
}

export function hardwarePanel(app: App, devices: Devices, ghost: EvidenceGhost): Panel {
  const { twin } = app;
  const empty = h('p', { class: 'empty' }, 'Nothing received yet.');
  const list = h('div', {});
  const beside = h('tbody', {});
  const mode = h('p', { class: 'muted' });
  const mirror = h('div', { hidden: true }, h('h3', {}, 'The twin beside the hardware'), mode,
    h('div', { class: 'wide-table' }, h('table', { class: 'devices mirror' }, h('thead', {}, h('tr', {}, BESIDE.map((text) => h('th', { scope: 'col', class: text === 'joint' || text === 'alarm' ? '' : 'num' }, text)))), beside)));
  let drawn = ''; // the joints of the rows
  let compared = '';
  let heads: Head[] = [];
  let rows: Row[] = [];
  let pairs: HTMLElement[][] = [];

  function row(joint: DeviceJoint): [HTMLElement, Row] {
    const bar = h('i', {});
    const cells = COLUMNS.slice(1).map((column) => h('td', { class: column === 'faults' ? 'faults' : 'num' }));
    return [h('tr', {}, h('th', { scope: 'row' }, joint.name), cells), { cells, bar }];
  }

  function build(all: Device[]): void {
    const names = `${settings.degrees} ${twin.tree !== null}\n${all.map((one) => [one.name, ...one.joints.map((joint) => joint.name)].join('\n')).join('\n\n')}`;
    if (names === drawn) return;
    drawn = names;
    heads = [];
    rows = [];
    fill(list, all.map((device) => {
      const head: Head = {
        tag: h('span', { class: 'tag' }), facts: h('p', { class: 'muted device-facts num' }), fault: h('p', { class: 'error', role: 'alert' }),
        activate: button('Activate', `Turn the torque of ${device.name} on, where its joints are`, () => void devices.hold().then((why) => why && toast(why, 'error')), { class: 'device-activate' }),
        pose: poseForm(device),
      };
      heads.push(head);
      const lines = device.joints.map((joint) => {
        const [element, made] = row(joint);
        rows.push(made);
        return element;
      });
      return [h('h3', {}, device.name, ' ', h('small', { class: 'muted' }, device.plugin)),
        h('div', { class: 'row' }, head.tag, h('span', { class: 'spacer' }), head.activate), head.facts, head.fault, head.pose,
        h('div', { class: 'wide-table' }, h('table', { class: 'devices' }, h('thead', {}, h('tr', {}, COLUMNS.map((text) => h('th', { scope: 'col', class: text === 'joint' || text === 'faults' ? '' : 'num' }, text)))), h('tbody', {}, lines)))];
    }).flat());
  }

  // A person says where the joints of servos are that report nothing: the picture shows what is entered.
  function poseForm(device: Device): HTMLElement {
    const joints = device.joints.flatMap(({ name }) => twin.tree?.jointByName.get(name) ?? []);
    const inputs = joints.map((joint) => h('input', { type: 'number', step: 'any', class: 'num', value: format(joint, device.joints.find(({ name }) => name === joint.name)!.position), 'aria-label': `Position of ${joint.name} in ${unitOf(joint)}`, oninput: () => show() }));
    const entered = (): number[] => joints.map((joint, i) => (inputs[i]!.value === '' ? NaN : meant(joint, Number(inputs[i]!.value))));
    function show(): void {
      const at = entered();
      ghost.show({ caption: 'the pose that is entered', joints: Object.fromEntries(joints.map((joint, i) => [joint.name, Number.isFinite(at[i]) ? at[i]! : null])), links: [], command: '' });
    }
    const why = h('p', { class: 'error', role: 'alert', hidden: true });
    async function send(): Promise<void> {
      const refused = await devices.confirmPose(device.name, joints.map((joint) => joint.name), entered());
      say(why, refused);
      why.hidden = refused === '';
      if (refused !== '') return;
      ghost.show(null);
      toast('The pose is confirmed until the device loses its power. A start that waited for it turns the torque on; otherwise activate it.');
    }
    const confirm = button('Confirm this pose …', 'The arm stands as the picture shows it', () =>
      app.hardware.confirm('Confirm this pose', 'Does the arm stand as the picture shows it? Its torque goes on; where it stands otherwise, it jumps.', () => void send(), true), { class: 'on device-confirm' });
    return h('section', { class: 'device-pose', 'aria-label': `Pose of ${device.name}` },
      h('p', {}, h('strong', {}, 'Where does the arm stand?'), ' It has been without power, and its servos report no position. Enter the pose in which you see it, and compare it with the picture.'),
      h('div', { class: 'device-joints' }, joints.map((joint, i) => h('label', {}, h('span', {}, joint.name), inputs[i]!, h('span', { class: 'muted' }, unitOf(joint))))),
      why, h('div', { class: 'row' }, button('Show', 'Show the entered pose in the picture', show, { class: 'small' }), h('span', { class: 'spacer' }), confirm));
  }

  function position(name: string, value: number): string {
    const joint = twin.tree?.jointByName.get(name);
    return joint && Number.isFinite(value) ? `${format(joint, value)} ${unitOf(joint)}` : fixed(value, 3);
  }

  function showJoint(joint: DeviceJoint, { cells, bar }: Row): void {
    const [id, at, goal, load, warmth, volts, age, faults] = cells as [HTMLElement, HTMLElement, HTMLElement, HTMLElement, HTMLElement, HTMLElement, HTMLElement, HTMLElement];
    say(id, String(joint.id));
    say(at, joint.believed ? `(${position(joint.name, joint.position)})` : position(joint.name, joint.position));
    at.title = joint.believed ? 'believed: the servo reports no position, and this is its command' : '';
    at.classList.toggle('believed', joint.believed);
    say(goal, position(joint.name, joint.goal));
    if (!Number.isFinite(joint.load)) {
      say(load, '–');
    } else {
      const share = Math.abs(joint.load);
      if (!bar.parentElement) fill(load, h('span', { class: 'gauge' }, bar));
      bar.style.width = `${Math.min(100, share * 100)}%`;
      bar.className = share > HIGH ? 'over' : '';
      load.title = `${fixed(share * 100, 0)} %`;
    }
    say(warmth, fixed(joint.temperature, 0));
    warmth.classList.toggle('bad', joint.temperature >= WARM);
    say(volts, fixed(joint.voltage, 1));
    say(age, Number.isFinite(joint.age) ? `${fixed(joint.age * 1000, 0)} ms` : '–');
    say(faults, joint.faults);
    faults.classList.toggle('bad', joint.faults !== '');
  }

  function showDevices(): void {
    empty.hidden = devices.all.length > 0;
    build(devices.all);
    let next = 0;
    devices.all.forEach((device, i) => {
      showHead(device, heads[i]!);
      for (const joint of device.joints) showJoint(joint, rows[next++]!);
    });
  }

  function showHead(device: Device, head: Head): void {
    const stopped = app.commander.stopped && ['active', 'gentle', 'holding'].includes(device.state);
    const [text, level] = stopped ? ['stopped, holds', 'warning'] : STATES[device.state] ?? [device.state, ''];
    say(head.tag, text);
    head.tag.className = `tag ${level}`;
    // An active component is not worth a word; why another one waits is.
    const life = device.component_state === 'active' ? '' : `component ${device.component_state}`;
    const count = (value: bigint): string => value.toLocaleString('en');
    const believed = device.joints.some((joint) => joint.believed) ? 'positions in brackets are believed, not measured' : '';
    say(head.facts, [life, device.port === 'auto' ? '' : device.port, `${count(device.cycles)} cycles`, `${count(device.lost)} answers lost`, `${count(device.damaged)} damaged`, believed].filter((part) => part !== '').join(' · '));
    say(head.fault, device.fault === '' ? '' : `✕ ${device.fault}`);
    head.fault.hidden = device.fault === '';
    const waits = device.component_state === 'inactive' || device.component_state === 'unconfigured';
    head.activate.hidden = !waits || device.state === 'unconfirmed';
    const asks = device.state === 'unconfirmed';
    if (head.pose.hidden !== !asks && !asks) ghost.show(null);
    head.pose.hidden = !asks;
  }

  function showPair(one: MirrorJoint, cells: HTMLElement[]): void {
    const [error, rms, delay, alarm] = cells as [HTMLElement, HTMLElement, HTMLElement, HTMLElement];
    const joint = twin.tree?.jointByName.get(one.name);
    const size = (value: number): string => (joint && Number.isFinite(value) ? `${fixed(shown(joint, value), 2)} ${unitOf(joint)}` : '–');
    say(error, one.believed ? 'believed' : size(one.error));
    error.classList.toggle('believed', one.believed);
    say(rms, size(one.rms));
    say(delay, Number.isFinite(one.delay) ? `${fixed(one.delay * 1000, 0)} ms` : '–');
    say(alarm, one.alarm !== '' ? `✕ ${one.alarm}` : one.note);
    alarm.classList.toggle('bad', one.alarm !== '');
  }

  function showMirror(): void {
    const now = devices.mirror;
    mirror.hidden = now === null;
    if (!now) return;
    say(mode, `Mode ${MODES[now.mode] ?? now.mode}.`);
    const names = now.joints.map((one) => one.name).join('\n');
    if (names !== compared) {
      compared = names;
      pairs = now.joints.map(() => BESIDE.slice(1).map((column) => h('td', { class: column === 'alarm' ? 'faults' : 'num' })));
      fill(beside, now.joints.map((one, i) => h('tr', {}, h('th', { scope: 'row' }, one.name), pairs[i]!)));
    }
    now.joints.forEach((one, i) => showPair(one, pairs[i]!));
  }

  let alarmed = 0;
  devices.mirrored.on(() => {
    if (devices.alarms.length === alarmed) return;
    alarmed = devices.alarms.length;
    app.tabsChanged.emit();
  });

  return {
    id: 'hardware', title: 'Hardware', rate: 5,
    element: h('div', { class: 'padded' }, empty, list, mirror),
    applies: () => devices.offered,
    badge: () => (alarmed === 0 ? null : { text: `✕ ${alarmed}`, level: 'error', title: `${alarmed} ${alarmed === 1 ? 'joint is' : 'joints are'} not where the twin is` }),
    update: () => {
      showDevices();
      showMirror();
    },
    shown: () => devices.watch('hardware', true),
    hidden: () => {
      devices.watch('hardware', false);
      ghost.show(null);
    },
  };
}
