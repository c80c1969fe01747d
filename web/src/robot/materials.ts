// Materials of the description, one three.js material per colour.
import * as THREE from 'three';
import type { Material } from './urdf';

type Lit = THREE.MeshStandardMaterial | THREE.MeshLambertMaterial;
const cache = new Map<string, Lit>();
let simple = false;

// For rendering without a graphics card: light per vertex costs a fraction of light per pixel.
export function useSimpleMaterials(): void {
  simple = true;
}

export function materialOf(material: Material | null): Lit {
  const [r, g, b, a] = material?.color ?? [0.72, 0.73, 0.75, 1];
  const key = `${r} ${g} ${b} ${a}`;
  let made = cache.get(key);
  if (!made) {
    const common = { color: new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace), transparent: a < 1, opacity: a };
    made = simple ? new THREE.MeshLambertMaterial(common) : new THREE.MeshStandardMaterial({ ...common, roughness: 0.62, metalness: 0.05 });
    cache.set(key, made);
  }
  return made;
}

export const ghostMaterial = new THREE.MeshBasicMaterial({
  color: 0x56b4e9,
  transparent: true,
  opacity: 0.28,
  depthWrite: false,
});

export const collisionMaterial = new THREE.MeshBasicMaterial({ color: 0xe69f00, wireframe: true, transparent: true, opacity: 0.55 });
export const inertiaMaterial = new THREE.MeshBasicMaterial({ color: 0xcc79a7, transparent: true, opacity: 0.4, depthWrite: false });
