// Saved poses, and a sequence of them played as one trajectory.
import type { App, Panel } from '../app/app';
import { copyText } from '../app/clipboard';
import { button, download, fill, h, toast } from '../app/dom';
import { load, save } from '../app/settings';
import type { Waypoint } from '../app/commander';
import { waypointsYaml } from '../app/trajectories';

interface Kept {
  name: string;
  joints: Record<string, number>;
}
interface Step {
  pose: string;
  seconds: number; // of the motion to it; 0: as fast as the limits permit
  pause: number;
}

export function posesPanel(app: App): Panel {
  const { twin, commander } = app;
  let poses: Kept[] = [];
  let steps: Step[] = [];
  let loop = false;
  const run = button('Play', 'Play the sequence as one trajectory', play, { 'aria-pressed': 'false' });
  const file = h('input', { type: 'file', accept: '.json,application/json', hidden: true, onchange: () => {
    if (file.files?.[0]) void open(file.files[0]);
    file.value = '';
  } });
  let timer: ReturnType<typeof setInterval> | null = null;
  const poseList = h('div', { class: 'pose-list' });
  const stepList = h('ol', { class: 'step-list' });
  const noSteps = h('p', { class: 'empty' }, 'No steps yet. + step adds a saved pose.');
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

  // The sequence as waypoints from the current position.
  function waypoints(): Waypoint[] {
    const points: Waypoint[] = [];
    if (!twin.tree) return points;
    let from = Float64Array.from(twin.q);
    let time = 0;
    const joints = twin.tree.moving.filter((joint) => commander.canMove(joint));
    for (const step of steps) {
      const pose = poses.find((one) => one.name === step.pose);
      if (!pose) continue;
      const to = vector(pose, from);
      // 1.5: the ratio of a spline's peak speed to its mean
      time += Math.max(step.seconds, commander.timeFor(joints, from, to) * 1.5);
      points.push({ time, positions: to });
      if (step.pause > 0) points.push({ time: (time += step.pause), positions: to });
      from = to;
    }
    return points;
  }

  function play(): void {
    const points = waypoints();
    const time = points[points.length - 1]?.time;
    if (time === undefined || commander.stopped) {
      toast(commander.stopped ? 'Stopped. Reset STOP first.' : 'Add a pose to the sequence first.', 'warning');
      return;
    }
    commander.play(points);
    toast(`Playing ${steps.length} steps, ${time.toFixed(1)} s.`);
    stopTimer();
    // Trajectories run in simulated time, which may be slower than wall-clock time, or paused.
    const now = (): number => (commander.viewing ? performance.now() / 1000 : twin.simTime);
    const end = now() + time + 0.1;
    timer = setInterval(() => {
      if (now() < end && now() > end - time - 5) return;
      stopTimer();
      if (loop && !commander.stopped) play();
    }, 50);
    reflect();
  }

  function stopTimer(): void {
    if (timer) clearInterval(timer);
    timer = null;
    reflect();
  }

  function halt(): void {
    stopTimer();
    commander.hold();
  }

  function reflect(): void {
    run.setAttribute('aria-pressed', String(timer !== null));
  }

  function copy(): void {
    const points = waypoints();
    if (points.length === 0) {
      toast('Add a pose to the sequence first.', 'warning');
      return;
    }
    void copyText(waypointsYaml(twin, commander, points), 'The sequence, as a YAML trajectory,');
  }

  async function open(file: File): Promise<void> {
    try {
      const read = JSON.parse(await file.text()) as { poses?: Kept[]; steps?: Step[] };
      const good = (read.poses ?? []).filter((pose) => typeof pose.name === 'string' && pose.joints !== null && typeof pose.joints === 'object');
      if (good.length === 0) throw new Error('there are no poses in it');
      poses = [...poses.filter((pose) => !good.some((one) => one.name === pose.name)), ...good];
      steps = (read.steps ?? []).filter((step) => poses.some((pose) => pose.name === step.pose))
        .map((step) => ({ pose: step.pose, seconds: Math.max(0, Number(step.seconds) || 0), pause: Math.max(0, Number(step.pause) || 0) }));
      store();
      build();
      toast(`${good.length} poses and ${steps.length} steps are here.`);
    } catch (problem) {
      toast(`${file.name} cannot be used: ${(problem as Error).message}`, 'error');
    }
  }

  function build(): void {
    fill(poseList, poses.length === 0 ? h('p', { class: 'empty' }, 'No poses yet. Move the robot, then save its pose.') : poses.map((pose) => h('div', { class: 'row pose' },
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
    noSteps.hidden = steps.length > 0;
    fill(stepList, steps.map((step, i) => {
      const number = (field: 'seconds' | 'pause', label: string): HTMLElement => {
        const input = h('input', { type: 'number', min: '0', step: '0.1', value: step[field] > 0 ? String(step[field]) : '', placeholder: field === 'seconds' ? 'auto' : '0', 'aria-label': `${label} of step ${i + 1}`, onchange: () => {
          step[field] = Math.max(0, Number(input.value) || 0);
          store();
        } });
        return h('label', { class: 'field muted', title: field === 'seconds' ? 'Seconds to move there; auto: as fast as the limits allow' : 'Seconds to wait there' }, `${label} `, input, ' s');
      };
      return h('li', {}, h('div', { class: 'step' }, h('span', { class: 'pose-name' }, step.pose), number('seconds', 'in'), number('pause', 'wait'),
        button('↑', 'Earlier', () => {
          if (i > 0) [steps[i - 1], steps[i]] = [steps[i]!, steps[i - 1]!];
          store();
          build();
        }, { class: 'icon', disabled: i === 0 }),
        button('×', 'Take away', () => {
          steps.splice(i, 1);
          store();
          build();
        }, { class: 'icon' })));
    }));
  }

  twin.robotChanged.on(() => {
    const kept = load(key()) as { poses?: Kept[]; steps?: Step[] } | null;
    poses = kept?.poses ?? [];
    steps = kept?.steps ?? [];
    build();
  });
  commander.stopChanged.on((stopped) => {
    if (stopped) stopTimer();
  });
  const repeat = h('input', { type: 'checkbox', onchange: () => (loop = repeat.checked) });
  build();
  return {
    id: 'poses', title: 'Poses',
    element: h('div', { class: 'padded' }, h('div', { class: 'row keep-row' }, name, button('Save pose', 'Save the commanded pose under this name', keep),
      button('Import', 'Load poses and a sequence from a file', () => file.click()), file,
      button('Export', 'Save poses and sequence to a file', () => download('poses.json', 'application/json', JSON.stringify({ poses, steps }, null, 2)))),
    poseList, h('h3', {}, 'Sequence'), noSteps, stepList,
    h('div', { class: 'row' }, run, button('Stop motion', 'Hold the present position', halt), button('Copy', 'Copy the sequence as a YAML trajectory', copy), h('label', { class: 'toggle' }, repeat, h('span', {}, 'Loop')))),
  };
}
