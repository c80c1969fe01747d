// All solutions for the tool's pose: a list whose rows show the arm in the picture and move it.
import type { App } from '../app/app';
import { button, fill, h, say } from '../app/dom';
import type { Branch } from '../app/kinematics';
import type { ToolDriver } from '../app/tool';
import { fixed, format, millimetres, unitOf } from '../app/units';
import type { GoalGhost } from '../scene/goal_ghost';

const SAME_POSITION = 0.01; // rad or m

export interface SolutionList {
  button: HTMLButtonElement;
  element: HTMLElement;
  update: () => void;
  close: () => void;
}

// `pose`: of the tool in the world, for which solutions are listed.
export function solutionList(app: App, driver: ToolDriver, ghost: GoalGhost, pose: () => Float64Array | null): SolutionList {
  const { twin } = app;
  const rows = h('div', { class: 'solution-rows', role: 'group', 'aria-label': 'Solutions' });
  const note = h('p', { class: 'muted', role: 'status' });
  const head = h('div', { class: 'solution head', 'aria-hidden': 'true' }, ['', 'clearance', 'from limits', 'manipulability'].map((text) => h('span', {}, text)));
  const element = h('div', { class: 'solutions', id: 'solutions', hidden: true }, note, head, rows);
  const opener = button('Solutions', 'List all configurations of the arm for this pose of the tool', () => void (element.hidden ? open() : close()),
    { id: 'goal-solutions', 'aria-expanded': 'false', 'aria-controls': 'solutions' });
  let entries: { branch: Branch; row: HTMLButtonElement; name: HTMLElement }[] = [];
  let round = 0; // a list that is closed takes no answer

  function close(): void {
    round += 1;
    entries = [];
    element.hidden = true;
    opener.setAttribute('aria-expanded', 'false');
    ghost.show(null);
  }

  async function open(): Promise<void> {
    const at = pose();
    if (!at) return;
    close();
    const mine = round;
    element.hidden = false;
    opener.setAttribute('aria-expanded', 'true');
    head.hidden = rows.hidden = true;
    say(note, 'Asking …');
    try {
      const answer = await driver.everyBranch(at);
      if (mine !== round) return;
      list(answer.solved ? answer.branches : []);
      element.scrollIntoView({ block: 'nearest' });
      const { length } = answer.branches;
      say(note, answer.solved ? `${length} ${length === 1 ? 'solution' : 'solutions'}; a click moves the arm straight there.` : answer.message);
    } catch (problem) {
      if (mine === round) say(note, (problem as Error).message);
    }
  }

  function list(branches: Branch[]): void {
    entries = branches.map((branch, i) => {
      const name = h('span', {});
      const values = branch.positions.map(([joint, value]) => `${joint.name} ${format(joint, value)} ${unitOf(joint)}`).join('\n');
      const near = branch.nearest.length === 2 ? `\nnearest: ${branch.nearest[0]} and ${branch.nearest[1]}` : '';
      const clearance = Number.isFinite(branch.clearance) && branch.clearance < 1 ? `${millimetres(branch.clearance)} mm` : 'far';
      const row = h('button', { type: 'button', class: 'solution', title: values + near, onclick: () => driver.moveTo(branch), onkeydown: (event: KeyboardEvent) => walk(event, i) },
        name, h('span', { class: 'num' }, clearance), h('span', { class: 'num' }, `${fixed(branch.limitDistance * 100, 0)} %`), h('span', { class: 'num' }, fixed(branch.manipulability, 4)));
      row.setAttribute('aria-label', `Solution ${i + 1}: clearance ${clearance}, ${fixed(branch.limitDistance * 100, 0)} % from the limits, manipulability ${fixed(branch.manipulability, 4)}`);
      for (const event of ['pointerenter', 'focus']) row.addEventListener(event, () => ghost.show(branch, `solution ${i + 1}`));
      for (const event of ['pointerleave', 'blur']) row.addEventListener(event, () => ghost.show(null));
      return { branch, row, name };
    });
    fill(rows, entries.map(({ row }) => row));
    head.hidden = rows.hidden = entries.length === 0;
    update();
  }

  function walk(event: KeyboardEvent, i: number): void {
    const step = event.code === 'ArrowDown' ? 1 : event.code === 'ArrowUp' ? -1 : 0;
    if (step === 0) return;
    event.preventDefault();
    entries[(i + step + entries.length) % entries.length]?.row.focus();
  }

  function update(): void {
    opener.disabled = driver.refusal() !== '';
    if (element.hidden) return;
    if (opener.disabled || driver.dragging) close();
    entries.forEach(({ branch, row, name }, i) => {
      const reached = branch.positions.every(([joint, value]) => Math.abs(twin.target[joint.index]! - value) < SAME_POSITION);
      say(name, reached ? `${i + 1} · here` : String(i + 1));
      row.setAttribute('aria-current', String(reached));
    });
  }

  app.world.toolChanged.on(close);
  return { button: opener, element, update, close };
}
