// The controls over the picture: views, layers, the box with the values of the selection, notes.
import type { App } from './app';
import { makeDetails } from './details';
import { makeDivergedBanner } from './diverged';
import { button, h, say } from './dom';
import { closedByEscape } from './escape';
import { LayerToggles, type LayerChoice } from './layer_toggles';
import { makeLostBanner } from './lost';
import { VIEWS, type ViewName } from '../scene/camera';

const LAYERS: LayerChoice[] = [
  { id: 'visual', label: 'Visual', title: 'Visual shapes' },
  { id: 'collision', label: 'Collision', title: 'Collision shapes of the physics: convex hulls for meshes' },
  { id: 'inertia', label: 'Inertia', title: 'Boxes of the same mass and inertia' },
  { id: 'com', label: 'Centres of mass', title: 'A ball at each centre of mass' },
  { id: 'frames', label: 'Frames', title: 'Frames of the links, with names' },
  { id: 'axes', label: 'Joint axes', title: 'Axes of the joints and the arcs that limits allow' },
  { id: 'ghost', label: 'Commanded pose', title: 'A ghost at the target positions' },
  { id: 'trace', label: 'Trace of the tool', title: 'The path of the tool' },
  { id: 'base', label: 'Trace of the base', title: 'The true path of the base, and in blue that of its odometry' },
  { id: 'contacts', label: 'Contacts', title: 'Contact points and forces, if the twin publishes them' },
  { id: 'grid', label: 'Grid', title: 'The ground' },
  { id: 'shadows', label: 'Shadows', title: 'Shadows' },
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
  const list = h('div', { class: 'layer-list', hidden: true });
  const toggles = new LayerToggles(list, () => world);
  let end = (): void => {};
  const showList = (on: boolean): void => {
    list.hidden = !on;
    open.setAttribute('aria-expanded', String(on));
    end();
    end = on ? closedByEscape(() => showList(false)) : () => {};
    if (on) toggles.offer([...LAYERS, ...app.worldLayers(), ...app.sensorLayers()]);
  };
  const open = button('Layers', 'What is drawn', () => showList(list.hidden), { 'aria-expanded': 'false', id: 'layers' });
  const layers = h('div', { class: 'layers' }, open, list);
  const details = makeDetails(app);
  app.details = details.element;
  const noteText = h('span', {});
  const noteLink = button('Health', 'Show the findings about the description', () => app.openPanel('health'), { class: 'plain link-button', hidden: true });
  const note = h('div', { class: 'stage-note', role: 'status', hidden: true }, noteText, ' ', noteLink);
  const lost = makeLostBanner(app);
  const diverged = makeDivergedBanner(app);
  const undrawn = h('div', { class: 'undrawn', role: 'status', hidden: world.stage.drawable }, h('strong', {}, 'This browser does not draw WebGL 2.'),
    h('p', {}, 'The panels and STOP work; only the picture is missing. Turn on hardware acceleration in the settings of the browser, or use another browser.'));
  const stopped = h('div', { class: 'stopped-note', role: 'alert' }, 'Stopped. Commands of this page are rejected until STOP is reset.');

  function update(): void {
    details.update();
    lost.update();
    diverged.update();
    const { view } = world;
    const text = twin.opening ? twin.opening : twin.client.phase === 'lost' ? ''
      : !view ? (twin.client.phase !== 'open' ? 'Connecting.' : twin.withoutRobots ? failures(world.failed) : twin.recording ? twin.missing : `Waiting for ${twin.own('/robot_description')}.`)
      : view.loading > 0 ? `Loading meshes: ${view.loading} to go.`
      : failures([...view.failed, ...world.failed]);
    note.hidden = text === '';
    note.title = [...view?.failed ?? [], ...world.failed][0]?.reason ?? '';
    say(noteText, text);
    noteLink.hidden = twin.opening !== '' || !view || view.loading > 0 || view.failed.length + world.failed.length === 0;
  }

  return { elements: [views, layers, details.element, undrawn, note, stopped, lost.element, diverged.element], update };
}
