// Materials of a world's objects beyond the colour of their marker, and named parts of meshes.
import * as THREE from 'three';
import type { Message } from '../protocol/cdr';
import { materialOf, type Lit } from '../robot/materials';

export interface Look {
  color: [number, number, number, number];
  texture: string; // URI; '': none
  physical: Message | undefined; // doppel_msgs/PhysicalMaterial
}

// Which of its materials are not from its file.
export function bareOf(mesh: THREE.Mesh): boolean[] {
  return (mesh.userData['bare'] as boolean[] | undefined) ?? [];
}

// `load`: null where a map is missing. Channels of maps are those of glTF.
// `reflection` is what metals show of the surroundings.
export async function physicalOf(look: Look, reflection: THREE.Texture, load: (uri: unknown, colour: boolean) => Promise<THREE.Texture | null>): Promise<Lit> {
  const { physical } = look;
  const made = materialOf({ name: '', color: look.color, texture: null }).clone();
  made.map = await load(look.texture, true);
  if (!physical) return made;
  const { r, g, b } = physical['emissive'] as unknown as { r: number; g: number; b: number };
  made.emissiveMap = await load(physical['emissive_map'], true);
  made.emissive.setRGB(r, g, b, THREE.SRGBColorSpace);
  if (made.emissiveMap && r + g + b === 0) made.emissive.set(0xffffff);
  made.normalMap = await load(physical['normal_map'], false);
  if (made instanceof THREE.MeshStandardMaterial) {
    const roughness = Number(physical['roughness']), metalness = Number(physical['metalness']);
    made.roughnessMap = await load(physical['roughness_map'], false);
    made.metalnessMap = await load(physical['metalness_map'], false);
    if (roughness >= 0) made.roughness = roughness;
    else if (made.roughnessMap) made.roughness = 1;
    if (metalness >= 0) made.metalness = metalness;
    else if (made.metalnessMap) made.metalness = 1;
    if (made.metalness > 0.1) made.envMap = reflection;
  }
  return made;
}

// The node that "FILE#NAME" or "FILE#NAME&center" names, with its materials, or null.
export function partOf(whole: THREE.Object3D, resource: string): THREE.Object3D | null {
  const [, name, center] = /#(.*?)(&center)?$/.exec(resource) ?? [];
  if (name === undefined) return null;
  whole.updateMatrixWorld(true);
  let found: THREE.Object3D | null = null;
  whole.traverse((one) => {
    if (!found && (one.name === name || one.userData['name'] === name)) found = one;
  });
  if (!found) return null;
  const node = found as THREE.Object3D;
  const out = new THREE.Group(), copy = node.clone();
  new THREE.Matrix4().copy(whole.matrixWorld).invert().multiply(node.matrixWorld).decompose(copy.position, copy.quaternion, copy.scale);
  out.add(copy);
  if (center) {
    const middle = new THREE.Box3().setFromObject(out).getCenter(new THREE.Vector3());
    copy.position.sub(middle);
  }
  return out;
}
