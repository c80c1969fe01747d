// Meshes by URI; each is read once.

import * as THREE from 'three';
import { STLLoader } from 'three/addons/loaders/STLLoader.js';
import type { AssetStore } from './assets';
import { beside, Bundle, colladaImages, gltfFiles, mtlImages, objLibraries, type Problem } from './bundle';
import { creasedNormals } from './normals';

// In an object, each mesh's `userData.bare` lists its materials that are not from the file: they get the description's
// colour.
export type Loaded = ({ geometry: THREE.BufferGeometry } | { object: THREE.Object3D }) & { problems?: Problem[] };

const CREASE_LIMIT = 150_000; // vertices; above, flat shading as in the file

function smooth(geometry: THREE.BufferGeometry): THREE.BufferGeometry {
  const positions = geometry.getAttribute('position')?.array;
  if (positions instanceof Float32Array && positions.length / 3 <= CREASE_LIMIT) {
    geometry.setAttribute('normal', new THREE.BufferAttribute(creasedNormals(positions, 0.6), 3));
  }
  return geometry;
}

function finish(object: THREE.Object3D, bare: (material: THREE.Material) => boolean): void {
  object.traverse((one) => {
    if (!(one instanceof THREE.Mesh)) return;
    one.userData['bare'] = [one.material].flat().map(bare);
    const geometry = one.geometry as THREE.BufferGeometry;
    if (!geometry.hasAttribute('normal')) geometry.computeVertexNormals(); // without it the mesh would be black
  });
}

// Many exporters write the opacity of a solid material as its complement; a mesh that is not visible at all is not meant.
export function showOpaque(material: THREE.Material): void {
  if (material.opacity > 0) return;
  material.opacity = 1;
  material.transparent = false;
}

async function readCollada(text: string, bundle: Bundle): Promise<THREE.Object3D> {
  const { ColladaLoader } = await import('three/addons/loaders/ColladaLoader.js');
  await bundle.add(colladaImages(text));
  const object = new ColladaLoader(bundle.manager).parse(text, '').scene;
  // The loader rotates Y-up files for a Y-up scene; here Z is up, as in ROS.
  object.rotation.set(0, 0, 0);
  object.traverse((one) => {
    if (one instanceof THREE.Mesh) for (const material of [one.material].flat() as THREE.Material[]) showOpaque(material);
  });
  finish(object, (material) => material.name === THREE.Loader.DEFAULT_MATERIAL_NAME);
  return object;
}

async function readObj(text: string, bundle: Bundle, fetchAsset: (name: string) => Promise<string>): Promise<THREE.Object3D> {
  const { OBJLoader } = await import('three/addons/loaders/OBJLoader.js');
  const loader = new OBJLoader(bundle.manager);
  const known = new Set<string>();
  for (const library of objLibraries(text)) {
    try {
      const mtl = await fetchAsset(library);
      await bundle.add(mtlImages(mtl));
      const { MTLLoader } = await import('three/addons/loaders/MTLLoader.js');
      const materials = new MTLLoader(bundle.manager).parse(mtl, '');
      materials.preload();
      for (const name of Object.keys(materials.materials)) known.add(name);
      loader.setMaterials(materials);
    } catch (problem) {
      bundle.problems.push({ uri: library, reason: (problem as Error).message });
    }
  }
  const object = loader.parse(text);
  finish(object, (material) => !known.has(material.name));
  return object;
}

async function readGltf(buffer: ArrayBuffer, bundle: Bundle): Promise<THREE.Object3D> {
  const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
  const binary = new DataView(buffer).getUint32(0, true) === 0x46546c67; // "glTF"
  if (!binary) await bundle.add(gltfFiles(new TextDecoder().decode(buffer)));
  const { scene, parser } = await new GLTFLoader(bundle.manager).parseAsync(buffer, '');
  finish(scene, (material) => parser.associations.get(material) === undefined);
  return scene;
}

async function read(assets: AssetStore, uri: string): Promise<Loaded> {
  const bytes = await assets.get(uri);
  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength) as ArrayBuffer;
  const text = (): string => new TextDecoder().decode(buffer);
  const kind = /\.(\w+)(?:[?#].*)?$/.exec(uri)?.[1]?.toLowerCase() ?? '';
  if (kind === 'stl') return { geometry: smooth(new STLLoader().parse(buffer)) };
  const bundle = new Bundle((one) => assets.get(one), uri);
  let object: THREE.Object3D;
  if (kind === 'dae') object = await readCollada(text(), bundle);
  else if (kind === 'obj') object = await readObj(text(), bundle, async (name) => new TextDecoder().decode(await assets.get(beside(uri, name))));
  else if (kind === 'glb' || kind === 'gltf') object = await readGltf(buffer, bundle);
  else throw new Error(`meshes of the kind '${kind}' are not drawn`);
  await bundle.done();
  return { object, problems: bundle.problems };
}

// The convex hull of all vertices: the collision shape of a mesh.
async function hullOf(loaded: Loaded): Promise<THREE.BufferGeometry> {
  const points = new Map<string, THREE.Vector3>();
  const take = (geometry: THREE.BufferGeometry, matrix: THREE.Matrix4 | null): void => {
    const position = geometry.getAttribute('position');
    for (let i = 0; i < position.count; i += 1) {
      const point = new THREE.Vector3().fromBufferAttribute(position, i);
      if (matrix) point.applyMatrix4(matrix);
      points.set(`${point.x.toPrecision(5)} ${point.y.toPrecision(5)} ${point.z.toPrecision(5)}`, point);
    }
  };
  if ('geometry' in loaded) {
    take(loaded.geometry, null);
  } else {
    loaded.object.updateMatrixWorld(true);
    loaded.object.traverse((one) => {
      if (one instanceof THREE.Mesh) take(one.geometry as THREE.BufferGeometry, one.matrixWorld);
    });
  }
  const { ConvexGeometry } = await import('three/addons/geometries/ConvexGeometry.js');
  await new Promise((ready) => setTimeout(ready)); // one hull at a time between two frames
  return new ConvexGeometry([...points.values()]);
}

async function readTexture(assets: AssetStore, uri: string, colour: boolean): Promise<THREE.Texture> {
  const bytes = await assets.get(uri);
  const picture = await createImageBitmap(new Blob([bytes as BlobPart]), { imageOrientation: 'flipY' });
  const texture = new THREE.Texture(picture as unknown as HTMLImageElement);
  texture.flipY = false; // it already is
  if (colour) texture.colorSpace = THREE.SRGBColorSpace;
  texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
  texture.needsUpdate = true;
  return texture;
}

// The cached value of `key`, or a new one; failures are not cached, so that they can be repeated.
function once<T>(known: Map<string, Promise<T>>, key: string, make: () => Promise<T>): Promise<T> {
  let made = known.get(key);
  if (!made) {
    made = make();
    made.catch(() => known.delete(key));
    known.set(key, made);
  }
  return made;
}

export class MeshStore {
  private readonly known = new Map<string, Promise<Loaded>>();
  private readonly hulls = new Map<string, Promise<THREE.BufferGeometry>>();
  private readonly textures = new Map<string, Promise<THREE.Texture>>();

  constructor(private readonly assets: AssetStore) {}

  get(uri: string): Promise<Loaded> {
    return once(this.known, uri, () => read(this.assets, uri));
  }

  // The convex hull of the mesh, in the mesh's own units.
  hull(uri: string): Promise<THREE.BufferGeometry> {
    return once(this.hulls, uri, () => this.get(uri).then(hullOf));
  }

  // `colour`: of colours, else of other values, such as normals.
  texture(uri: string, colour = true): Promise<THREE.Texture> {
    return once(this.textures, `${colour} ${uri}`, () => readTexture(this.assets, uri, colour));
  }

  // After a restart or a reload files may have changed.
  forget(): void {
    this.known.clear();
    this.hulls.clear();
    this.textures.clear();
    this.assets.forget();
  }
}
