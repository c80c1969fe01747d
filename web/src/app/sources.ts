// The locations of links and joints in the user's own files, as published on /doppel/sources.
import { Signal } from './signal';
import type { Twin } from './twin';

export interface Place {
  file: string;
  line: number;
  column: number; // 0: unknown
}

export function readSources(text: string): { links: Map<string, Place>; joints: Map<string, Place> } {
  const take = (raw: unknown): Map<string, Place> => {
    const out = new Map<string, Place>();
    for (const [name, place] of Object.entries((raw ?? {}) as Record<string, Partial<Place> | null>)) {
      if (place && typeof place.file === 'string' && place.file !== '') out.set(name, { file: place.file, line: Number(place.line) || 0, column: Number(place.column) || 0 });
    }
    return out;
  };
  try {
    const raw = JSON.parse(text) as { links?: unknown; joints?: unknown };
    return { links: take(raw.links), joints: take(raw.joints) };
  } catch {
    return { links: new Map(), joints: new Map() };
  }
}

// The format of editors: file:line:column.
export function placeText({ file, line, column }: Place): string {
  return file + (line > 0 ? `:${line}` : '') + (line > 0 && column > 0 ? `:${column}` : '');
}

export class Sources {
  links = new Map<string, Place>();
  joints = new Map<string, Place>();
  readonly changed = new Signal();

  constructor(twin: Twin) {
    twin.selectedRobot.on(() => {
      this.links = new Map();
      this.joints = new Map();
    });
    twin.follow('/doppel/sources', (m) => {
      ({ links: this.links, joints: this.joints } = readSources(String(m['data'])));
      this.changed.emit();
    });
  }
  // The full path of a file that the twin names relative to its working folder; unchanged if no source is that file.
  whole(file: string): string {
    if (file.startsWith('/')) return file;
    for (const { file: known } of [...this.links.values(), ...this.joints.values()]) if (known.endsWith(`/${file}`)) return known;
    return file;
  }
}
