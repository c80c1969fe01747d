// The tool: its link, its pose, its goal and the solutions for it; reach; jogging; pushing.
import type { App, Panel } from '../app/app';
import { button, fill, h, say, toggle } from '../app/dom';
import type { Answer } from '../app/kinematics';
import type { Jog } from '../app/jog';
import type { Reach } from '../app/reach';
import { set, settings } from '../app/settings';
import type { ToolDriver } from '../app/tool';
import { millimetres } from '../app/units';
import { STRIDE } from '../robot/tree';
import type { GoalGhost } from '../scene/goal_ghost';
import type { ToolHandle } from '../scene/handle';
import type { Pusher } from '../scene/push';
import { reachSection } from './reach';
import { solutionList } from './solutions';

const AXES = ['x', 'y', 'z'] as const;

interface ToolParts {
  driver: ToolDriver;
  handle: ToolHandle;
  ghost: GoalGhost;
  reach: Reach;
  jog: Jog;
  pusher: Pusher;
}

export function toolPanel(app: App, { driver, handle, ghost, reach, jog, pusher }: ToolParts): Panel {
  const { twin, world } = app;
  const link = h('select', { id: 'tool-link', onchange: () => world.setTool(Number(link.value)) });
  const is = AXES.map(() => h('td', { class: 'num' }));
  const goal = AXES.map((axis) => h('input', { class: 'num', inputMode: 'decimal', 'aria-label': `Goal ${axis} in millimetres`, id: `goal-${axis}` }));
  const state = h('p', { class: 'reach', role: 'status' });
  const pad = h('p', { class: 'muted' }, 'No gamepad. Press a button on it to be seen.');
  const jointName = h('strong', {});
  const force = h('output', { class: 'num muted' });

  let hasEdits = false; // the fields differ from the goal until it is set

  // The commanded pose with the numbers of the fields.
  function typedPose(): Float64Array | null {
    const pose = driver.goal?.slice() ?? driver.commanded();
    if (pose) goal.forEach((input, i) => {
      const value = Number(input.value.replace(',', '.'));
      if (hasEdits && Number.isFinite(value) && input.value.trim() !== '') pose[i] = value / 1000;
    });
    return pose;
  }
  function go(): void {
    const pose = typedPose();
    hasEdits = false;
    if (pose && driver.canMove()) driver.setGoal(pose);
  }
  for (const input of goal) {
    input.addEventListener('input', () => (hasEdits = true));
    input.addEventListener('keydown', (event) => {
      if (event.key === 'Enter') go();
    });
  }
  const goes = button('Go', 'Move the tool to the goal', go, { id: 'goal-go' });
  const solutions = solutionList(app, driver, ghost, typedPose);
  const reaching = reachSection(app, reach, () => driver.kinematics.missing);
  const mode = (name: 'translate' | 'rotate', label: string): HTMLButtonElement => button(label, `${label} by the handle`, () => {
    handle.showMode(name, jog.local ? 'local' : 'world');
    for (const [b, n] of [[move, 'translate'], [turn, 'rotate']] as const) b.setAttribute('aria-pressed', String(n === name));
  }, { 'aria-pressed': String(name === 'translate') });
  const move = mode('translate', 'Move');
  const turn = mode('rotate', 'Turn');
  const hold = (label: string, code: string, title: string): HTMLButtonElement => {
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
  const jogs = [
    hold('+x', 'KeyW', 'Tool along x (W)'), hold('+y', 'KeyA', 'Tool along y (A)'), hold('+z', 'KeyR', 'Tool along z (R)'),
    hold('−x', 'KeyS', 'Tool against x (S)'), hold('−y', 'KeyD', 'Tool against y (D)'), hold('−z', 'KeyF', 'Tool against z (F)'),
    hold('↺x', 'KeyO', 'Turn about x (O)'), hold('↺y', 'KeyI', 'Turn about y (I)'), hold('↺z', 'KeyJ', 'Turn about z (J)'),
  ];
  const showJoint = (): void => say(jointName, jog.joints()[jog.joint]?.name ?? '–');

  world.built.on((view) => {
    fill(link, view.tree.links.map((name, i) => h('option', { value: String(i), selected: i === world.tool }, name)));
    showJoint();
  });
  world.toolChanged.on((tool) => {
    link.value = String(tool);
    hasEdits = false;
  });
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
      h('div', { class: 'row' }, goes, solutions.button, state),
      solutions.element,
      reaching.element,
      h('h3', {}, 'Jog'),
      h('div', { class: 'jogs' }, jogs),
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
        if (commanded && (!hasEdits || driver.dragging) && document.activeElement !== input) {
          const text = millimetres(commanded[i]!);
          if (input.value !== text) input.value = text;
        }
      });
      const refusal = driver.refusal();
      for (const one of [goes, move, turn, ...jogs]) one.disabled = refusal !== '';
      const answer = driver.answer ?? driver.outcome;
      const text = refusal || describe(driver, answer);
      say(state, text);
      state.className = `reach ${refusal === '' && text !== '' && (answer?.solved === false || driver.blockedJoints().length > 0) ? 'warning' : 'muted'}`;
      solutions.update();
      reaching.update();
    },
    hidden: () => ghost.show(null),
  };
}

// The program's answer for the goal.
function describe(driver: ToolDriver, answer: Answer | null): string {
  if (!answer) return '';
  if (!answer.solved) return answer.message;
  const [joint] = driver.blockedJoints();
  if (joint !== undefined) return `'${joint}' has to move, too, and no active controller moves it`;
  return answer.message ? `in reach; ${answer.message}` : 'in reach';
}
