// Meshes by URI: fetched through the twin (fetchAsset), or from the development server; each is read once.

import * as THREE from 'three';
import type { Client } from '../protocol/client';

export type Loaded = { geometry: THREE.BufferGeometry } | { object: THREE.Object3D };

const CREASE_LIMIT = 150_000; // vertices; above, flat shading as in the file

async function bytesOf(client: Client, uri: string): Promise<Uint8Array> {
  if (client.capabilities.has('assets')) return client.fetchAsset(uri);
  const answer = await fetch(`dev-asset?uri=${encodeURIComponent(uri)}`);
  if (!answer.ok) throw new Error(`${answer.status} ${answer.statusText}`);
  return new Uint8Array(await answer.arrayBuffer());
}

async function smooth(geometry: THREE.BufferGeometry): Promise<THREE.BufferGeometry> {
  const count = geometry.getAttribute('position')?.count ?? 0;
  if (count === 0 || count > CREASE_LIMIT) return geometry;
  const { toCreasedNormals } = await import('three/addons/utils/BufferGeometryUtils.js');
  geometry.deleteAttribute('normal');
  return toCreasedNormals(geometry, 0.6);
}

async function read(client: Client, uri: string): Promise<Loaded> {
  const bytes = await bytesOf(client, uri);
  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength) as ArrayBuffer;
  const kind = /\.(\w+)(?:[?#].*)?$/.exec(uri)?.[1]?.toLowerCase() ?? '';
  switch (kind) {
    case 'stl': {
      const { STLLoader } = await import('three/addons/loaders/STLLoader.js');
      return { geometry: await smooth(new STLLoader().parse(buffer)) };
    }
    case 'dae': {
      const { ColladaLoader } = await import('three/addons/loaders/ColladaLoader.js');
      const made = new ColladaLoader().parse(new TextDecoder().decode(buffer), '');
      const object = made.scene;
      // The loader turns Y-up files so that they stand in a Y-up scene; here Z is up, as ROS reads them.
      object.rotation.set(0, 0, 0);
      return { object };
    }
    case 'obj': {
      const { OBJLoader } = await import('three/addons/loaders/OBJLoader.js');
      return { object: new OBJLoader().parse(new TextDecoder().decode(buffer)) };
    }
    case 'glb':
    case 'gltf': {
      const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
      return { object: (await new GLTFLoader().parseAsync(buffer, '')).scene };
    }
    default:
      throw new Error(`meshes of the kind '${kind}' are not drawn`);
  }
}

export class MeshStore {
  private readonly known = new Map<string, Promise<Loaded>>();

  constructor(private readonly client: Client) {}

  get(uri: string): Promise<Loaded> {
    let made = this.known.get(uri);
    if (!made) {
      made = read(this.client, uri);
      made.catch(() => this.known.delete(uri));
      this.known.set(uri, made);
    }
    return made;
  }

  // After a restart or a reload files may have changed.
  forget(): void {
    this.known.clear();
  }
}
