// The settings of the page, kept in the browser's local storage; without it they are lost.
import { Signal } from './signal';

export interface Settings {
  theme: 'system' | 'light' | 'dark';
  degrees: boolean;
  layers: Record<string, boolean>;
  stopKeys: string[];
  speedShare: number; // of the joints' velocity limits, for commands of the page
  rightWidth: number;
  bottomHeight: number;
  bottomOpen: boolean;
  pictureShare: number; // of the height, where the panels are below it on a narrow window
  hintsSeen: boolean;
  tabs: Record<string, string>;
  tool: string;
  keepOrientation: boolean;
  hiddenSensors: string[]; // by name
  pointColour: 'range' | 'intensity';
}

const DEFAULTS: Settings = {
  theme: 'system',
  degrees: true,
  layers: { visual: true, grid: true, shadows: true, ghost: true, cameras: true, keep_out: true },
  stopKeys: ['Escape'],
  speedShare: 0.5,
  rightWidth: 430,
  bottomHeight: 250,
  bottomOpen: true,
  pictureShare: 0.44,
  hintsSeen: false,
  tabs: {},
  tool: '',
  keepOrientation: true,
  hiddenSensors: [],
  pointColour: 'range',
};

const KEY = 'doppel.settings';
export const settingsChanged = new Signal<keyof Settings>();
export const settings: Settings = { ...DEFAULTS, ...(load(KEY) as Partial<Settings> | null) };
settings.layers = { ...DEFAULTS.layers, ...settings.layers };

export function load(key: string): unknown {
  try {
    return JSON.parse(localStorage.getItem(key) ?? 'null');
  } catch {
    return null;
  }
}

export function save(key: string, value: unknown): void {
  try {
    localStorage.setItem(key, JSON.stringify(value));
  } catch {
    // private windows, full storage
  }
}

export function set<K extends keyof Settings>(key: K, value: Settings[K]): void {
  settings[key] = value;
  save(KEY, settings);
  settingsChanged.emit(key);
}
