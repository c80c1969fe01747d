// The page: puts the parts together.
import '../style/base.css';
import '../style/layout.css';
import '../style/panels.css';
import type { App, Panel } from './app';
import { makeBar } from './bar';
import { Commander } from './commander';
import { Layout } from './layout';
import { makeOverlay } from './overlay';
import { Signal } from './signal';
import { startTheme } from './theme';
import { Twin } from './twin';
import { jointsPanel } from '../panels/joints';
import { Picker } from '../scene/picking';
import { World } from '../scene/world';

function serverUrl(): string {
  const asked = new URLSearchParams(location.search);
  const token = asked.get('token');
  const base = asked.get('ws') ?? `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/`;
  return token ? `${base}${base.includes('?') ? '&' : '?'}token=${encodeURIComponent(token)}` : base;
}

const twin = new Twin(serverUrl());
const commander = new Commander(twin);
const app = { twin, commander, selection: null, selected: new Signal() } as unknown as App;
app.select = (selection) => {
  app.selection = selection;
  app.selected.emit(selection);
};

const bar = makeBar(app, () => {});
const layout = new Layout(bar.element);
app.world = new World(layout.stage, twin, commander);
const overlay = makeOverlay(app);
layout.stage.append(...overlay.elements);

const right: Panel[] = [jointsPanel(app)];
const bottom: Panel[] = [];
layout.mount(right, bottom);
startTheme(app.world);

const picker = new Picker(app.world);
let down: { x: number; y: number } | null = null;
const canvas = app.world.stage.renderer.domElement;
canvas.addEventListener('pointerdown', (event) => {
  down = event.button === 0 ? { x: event.clientX, y: event.clientY } : null;
});
canvas.addEventListener('pointerup', (event) => {
  if (!down || Math.hypot(event.clientX - down.x, event.clientY - down.y) > 4) return;
  const hit = picker.hit(event);
  app.select(hit ? { link: hit.link } : null);
});

let since = 0;
app.world.stage.tick.on((dt) => {
  layout.tick(dt);
  since += dt;
  if (since < 0.1) return;
  since = 0;
  bar.update();
  overlay.update();
});
twin.start();

// For tests and for people with the console open.
Object.assign(window, { doppel: app });
