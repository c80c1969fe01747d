// Checkboxes of layers of the picture; they show what the settings are, also if these are changed elsewhere.
import type { World } from '../scene/world';
import { fill, toggle } from './dom';
import { settings, settingsChanged } from './settings';

export interface LayerChoice {
  id: string;
  label: string;
  title: string;
}

export class LayerToggles {
  private boxes: { id: string; box: HTMLInputElement }[] = [];
  private shown = '';

  constructor(readonly element: HTMLElement, private readonly world: () => World) {
    settingsChanged.on((key) => {
      if (key === 'layers') for (const { id, box } of this.boxes) box.checked = settings.layers[id] ?? false;
    });
  }

  offer(layers: LayerChoice[]): void {
    const names = layers.map(({ id }) => id).join();
    if (names === this.shown) return;
    this.shown = names;
    const toggles = layers.map(({ id, label, title }) => ({ id, element: toggle(label, title, settings.layers[id] ?? false, (on) => this.world().setLayer(id, on)) }));
    this.boxes = toggles.map(({ id, element }) => ({ id, box: element.querySelector('input')! }));
    fill(this.element, toggles.map(({ element }) => element));
  }
}
