// The objects that the parts of the page share.
import { Signal } from './signal';
import type { Commander } from './commander';
import type { Hardware } from './hardware';
import type { LayerChoice } from './layer_toggles';
import type { Sources } from './sources';
import type { Twin } from './twin';
import type { World } from '../scene/world';

export type Selection = { link: number } | null;

export interface App {
  twin: Twin;
  commander: Commander;
  hardware: Hardware;
  world: World;
  sources: Sources;
  select: (selection: Selection) => void;
  selection: Selection;
  selected: Signal<Selection>;
  tabsChanged: Signal; // a badge of a tab has changed, or whether a panel applies
  openPanel: (id: string) => void; // once the panels are loaded
  sensorLayers: () => LayerChoice[]; // those for which the twin has sensors
  details: HTMLElement; // the box about the selection; over the picture, or below the tree
}

export interface Badge {
  text: string;
  level: 'error' | 'warning';
  title: string;
}

// A tab of a dock. `update` is called several times a second while the panel is visible.
export interface Panel {
  id: string;
  title: string;
  element: HTMLElement;
  rate?: number; // Hz of update; 10 when absent
  applies?: () => boolean; // false: the twin has nothing for it, and its tab is hidden
  badge?: () => Badge | null; // beside the title
  update?: () => void;
  shown?: () => void;
  hidden?: () => void;
}
