// What lies over the picture: views, layers, the box with the numbers of what is selected, notes.
import type { App } from './app';
import { button, fill, h, say, toggle } from './dom';
import { icon } from './icons';
import { settings } from './settings';
import { format, unitOf } from './units';
import { VIEWS, type ViewName } from '../scene/camera';
import { STRIDE } from '../robot/tree';

const LAYERS: [string, string, string][] = [
  ['visual', 'Visual', 'The shapes that are seen'],
  ['collision', 'Collision', 'The shapes that physics uses'],
  ['inertia', 'Inertia', 'Boxes of the same mass and inertia'],
  ['com', 'Centres of mass', 'A ball at each centre of mass'],
  ['frames', 'Frames', 'Frames of the links, with names'],
  ['axes', 'Joint axes', 'Axes of the joints and the arcs that limits allow'],
  ['ghost', 'Commanded pose', 'A ghost where the targets are'],
  ['trace', 'Trace of the tool', 'The way of the tool'],
  ['contacts', 'Contacts', 'Contact points and forces, where the twin tells them'],
  ['grid', 'Grid', 'The ground'],
  ['shadows', 'Shadows', 'Shadows'],
];

export function makeOverlay(app: App): { elements: HTMLElement[]; update: () => void } {
  const { world, twin } = app;
  let following = false;
  const follow = button('Follow', 'The camera follows the tool', () => {
    following = !following;
    world.camera.follow = following ? () => world.toolPosition() : null;
    follow.setAttribute('aria-pressed', String(following));
    world.stage.invalidate();
  }, { 'aria-pressed': 'false' });
  const views = h('div', { class: 'views', role: 'group', 'aria-label': 'Views' },
    ...Object.entries(VIEWS).map(([name, view]) => button(view.label, `Look from: ${view.label.toLowerCase()}`, () => world.camera.go(name as ViewName))),
    follow);
  const list = h('div', { class: 'layer-list', hidden: true },
    LAYERS.map(([id, label, title]) => toggle(label, title, settings.layers[id] ?? false, (on) => world.setLayer(id, on))));
  const open = button('Layers', 'What is drawn', () => {
    list.hidden = !list.hidden;
    open.setAttribute('aria-expanded', String(!list.hidden));
  }, { 'aria-expanded': 'false', id: 'layers' });
  const layers = h('div', { class: 'layers' }, open, list);
  const details = h('div', { class: 'details', hidden: true });
  const note = h('div', { class: 'note', role: 'status', hidden: true });
  const stopped = h('div', { class: 'stopped-note', role: 'alert' }, 'Stopped. Commands of this page are refused until the stop is released.');

  function describe(): void {
    const { selection } = app;
    const { tree } = twin;
    details.hidden = !selection || !tree;
    if (!selection || !tree) return;
    const name = tree.links[selection.link]!;
    const link = tree.robot.links.get(name)!;
    const joint = tree.parentJoint[selection.link];
    const rows: [string, string | Node][] = [];
    if (joint) {
      rows.push(['joint', `${joint.name} (${joint.kind})`], ['parent', joint.parent]);
      if (joint.index >= 0) {
        rows.push(['position', h('span', { class: 'num', id: 'detail-q' })]);
        if (Number.isFinite(joint.lower)) rows.push(['limits', `${format(joint, joint.lower)} … ${format(joint, joint.upper)} ${unitOf(joint)}`]);
        if (joint.velocity > 0) rows.push(['velocity', `${format(joint, joint.velocity)} ${unitOf(joint)}/s`]);
        if (joint.effort > 0) rows.push(['effort', `${joint.effort} ${joint.kind === 'prismatic' ? 'N' : 'N m'}`]);
      }
    }
    rows.push(['at', h('span', { class: 'num', id: 'detail-at' })]);
    if (link.inertial) {
      const m = link.inertial.mass;
      rows.push(['mass', m < 1 ? `${(m * 1000).toFixed(1)} g` : `${m.toFixed(3)} kg`]);
      rows.push(['centre', link.inertial.origin.xyz.map((x) => (x * 1000).toFixed(1)).join('  ') + ' mm']);
    }
    rows.push(['shapes', `${link.visuals.length} visual, ${link.collisions.length} collision`], ['line', `${link.line} of /robot_description`]);
    fill(details,
      h('div', { class: 'details-head' }, h('strong', {}, name), button(icon('close'), 'Close', () => app.select(null), { class: 'icon' })),
      h('dl', {}, rows.map(([key, value]) => [h('dt', {}, key), h('dd', {}, value)])),
      h('div', { class: 'row' }, button('Use as tool', 'Drag and trace this link', () => world.setTool(selection.link))));
    update();
  }

  function update(): void {
    if (app.selection && twin.tree) {
      const o = app.selection.link * STRIDE;
      const at = document.getElementById('detail-at');
      if (at) say(at, [0, 1, 2].map((i) => (twin.poses[o + i]! * 1000).toFixed(1)).join('  ') + ' mm');
      const joint = twin.tree.parentJoint[app.selection.link];
      const q = document.getElementById('detail-q');
      if (q && joint && joint.index >= 0) say(q, `${format(joint, twin.q[joint.index]!)} ${unitOf(joint)}`);
    }
    const { view } = world;
    const text = twin.client.phase === 'lost' ? 'The twin is gone. Waiting for it to come back.'
      : !view ? (twin.client.phase === 'open' ? 'Waiting for /robot_description.' : 'Connecting.')
      : view.loading > 0 ? `Loading meshes: ${view.loading} to go.`
      : view.failed.length > 0 ? `${view.failed.length} meshes could not be loaded: ${view.failed[0]!.uri.split('/').pop()}, ${view.failed[0]!.reason}` : '';
    note.hidden = text === '';
    say(note, text);
  }

  app.selected.on((selection) => {
    world.highlight(selection ? selection.link : -1);
    describe();
  });
  world.built.on(() => app.select(null));
  return { elements: [views, layers, details, note, stopped], update };
}
