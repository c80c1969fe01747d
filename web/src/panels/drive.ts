// Driving the base: a pad that drives while it is held, speeds, the gamepad, the stop.
import type { App, Panel } from '../app/app';
import { h, say, toggle } from '../app/dom';
import type { Drive } from '../app/drive';
import type { Jog } from '../app/jog';

const ARROWS: Record<string, [number, number, number]> = {
  ArrowUp: [1, 0, 0], ArrowDown: [-1, 0, 0], ArrowLeft: [0, 0, 1], ArrowRight: [0, 0, -1],
};

export function drivePanel(app: App, drive: Drive, jog: Jog): Panel {
  const { twin } = app;
  const knob = h('i', { class: 'knob' });
  const pad = h('div', { class: 'drive-pad', id: 'drive-pad', tabIndex: 0, role: 'application', 'aria-label': 'Drive: hold and pull; arrow keys drive while they are held' }, knob);
  const where = h('p', { class: 'muted', role: 'status' });
  const now = h('output', { class: 'num', id: 'drive-now' });
  const gamepad = h('p', { class: 'muted' });
  let pulled: [number, number] = [0, 0];

  function show(): void {
    const { x, yaw } = drive.velocity;
    say(now, `${x.toFixed(2)} m/s, ${yaw.toFixed(2)} rad/s`);
    pad.classList.toggle('live', drive.live);
    const [right, up] = drive.live ? pulled : [0, 0];
    knob.style.transform = `translate(${right * 150}%, ${-up * 150}%)`;
  }
  function pull(event: PointerEvent): void {
    const box = pad.getBoundingClientRect();
    const share = (value: number): number => Math.max(-1, Math.min(1, value));
    pulled = [share((event.clientX - box.left) / box.width * 2 - 1), share(1 - (event.clientY - box.top) / box.height * 2)];
    drive.hold(pulled[1], 0, -pulled[0]);
  }
  pad.addEventListener('pointerdown', (event) => {
    pad.setPointerCapture(event.pointerId);
    pull(event);
  });
  pad.addEventListener('pointermove', (event) => {
    if (pad.hasPointerCapture(event.pointerId)) pull(event);
  });
  for (const name of ['pointerup', 'pointercancel', 'lostpointercapture', 'blur']) pad.addEventListener(name, () => drive.release());
  const held = new Set<string>();
  const fromKeys = (): void => {
    const sum = [...held].reduce<[number, number, number]>((all, key) => [all[0] + ARROWS[key]![0], 0, all[2] + ARROWS[key]![2]], [0, 0, 0]);
    pulled = [-sum[2], sum[0]];
    if (held.size > 0) drive.hold(...sum);
    else drive.release();
  };
  pad.addEventListener('keydown', (event) => {
    if (!(event.key in ARROWS)) return;
    event.preventDefault();
    event.stopPropagation(); // the page's own keys turn the picture
    held.add(event.key);
    fromKeys();
  });
  pad.addEventListener('keyup', (event) => {
    if (held.delete(event.key)) fromKeys();
  });
  pad.addEventListener('blur', () => held.clear());
  drive.changed.on(show);
  jog.padChanged.on((state) => say(gamepad, state ? `${state.name}: ${state.live ? 'live' : 'hold a shoulder button to drive'}` : ''));

  const number = (label: string, value: number, change: (value: number) => void): HTMLElement => {
    const input: HTMLInputElement = h('input', { type: 'number', min: '0', step: '0.1', class: 'num', value: String(value), 'aria-label': label, onchange: () => {
      const typed = Number(input.value);
      if (Number.isFinite(typed) && typed > 0) change(typed);
    } });
    return h('label', {}, label, ' ', input);
  };
  // The sticks as of most gamepads: the left one drives.
  const useGamepad = toggle('The gamepad drives the base', 'Left stick: ahead and turn, while a shoulder button is held; off: it moves the tool', false, (on) => {
    let live = false; // the pad and the keys drive while the gamepad does not
    jog.base = on ? (axes) => {
      if (axes) {
        live = true;
        pulled = [axes[0] ?? 0, -(axes[1] ?? 0)];
        drive.hold(pulled[1], 0, -pulled[0]);
      } else if (live) {
        live = false;
        drive.release();
      }
    } : null;
    drive.release();
  });
  const controls = h('div', { class: 'drive' }, pad, h('div', { class: 'drive-fields' }, now,
    number('Speed, m/s', drive.speed, (v) => (drive.speed = v)), number('Turn, rad/s', drive.turn, (v) => (drive.turn = v)), useGamepad, gamepad));
  const element = h('div', { class: 'padded' }, where, controls);
  show();
  return {
    id: 'drive', title: 'Drive', element, rate: 4,
    applies: () => drive.applies,
    update: () => {
      const topic = drive.topic();
      controls.hidden = topic === null && twin.controllers.length > 0;
      say(where, topic ? `${topic.name}, while the pad is held` : twin.client.phase === 'open' ? 'No controller of a base is active; Control activates it.' : 'No connection.');
    },
    hidden: () => drive.release(),
  };
}
