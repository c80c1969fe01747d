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
import { Jog } from './jog';
import { startKeyboard } from './keyboard';
import { Recorder } from './recorder';
import { openSettings } from './settings_dialog';
import { ToolDriver } from './tool';
import { controlPanel } from '../panels/control';
import { healthPanel } from '../panels/health';
import { jointsPanel } from '../panels/joints';
import { logPanel } from '../panels/log';
import { plotsPanel } from '../panels/plots';
import { posesPanel } from '../panels/poses';
import { tfPanel } from '../panels/tf';
import { toolPanel } from '../panels/tool';
import { topicsPanel } from '../panels/topics';
import { ContactLayer } from '../scene/contacts';
import { ToolHandle } from '../scene/handle';
import { Picker } from '../scene/picking';
import { Pusher } from '../scene/push';
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

const bar = makeBar(app, openSettings);
const layout = new Layout(bar.element);
app.world = new World(layout.stage, twin, commander);
const overlay = makeOverlay(app);
layout.stage.append(...overlay.elements);

const picker = new Picker(app.world);
const pusher = new Pusher(app, picker);
const driver = new ToolDriver(app);
const handle = new ToolHandle(app, driver);
const jog = new Jog(app, driver);
new ContactLayer(app);
startKeyboard(app, jog);

const right: Panel[] = [jointsPanel(app), toolPanel(app, driver, handle, jog, pusher), posesPanel(app), controlPanel(app), healthPanel(app)];
const bottom: Panel[] = [plotsPanel(app, new Recorder(twin)), topicsPanel(app), tfPanel(app), logPanel(app)];
layout.mount(right, bottom);
startTheme(app.world);

let down: { x: number; y: number } | null = null;
const canvas = app.world.stage.renderer.domElement;
canvas.addEventListener('pointerdown', (event) => {
  down = null;
  if (event.button !== 0 || handle.busy) return;
  const hit = pusher.armed || event.altKey ? picker.hit(event) : null;
  if (hit) {
    pusher.begin(hit);
    if (pusher.active) canvas.setPointerCapture(event.pointerId);
  } else {
    down = { x: event.clientX, y: event.clientY };
  }
}, true);
canvas.addEventListener('pointermove', (event) => pusher.move(event));
for (const name of ['pointercancel', 'lostpointercapture']) canvas.addEventListener(name, () => pusher.end());
canvas.addEventListener('pointerup', (event) => {
  pusher.end();
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
Object.assign(window, { doppel: Object.assign(app, { driver, handle, jog, pusher, layout }) });
