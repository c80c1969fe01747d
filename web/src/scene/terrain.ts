// The surface of a heightmap, as published on /doppel/scene.
import * as THREE from 'three';
import type { Message } from '../protocol/cdr';
import { materialOf, type Lit } from '../robot/materials';

export interface Surface {
  positions: Float32Array; // m, [rows][columns]
  uv: Float32Array; // the whole terrain is 0 to 1
  indices: Uint32Array;
}

// Each cell is divided from its least x and y to its greatest, as it collides.
export function surfaceOf(terrain: Message): Surface {
  const columns = Number(terrain['columns']), rows = Number(terrain['rows']);
  const heights = terrain['heights'] as ArrayLike<number>;
  const width = Number(terrain['size_x']), depth = Number(terrain['size_y']);
  const positions = new Float32Array(columns * rows * 3), uv = new Float32Array(columns * rows * 2);
  const indices = new Uint32Array((columns - 1) * (rows - 1) * 6);
  let at = 0;
  for (let r = 0; r < rows; r += 1) {
    for (let c = 0; c < columns; c += 1) {
      const i = r * columns + c, u = c / (columns - 1), v = r / (rows - 1);
      positions.set([(u - 0.5) * width, (v - 0.5) * depth, heights[i]!], i * 3);
      uv.set([u, v], i * 2);
      if (c + 1 === columns || r + 1 === rows) continue;
      indices.set([i, i + 1, i + columns + 1, i, i + columns + 1, i + columns], at);
      at += 6;
    }
  }
  return { positions, uv, indices };
}

// The share of the texture that is seen at each point, 0 to 1: it begins at `height` and is alone `distance` higher.
export function coverage(positions: Float32Array, height: number, distance: number): Float32Array {
  const out = new Float32Array(positions.length / 3);
  for (let i = 0; i < out.length; i += 1) {
    const above = positions[i * 3 + 2]! - height;
    out[i] = distance > 0 ? Math.min(1, Math.max(0, above / distance)) : above >= 0 ? 1 : 0;
  }
  return out;
}

function layer(surface: Surface, material: Lit, index: number, covered: Float32Array | null): THREE.Mesh {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(surface.positions, 3));
  geometry.setAttribute('uv', new THREE.BufferAttribute(surface.uv, 2));
  geometry.setIndex(new THREE.BufferAttribute(surface.indices, 1));
  if (covered) {
    const colours = new Float32Array(covered.length * 4).fill(1);
    covered.forEach((share, i) => (colours[i * 4 + 3] = share));
    geometry.setAttribute('color', new THREE.BufferAttribute(colours, 4));
  }
  geometry.computeVertexNormals();
  const mesh = new THREE.Mesh(geometry, material);
  mesh.renderOrder = index;
  mesh.receiveShadow = true;
  mesh.castShadow = index === 0;
  return mesh;
}

// The terrain, with its textures one above the other. `textureOf` may fail for each of them.
export async function terrainOf(terrain: Message, textureOf: (uri: string, colour: boolean) => Promise<THREE.Texture>, failed: (uri: string, reason: string) => void): Promise<THREE.Group> {
  const surface = surfaceOf(terrain);
  const group = new THREE.Group();
  const uris = terrain['textures'] as string[], normals = terrain['normal_maps'] as string[];
  const sizes = terrain['texture_sizes'] as ArrayLike<number>;
  const load = async (uri: string, colour: boolean, size: number): Promise<THREE.Texture | null> => {
    if (!uri) return null;
    try {
      const texture = (await textureOf(uri, colour)).clone();
      texture.repeat.set(Number(terrain['size_x']) / size, Number(terrain['size_y']) / size);
      texture.anisotropy = 4;
      return texture;
    } catch (problem) {
      failed(uri, (problem as Error).message);
      return null;
    }
  };
  for (let i = 0; i < Math.max(1, uris.length); i += 1) {
    const size = Math.max(Number(sizes[i] ?? 1), 1e-3);
    const map = await load(uris[i] ?? '', true, size);
    const material = materialOf({ name: '', color: map ? [1, 1, 1, 1] : [0.62, 0.66, 0.56, 1], texture: null }).clone();
    material.map = map;
    material.normalMap = await load(normals[i] ?? '', false, size);
    if (i > 0) Object.assign(material, { transparent: true, vertexColors: true, depthWrite: false, polygonOffset: true, polygonOffsetFactor: -i, polygonOffsetUnits: -i });
    const heights = terrain['blend_heights'] as ArrayLike<number>, distances = terrain['blend_distances'] as ArrayLike<number>;
    if (i > 0 && heights[i - 1] === undefined) break; // without a <blend> it is not seen
    group.add(layer(surface, material, i, i === 0 ? null : coverage(surface.positions, heights[i - 1]!, Number(distances[i - 1]))));
  }
  return group;
}
