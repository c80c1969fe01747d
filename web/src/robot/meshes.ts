// Meshes by URI; each is read once.

import * as THREE from 'three';
import { STLLoader } from 'three/addons/loaders/STLLoader.js';
import type { AssetStore } from './assets';
import { creasedNormals } from './normals';

export type Loaded = { geometry: THREE.BufferGeometry } | { object: THREE.Object3D };

const CREASE_LIMIT = 150_000; // vertices; above, flat shading as in the file

function smooth(geometry: THREE.BufferGeometry): THREE.BufferGeometry {
  const positions = geometry.getAttribute('position')?.array;
  if (positions instanceof Float32Array && positions.length / 3 <= CREASE_LIMIT) {
    geometry.setAttribute('normal', new THREE.BufferAttribute(creasedNormals(positions, 0.6), 3));
  }
  return geometry;
}

async function read(assets: AssetStore, uri: string): Promise<Loaded> {
  const bytes = await assets.get(uri);
  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength) as ArrayBuffer;
  const kind = /\.(\w+)(?:[?#].*)?$/.exec(uri)?.[1]?.toLowerCase() ?? '';
  switch (kind) {
    case 'stl':
      return { geometry: smooth(new STLLoader().parse(buffer)) };
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

  constructor(private readonly assets: AssetStore) {}

  get(uri: string): Promise<Loaded> {
    let made = this.known.get(uri);
    if (!made) {
      made = read(this.assets, uri);
      made.catch(() => this.known.delete(uri));
      this.known.set(uri, made);
    }
    return made;
  }

  // After a restart or a reload files may have changed.
  forget(): void {
    this.known.clear();
    this.assets.forget();
  }
}
