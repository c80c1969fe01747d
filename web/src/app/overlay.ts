// The controls over the picture: views, layers, the box with the values of the selection, notes.
import type { App } from './app';
import { makeDetails } from './details';
import { button, h, say, toggle } from './dom';
import { settings } from './settings';
import { VIEWS, type ViewName } from '../scene/camera';

const LAYERS: [string, string, string][] = [
  ['visual', 'Visual', 'Visual shapes'],
  ['collision', 'Collision', 'Collision shapes of the physics: convex hulls for meshes'],
  ['inertia', 'Inertia', 'Boxes of the same mass and inertia'],
  ['com', 'Centres of mass', 'A ball at each centre of mass'],
  ['frames', 'Frames', 'Frames of the links, with names'],
  ['axes', 'Joint axes', 'Axes of the joints and the arcs that limits allow'],
  ['ghost', 'Commanded pose', 'A ghost at the target positions'],
  ['trace', 'Trace of the tool', 'The path of the tool'],
  ['base', 'Trace of the base', 'The true path of the base, and in blue that of its odometry'],
  ['contacts', 'Contacts', 'Contact points and forces, if the twin publishes them'],
  ['grid', 'Grid', 'The ground'],
  ['shadows', 'Shadows', 'Shadows'],
];

// The first reason is in the title of the note.
function failures(failed: { uri: string; reason: string }[]): string {
  const name = failed[0]?.uri.split('/').pop();
  return failed.length === 0 ? '' : failed.length === 1 ? `${name} could not be loaded.` : `${failed.length} files could not be loaded, the first is ${name}.`;
}

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
    ...Object.entries(VIEWS).map(([name, view]) => button(view.label, `View from: ${view.label.toLowerCase()}`, () => world.look(name as ViewName))),
    follow);
  const list = h('div', { class: 'layer-list', hidden: true },
    LAYERS.map(([id, label, title]) => toggle(label, title, settings.layers[id] ?? false, (on) => world.setLayer(id, on))));
  const open = button('Layers', 'What is drawn', () => {
    list.hidden = !list.hidden;
    open.setAttribute('aria-expanded', String(!list.hidden));
  }, { 'aria-expanded': 'false', id: 'layers' });
  const layers = h('div', { class: 'layers' }, open, list);
  const details = makeDetails(app);
  app.details = details.element;
  const note = h('div', { class: 'stage-note', role: 'status', hidden: true });
  const stopped = h('div', { class: 'stopped-note', role: 'alert' }, 'Stopped. Commands of this page are rejected until the stop is released.');

  function update(): void {
    details.update();
    const { view } = world;
    const text = twin.client.phase === 'lost' ? 'Connection to the twin lost. Reconnecting.'
      : !view ? (twin.client.phase !== 'open' ? 'Connecting.' : twin.withoutRobots ? failures(world.failed) : `Waiting for ${twin.own('/robot_description')}.`)
      : view.loading > 0 ? `Loading meshes: ${view.loading} to go.`
      : failures([...view.failed, ...world.failed]);
    note.hidden = text === '';
    note.title = [...view?.failed ?? [], ...world.failed][0]?.reason ?? '';
    say(note, text);
  }

  return { elements: [views, layers, details.element, note, stopped], update };
}
