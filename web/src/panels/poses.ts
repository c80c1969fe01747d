// Poses that are kept, and a sequence of them played as one trajectory.
import type { App, Panel } from '../app/app';
import { button, download, fill, h, toast } from '../app/dom';
import { load, save } from '../app/settings';
import type { Waypoint } from '../app/commander';

interface Kept {
  name: string;
  joints: Record<string, number>;
}
interface Step {
  pose: string;
  seconds: number; // of the way there; 0: as fast as the limits allow
  pause: number;
}

export function posesPanel(app: App): Panel {
  const { twin, commander } = app;
  let poses: Kept[] = [];
  let steps: Step[] = [];
  let loop = false;
  let timer: ReturnType<typeof setTimeout> | null = null;
  const poseList = h('div', { class: 'pose-list' });
  const stepList = h('ol', { class: 'step-list' });
  const name = h('input', { type: 'text', placeholder: 'name of the pose', 'aria-label': 'Name of the pose', onkeydown: (e: KeyboardEvent) => e.key === 'Enter' && keep() });
  const key = (): string => `doppel.poses.${twin.tree?.robot.name ?? ''}`;
  const store = (): void => save(key(), { poses, steps });

  function vector(pose: Kept, base: ArrayLike<number>): Float64Array {
    const q = Float64Array.from(base);
    for (const [joint, value] of Object.entries(pose.joints)) {
      const found = twin.tree?.jointByName.get(joint);
      if (found && found.index >= 0) q[found.index] = Math.min(found.upper, Math.max(found.lower, value));
    }
    twin.tree?.follow(q);
    return q;
  }

  function keep(): void {
    const called = name.value.trim() || `pose ${poses.length + 1}`;
    const joints: Record<string, number> = {};
    for (const joint of twin.tree?.moving ?? []) if (!joint.mimic) joints[joint.name] = twin.target[joint.index]!;
    poses = [...poses.filter((pose) => pose.name !== called), { name: called, joints }];
    name.value = '';
    store();
    build();
  }

  function play(): void {
    if (!twin.tree || steps.length === 0) return;
    const points: Waypoint[] = [];
    let from = Float64Array.from(twin.q);
    let time = 0;
    const joints = twin.tree.moving.filter((joint) => commander.canMove(joint));
    for (const step of steps) {
      const pose = poses.find((one) => one.name === step.pose);
      if (!pose) continue;
      const to = vector(pose, from);
      // 1.5: a spline's peak speed over its mean
      time += Math.max(step.seconds, commander.timeFor(joints, from, to) * 1.5);
      points.push({ time, positions: to });
      if (step.pause > 0) points.push({ time: (time += step.pause), positions: to });
      from = to;
    }
    commander.play(points);
    toast(`Playing ${steps.length} steps, ${time.toFixed(1)} s.`);
    if (timer) clearTimeout(timer);
    if (loop) timer = setTimeout(() => !commander.stopped && play(), time * 1000 + 100);
  }

  function halt(): void {
    if (timer) clearTimeout(timer);
    timer = null;
    commander.hold();
  }

  function build(): void {
    fill(poseList, poses.length === 0 ? h('p', { class: 'empty' }, 'No poses yet. Move the arm, then keep where it is.') : poses.map((pose) => h('div', { class: 'row pose' },
      h('span', { class: 'pose-name' }, pose.name), h('span', { class: 'spacer' }),
      button('Go', `Go to ${pose.name}`, () => commander.setMany((twin.tree?.moving ?? []).filter((j) => pose.joints[j.name] !== undefined).map((j) => [j, pose.joints[j.name]!]))),
      button('+ step', `Add ${pose.name} to the sequence`, () => {
        steps.push({ pose: pose.name, seconds: 0, pause: 0 });
        store();
        build();
      }),
      button('×', `Forget ${pose.name}`, () => {
        poses = poses.filter((one) => one !== pose);
        steps = steps.filter((step) => step.pose !== pose.name);
        store();
        build();
      }, { class: 'icon' }))));
    fill(stepList, steps.map((step, i) => {
      const number = (field: 'seconds' | 'pause', label: string): HTMLElement => {
        const input = h('input', { type: 'number', min: '0', step: '0.1', value: String(step[field]), 'aria-label': `${label} of step ${i + 1}`, onchange: () => {
          step[field] = Math.max(0, Number(input.value) || 0);
          store();
        } });
        return h('label', { class: 'muted', title: field === 'seconds' ? 'seconds of the way there; 0: as fast as allowed' : 'seconds to wait there' }, `${label} `, input);
      };
      return h('li', {}, h('span', { class: 'pose-name' }, step.pose), number('seconds', 'in'), number('pause', 'wait'),
        button('↑', 'Earlier', () => {
          if (i > 0) [steps[i - 1], steps[i]] = [steps[i]!, steps[i - 1]!];
          store();
          build();
        }, { class: 'icon', disabled: i === 0 }),
        button('×', 'Take away', () => {
          steps.splice(i, 1);
          store();
          build();
        }, { class: 'icon' }));
    }));
  }

  twin.robotChanged.on(() => {
    const kept = load(key()) as { poses?: Kept[]; steps?: Step[] } | null;
    poses = kept?.poses ?? [];
    steps = kept?.steps ?? [];
    build();
  });
  commander.stopChanged.on((stopped) => {
    if (stopped && timer) clearTimeout(timer);
  });
  const repeat = h('input', { type: 'checkbox', onchange: () => (loop = repeat.checked) });
  build();
  return {
    id: 'poses', title: 'Poses',
    element: h('div', { class: 'padded' }, h('div', { class: 'row' }, name, button('Keep', 'Keep the commanded pose under this name', keep), h('span', { class: 'spacer' }),
      button('Save', 'Save poses and sequence to a file', () => download('poses.json', 'application/json', JSON.stringify({ poses, steps }, null, 2)))),
    poseList, h('h3', {}, 'Sequence'), stepList,
    h('div', { class: 'row' }, button('Play', 'Play the sequence as one trajectory', play), button('Halt', 'Hold where the arm is', halt), h('label', { class: 'toggle' }, repeat, h('span', {}, 'again and again')))),
  };
}
