// The files that a mesh refers to (textures, material libraries, buffers): found in its text, fetched through the twin,
// passed to three's loaders as blobs.
import * as THREE from 'three';

export type FetchAsset = (uri: string) => Promise<Uint8Array>;
export interface Problem {
  uri: string;
  reason: string;
}

const TYPES: Record<string, string> = { png: 'image/png', jpg: 'image/jpeg', jpeg: 'image/jpeg', webp: 'image/webp', gif: 'image/gif', bmp: 'image/bmp' };

// The URI of a name in a mesh file, relative to that file. Absolute paths are those of the author's machine: only their
// last part is used.
export function beside(base: string, name: string): string {
  const plain = decode(name.trim()).replace(/\\/g, '/');
  if (/^(package|model):\/\//.test(plain)) return plain;
  const relative = /^(file:|[A-Za-z]:|\/)/.test(plain) ? plain.slice(plain.lastIndexOf('/') + 1) : plain;
  const scheme = /^[a-z]+:\/\//.exec(base)?.[0] ?? '';
  const parts = base.slice(scheme.length).split('/').slice(0, -1);
  for (const part of relative.split('/')) {
    if (part === '..') parts.pop();
    else if (part !== '.' && part !== '') parts.push(part);
  }
  return scheme + parts.join('/');
}

// The URI of an image in the folder for textures of the model of Gazebo that a mesh belongs to.
export function texturesFolder(base: string, name: string): string {
  return beside(base, `../materials/textures/${decode(name.trim()).replace(/\\/g, '/').split('/').pop()!}`);
}

function extensionOf(uri: string): string {
  return /\.(\w+)$/.exec(uri)?.[1]?.toLowerCase() ?? '';
}

function decode(text: string): string {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

export function colladaImages(text: string): string[] {
  const found = [...text.matchAll(/<init_from>\s*(?:<ref>)?([^<]+?)(?:<\/ref>)?\s*<\/init_from>/g)].map((m) => m[1]!.trim());
  return [...new Set(found)].filter((name) => /\.\w{3,4}$/.test(name)); // in later versions ids are there, too
}

export function objLibraries(text: string): string[] {
  return [...text.matchAll(/^[ \t]*mtllib[ \t]+(.+?)[ \t]*$/gm)].map((m) => m[1]!);
}

// The last word of a map line: options precede it.
export function mtlImages(text: string): string[] {
  return [...new Set([...text.matchAll(/^[ \t]*(?:map_\w+|bump|disp|norm)[ \t]+(.+?)[ \t]*$/gim)].map((m) => m[1]!.replace(/^(-\w+(\s+(on|off|-?[\d.]+(\s+-?[\d.]+)*|[rgbmlz]))?\s+)+/, '')))];
}

export function gltfFiles(text: string): string[] {
  const raw = JSON.parse(text) as { buffers?: { uri?: string }[]; images?: { uri?: string }[] };
  return [...(raw.buffers ?? []), ...(raw.images ?? [])].map((one) => one.uri ?? '').filter((uri) => uri !== '');
}

export class Bundle {
  readonly manager = new THREE.LoadingManager();
  readonly problems: Problem[] = [];
  private readonly urls = new Map<string, string>();
  private started = 0;
  private waiting: (() => void) | null = null;

  constructor(private readonly fetchAsset: FetchAsset, private readonly base: string) {
    const known = (url: string): string | undefined => this.urls.get(url) ?? this.urls.get(decode(url));
    this.manager.setURLModifier((url) => (/^(blob|data):/.test(url) ? known(url) ?? url : known(url) ?? this.nothing()));
    this.manager.itemStart = () => {
      this.started += 1;
    };
    this.manager.itemEnd = () => {
      this.started -= 1;
      if (this.started === 0) this.waiting?.();
    };
  }

  // Fetches the named files; what is not available is reported, and the mesh is drawn without it.
  async add(names: string[]): Promise<void> {
    await Promise.all(names.map(async (name) => {
      const uri = name.startsWith('data:') ? name : beside(this.base, name);
      try {
        const bytes = uri.startsWith('data:') ? dataBytes(uri) : await this.fetch(uri, name);
        const kind = extensionOf(uri);
        this.urls.set(name, URL.createObjectURL(new Blob([bytes as BlobPart], { type: TYPES[kind] ?? /^data:([^;,]+)/.exec(uri)?.[1] ?? 'application/octet-stream' })));
      } catch (problem) {
        this.problems.push({ uri: uri.slice(0, 200), reason: (problem as Error).message });
      }
    }));
  }

  // A model of Gazebo may have the images of its meshes in materials/textures.
  private async fetch(uri: string, name: string): Promise<Uint8Array> {
    try {
      return await this.fetchAsset(uri);
    } catch (problem) {
      const other = texturesFolder(this.base, name);
      if (other === uri || !(extensionOf(uri) in TYPES)) throw problem;
      return this.fetchAsset(other).catch(() => Promise.reject(problem));
    }
  }

  // One white pixel, for a missing image.
  private nothing(): string {
    const known = this.urls.get('') ?? URL.createObjectURL(new Blob([dataBytes(WHITE) as BlobPart], { type: 'image/gif' }));
    this.urls.set('', known);
    return known;
  }

  // Until the loaders have read everything that they requested.
  async done(): Promise<void> {
    if (this.started > 0) await Promise.race([new Promise<void>((ready) => (this.waiting = ready)), new Promise((ready) => setTimeout(ready, 5000))]);
    for (const url of this.urls.values()) URL.revokeObjectURL(url);
  }
}

const WHITE = 'data:image/gif;base64,R0lGODlhAQABAIAAAP///wAAACwAAAAAAQABAAACAkQBADs=';

function dataBytes(uri: string): Uint8Array {
  const comma = uri.indexOf(',');
  const body = uri.slice(comma + 1);
  if (!/;base64$/.test(uri.slice(0, comma))) return new TextEncoder().encode(decode(body));
  return Uint8Array.from(atob(body), (c) => c.charCodeAt(0));
}
