// The objects that the parts of the page share.
import { Signal } from './signal';
import type { Commander } from './commander';
import type { Hardware } from './hardware';
import type { Recorder } from './recorder';
import type { LayerChoice } from './layer_toggles';
import type { Sources } from './sources';
import type { Twin } from './twin';
import type { Legend } from '../scene/legend';
import type { World } from '../scene/world';

export type Selection = { link: number } | null;

// The time of a recording, which plots show and set.
export interface Playback {
  readonly time: number; // s since its start
  readonly length: number;
  readonly moved: Signal;
  seek: (time: number) => void;
}

export interface App {
  twin: Twin;
  commander: Commander;
  hardware: Hardware;
  world: World;
  sources: Sources;
  select: (selection: Selection) => void;
  selection: Selection;
  playback: Playback | null; // null: a twin
  playbackChanged: Signal;
  recorder: Recorder; // with the panels
  comparison: HTMLElement; // the content of the panel of two recordings; empty: there is one
  selected: Signal<Selection>;
  workbench: Promise<void>; // panels and tools are there
  tabsChanged: Signal; // a badge of a tab has changed, or whether a panel applies
  openPanel: (id: string) => void; // once the panels are loaded
  chooseRecording: () => void; // likewise
  worldLayers: () => LayerChoice[]; // those for which the world has something
  sensorLayers: () => LayerChoice[]; // those for which the twin has sensors
  legend: Legend;
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
  excluded?: () => boolean; // true: it can do nothing here, and its tab is hidden also where the user opened it before
  badge?: () => Badge | null; // beside the title
  update?: () => void;
  shown?: () => void;
  hidden?: () => void;
}
