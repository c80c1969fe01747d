// The tool: its link, its pose, its goal; jogging; pushing.
import type { App, Panel } from '../app/app';
import { button, fill, h, say, toggle } from '../app/dom';
import type { Jog } from '../app/jog';
import { set, settings } from '../app/settings';
import type { ToolDriver } from '../app/tool';
import { millimetres } from '../app/units';
import { STRIDE } from '../robot/tree';
import type { ToolHandle } from '../scene/handle';
import type { Pusher } from '../scene/push';

const AXES = ['x', 'y', 'z'] as const;

export function toolPanel(app: App, driver: ToolDriver, handle: ToolHandle, jog: Jog, pusher: Pusher): Panel {
  const { twin, world } = app;
  const link = h('select', { id: 'tool-link', onchange: () => world.setTool(Number(link.value)) });
  const is = AXES.map(() => h('td', { class: 'num' }));
  const goal = AXES.map((axis) => h('input', { class: 'num', inputMode: 'decimal', 'aria-label': `Goal ${axis} in millimetres`, id: `goal-${axis}` }));
  const state = h('p', { class: 'reach', role: 'status' });
  const pad = h('p', { class: 'muted' }, 'No gamepad. Press a button on it to be seen.');
  const jointName = h('strong', {});
  const force = h('output', { class: 'num muted' });

  function go(): void {
    const pose = driver.commanded();
    if (!pose) return;
    goal.forEach((input, i) => {
      const typed = Number(input.value.replace(',', '.'));
      if (Number.isFinite(typed) && input.value.trim() !== '') pose[i] = typed / 1000;
    });
    driver.setGoal(pose);
  }
  for (const input of goal) input.addEventListener('keydown', (event) => {
    if (event.key === 'Enter') go();
  });
  const mode = (name: 'translate' | 'rotate', label: string): HTMLButtonElement => button(label, `${label} by the handle`, () => {
    handle.showMode(name, jog.local ? 'local' : 'world');
    for (const [b, n] of [[move, 'translate'], [turn, 'rotate']] as const) b.setAttribute('aria-pressed', String(n === name));
  }, { 'aria-pressed': String(name === 'translate') });
  const move = mode('translate', 'Move');
  const turn = mode('rotate', 'Turn');
  const hold = (label: string, code: string, title: string): HTMLElement => {
    const b = button(label, title, () => {}, { class: 'jog' });
    b.addEventListener('pointerdown', (event) => {
      b.setPointerCapture(event.pointerId);
      jog.press(code);
    });
    for (const name of ['pointerup', 'pointercancel', 'lostpointercapture', 'blur']) b.addEventListener(name, () => jog.lift(code));
    b.addEventListener('keydown', (event) => {
      if (event.code === 'Enter' || event.code === 'Space') jog.press(code);
    });
    b.addEventListener('keyup', () => jog.lift(code));
    return b;
  };
  const showJoint = (): void => say(jointName, jog.joints()[jog.joint]?.name ?? '–');

  world.built.on((view) => {
    fill(link, view.tree.links.map((name, i) => h('option', { value: String(i), selected: i === world.tool }, name)));
    showJoint();
  });
  world.toolChanged.on((tool) => (link.value = String(tool)));
  jog.jointChanged.on(showJoint);
  jog.padChanged.on((now) => say(pad, now ? `${now.name}: ${now.live ? 'live' : 'hold a shoulder button to move'}` : 'No gamepad. Press a button on it to be seen.'));
  pusher.forceChanged.on((f) => say(force, f > 0 ? `${f.toFixed(1)} N` : ''));
  const push = toggle('Drag links to push them', 'A drag on a link pulls at it with a spring; Alt and drag does it always', false, (on) => {
    pusher.armed = on;
    document.body.classList.toggle('pushing', on);
  });
  const stiffness = h('input', { type: 'number', min: '1', max: '5000', value: String(pusher.stiffness), 'aria-label': 'Stiffness of the spring, newtons per metre', onchange: () => (pusher.stiffness = Number(stiffness.value) || 100) });

  const pushing = h('section', {}, h('h3', {}, 'Push'), push, h('div', { class: 'row' }, h('label', {}, 'Spring ', stiffness, ' N/m'), force));

  return {
    id: 'tool', title: 'Tool', rate: 10,
    element: h('div', { class: 'padded tool' },
      h('label', { class: 'setting' }, h('span', {}, 'Link'), link),
      h('div', { class: 'row' }, toggle('Handle', 'Show the handle', true, (on) => handle.show(on)), move, turn),
      h('div', { class: 'row' },
        toggle('Keep orientation', 'The tool keeps its orientation while it moves', settings.keepOrientation, (on) => set('keepOrientation', on)),
        toggle('Tool axes', 'Move along the axes of the tool instead of the world', false, (on) => {
          jog.local = on;
          handle.showMode(handle.controls.mode as 'translate' | 'rotate', on ? 'local' : 'world');
        })),
      h('table', { class: 'goal' }, h('thead', {}, h('tr', {}, ['mm', 'actual', 'goal'].map((t) => h('th', { scope: 'col' }, t)))),
        h('tbody', {}, AXES.map((axis, i) => h('tr', {}, h('td', {}, axis), is[i]!, h('td', {}, goal[i]!))))),
      h('div', { class: 'row' }, button('Go', 'Move the tool to the goal', go, { id: 'goal-go' }), state),
      h('h3', {}, 'Jog'),
      h('div', { class: 'jogs' }, hold('+x', 'KeyW', 'Tool along x (W)'), hold('+y', 'KeyA', 'Tool along y (A)'), hold('+z', 'KeyR', 'Tool along z (R)'),
        hold('−x', 'KeyS', 'Tool against x (S)'), hold('−y', 'KeyD', 'Tool against y (D)'), hold('−z', 'KeyF', 'Tool against z (F)'),
        hold('↺x', 'KeyO', 'Turn about x (O)'), hold('↺y', 'KeyI', 'Turn about y (I)'), hold('↺z', 'KeyJ', 'Turn about z (J)')),
      h('div', { class: 'jog-joint' }, button('‹', 'Joint before (-)', () => jog.nextJoint(-1), { class: 'icon' }), jointName, button('›', 'Joint after (+)', () => jog.nextJoint(1), { class: 'icon' }),
        hold('−', 'BracketLeft', 'Jog the joint down ([)'), hold('+', 'BracketRight', 'Jog the joint up (])')),
      pad,
      pushing),
    update: () => {
      pushing.hidden = app.commander.viewing;
      const o = world.tool * STRIDE;
      const commanded = driver.goal ?? driver.commanded();
      AXES.forEach((_, i) => {
        say(is[i]!, millimetres(twin.poses[o + i] ?? NaN));
        const input = goal[i]!;
        if (commanded && !goal.includes(document.activeElement as HTMLInputElement)) {
          const text = millimetres(commanded[i]!);
          if (input.value !== text) input.value = text;
        }
      });
      const s = driver.solution;
      const text = !driver.canMove() ? 'No active controller moves this link.' : !s ? '' : s.reached ? 'in reach' : `out of reach by ${(s.distance * 1000).toFixed(0)} mm${s.angle > 0.02 ? `, ${((s.angle * 180) / Math.PI).toFixed(0)}°` : ''}`;
      say(state, text);
      state.className = `reach ${s && !s.reached ? 'warning' : 'muted'}`;
    },
  };
}
