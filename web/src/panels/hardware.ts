// The devices of the robot, and the twin beside real hardware.
import type { App, Panel } from '../app/app';
import { fill, h, say } from '../app/dom';
import type { Device, DeviceJoint, Devices, MirrorJoint } from '../app/devices';
import { fixed, format, shown, unitOf } from '../app/units';

const COLUMNS = ['joint', 'id', 'position', 'goal', 'load', '°C', 'V', 'age', 'faults'];
const BESIDE = ['joint', 'error', 'rms', 'delay', 'alarm'];
const HIGH = 0.8, WARM = 60;

interface Row {
  cells: HTMLElement[];
  bar: HTMLElement;
}

export function hardwarePanel(app: App, devices: Devices): Panel {
  const { twin } = app;
  const empty = h('p', { class: 'empty' }, 'Nothing received yet.');
  const list = h('div', {});
  const beside = h('tbody', {});
  const mode = h('p', { class: 'muted' });
  const mirror = h('div', { hidden: true }, h('h3', {}, 'The twin beside the hardware'), mode,
    h('table', { class: 'devices mirror' }, h('thead', {}, h('tr', {}, BESIDE.map((text) => h('th', { scope: 'col' }, text)))), beside));
  let drawn = ''; // the joints of the rows
  let compared = '';
  let heads: HTMLElement[] = [];
  let rows: Row[] = [];
  let pairs: HTMLElement[][] = [];

  function row(joint: DeviceJoint): [HTMLElement, Row] {
    const bar = h('i', {});
    const cells = COLUMNS.slice(1).map((column) => h('td', { class: column === 'faults' ? 'faults' : 'num' }));
    return [h('tr', {}, h('th', { scope: 'row' }, joint.name), cells), { cells, bar }];
  }

  function build(all: Device[]): void {
    const names = all.map((one) => [one.name, ...one.joints.map((joint) => joint.name)].join('\n')).join('\n\n');
    if (names === drawn) return;
    drawn = names;
    heads = [];
    rows = [];
    fill(list, all.map((device) => {
      const head = h('p', { class: 'device-state' });
      heads.push(head);
      const lines = device.joints.map((joint) => {
        const [element, made] = row(joint);
        rows.push(made);
        return element;
      });
      return [h('h3', {}, device.name, ' ', h('small', { class: 'muted' }, device.plugin)), head,
        h('table', { class: 'devices' }, h('thead', {}, h('tr', {}, COLUMNS.map((text) => h('th', { scope: 'col' }, text)))), h('tbody', {}, lines))];
    }).flat());
  }

  function position(name: string, value: number): string {
    const joint = twin.tree?.jointByName.get(name);
    return joint && Number.isFinite(value) ? `${format(joint, value)} ${unitOf(joint)}` : fixed(value, 3);
  }

  function showJoint(joint: DeviceJoint, { cells, bar }: Row): void {
    const [id, at, goal, load, warmth, volts, age, faults] = cells as [HTMLElement, HTMLElement, HTMLElement, HTMLElement, HTMLElement, HTMLElement, HTMLElement, HTMLElement];
    say(id, String(joint.id));
    say(at, joint.believed ? `${position(joint.name, joint.position)} believed` : position(joint.name, joint.position));
    at.title = joint.believed ? 'the servo reports no position: this is its command' : '';
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
      const lost = `${device.cycles} cycles, ${device.lost} answers lost, ${device.damaged} damaged`;
      say(heads[i]!, [`${device.component_state}, ${device.state}`, device.port, lost, device.fault].filter((part) => part !== '').join(' · '));
      for (const joint of device.joints) showJoint(joint, rows[next++]!);
    });
  }

  function showPair(one: MirrorJoint, cells: HTMLElement[]): void {
    const [error, rms, delay, alarm] = cells as [HTMLElement, HTMLElement, HTMLElement, HTMLElement];
    const joint = twin.tree?.jointByName.get(one.name);
    const size = (value: number): string => (joint && Number.isFinite(value) ? `${fixed(shown(joint, value), 2)} ${unitOf(joint)}` : '–');
    say(error, size(one.error));
    say(rms, size(one.rms));
    say(delay, Number.isFinite(one.delay) ? `${fixed(one.delay * 1000, 0)} ms` : '–');
    say(alarm, one.alarm !== '' ? `✕ ${one.alarm}` : one.note);
    alarm.classList.toggle('bad', one.alarm !== '');
  }

  function showMirror(): void {
    const now = devices.mirror;
    mirror.hidden = now === null;
    if (!now) return;
    say(mode, `Mode: ${now.mode}.`);
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
    shown: () => devices.watch(true),
    hidden: () => devices.watch(false),
  };
}
