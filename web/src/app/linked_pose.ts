// The configuration of an address: `?q=JOINT=POSITION` for each joint, rad or m. The reports of `doppel validate` have such
// links. `doppel view` shows it at once; a running twin, which may be a real arm, is moved only after a question.
import type { App } from './app';
import { openDialog } from './dialog';
import { button, h, toast } from './dom';
import type { TreeJoint } from '../robot/tree';

// By joint; what is no number is left out. A name may contain '='.
export function readLinkedPose(search: string): Map<string, number> {
  const pose = new Map<string, number>();
  for (const text of new URLSearchParams(search).getAll('q')) {
    const end = text.lastIndexOf('=');
    const value = text.slice(end + 1).trim();
    if (end > 0 && value !== '' && Number.isFinite(Number(value))) pose.set(text.slice(0, end), Number(value));
  }
  return pose;
}

// Those that the robot has.
export function jointsOf(app: App, pose: Map<string, number>): [TreeJoint, number][] {
  return (app.twin.tree?.moving ?? []).filter((joint) => pose.has(joint.name)).map((joint): [TreeJoint, number] => [joint, pose.get(joint.name)!]);
}

function ask(app: App, values: [TreeJoint, number][], what: string): void {
  const dialog = h('dialog', { class: 'linked-pose', 'aria-label': what },
    h('h2', {}, `Move to ${what}?`),
    h('p', {}, `${values.length} joints of ${app.twin.tree?.robot.name ?? 'the robot'} move, at the speed of the page.`),
    h('div', { class: 'row' }, h('span', { class: 'spacer' }), button('Cancel', 'Stay here', () => dialog.close()),
      button('Move', 'Move the joints', () => {
        dialog.close();
        app.commander.setMany(values);
      }, { class: 'on' })));
  openDialog(dialog);
}

// A view shows the configuration at once, a running twin is moved after a question. `what`: "the configuration of ...".
export function moveToPose(app: App, values: [TreeJoint, number][], what: string): void {
  if (app.commander.viewing) app.commander.setMany(values);
  else ask(app, values, what);
}

export function startLinkedPose(app: App): void {
  const { twin, commander } = app;
  const pose = readLinkedPose(location.search);
  if (pose.size === 0) return;
  let done = false;
  const take = (): void => {
    const { tree } = twin;
    if (done || !tree) return;
    const values = jointsOf(app, pose);
    if (values.length > 0 && !values.some(([joint]) => commander.canMove(joint))) return; // not known yet, or no controller
    done = true;
    const missing = [...pose.keys()].filter((name) => !tree.jointByName.has(name));
    if (missing.length > 0) toast(`${tree.robot.name} has no joint ${missing.join(', ')}.`, 'warning');
    if (values.length > 0) moveToPose(app, values, 'the configuration of the address');
  };
  twin.robotChanged.on(take);
  twin.graphChanged.on(take);
  twin.controllersChanged.on(take);
}
