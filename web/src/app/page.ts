// The parts that the first picture needs: bar, layout, the 3D part. Panels and tools are loaded after it.
import type { AssetStore } from '../robot/assets';
import { World } from '../scene/world';
import type { App } from './app';
import { makeBar } from './bar';
import { Commander } from './commander';
import { Hardware } from './hardware';
import { startStopKeys } from './escape';
import { Layout } from './layout';
import { makeOverlay } from './overlay';
import { openSettings } from './settings_dialog';
import { settings } from './settings';
import { Signal } from './signal';
import { Sources } from './sources';
import { startTheme } from './theme';
import type { Twin } from './twin';

const PICTURE_TIMEOUT = 1500; // ms after which panels are loaded without a picture

export function startPage(twin: Twin, assets: AssetStore): App {
  performance.mark('doppel: page');
  const commander = new Commander(twin);
  const app = { twin, commander, hardware: new Hardware(twin), sources: new Sources(twin), selection: null, selected: new Signal(), tabsChanged: new Signal(), playback: null, playbackChanged: new Signal(), openPanel: () => {}, chooseRecording: () => {}, worldLayers: () => [], sensorLayers: () => [] } as unknown as App;
  app.select = (selection) => {
    app.selection = selection;
    app.selected.emit(selection);
  };
  startStopKeys(commander);
  const bar = makeBar(app, () => openSettings(twin.client.metadata['version'] ?? '', () => app.chooseRecording()));
  const layout = new Layout(bar.element);
  app.world = new World(layout.stage, twin, commander, assets);
  performance.mark('doppel: stage');
  const overlay = makeOverlay(app);
  layout.stage.append(...overlay.elements);
  startTheme(app.world);

  let since = 0;
  app.world.stage.tick.on((dt) => {
    layout.tick(dt);
    since += dt;
    if (since < 0.1) return;
    since = 0;
    bar.update();
    overlay.update();
  });
  // For tests and for the browser's console.
  Object.assign(window, { doppel: Object.assign(app, { layout, settings, ready: false }) });

  let begun = false;
  let ready = (): void => {};
  app.workbench = new Promise((done) => (ready = done));
  const begin = async (): Promise<void> => {
    if (begun) return;
    begun = true;
    const { startWorkbench } = await import('./workbench');
    startWorkbench(app, layout);
    ready();
  };
  app.world.pictured.on(() => void begin());
  setTimeout(() => void begin(), PICTURE_TIMEOUT);
  return app;
}
