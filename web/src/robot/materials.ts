// Materials of the description, one three.js material per colour.
import * as THREE from 'three';
import type { Material } from './urdf';

const cache = new Map<string, THREE.MeshStandardMaterial>();

export function materialOf(material: Material | null): THREE.MeshStandardMaterial {
  const [r, g, b, a] = material?.color ?? [0.72, 0.73, 0.75, 1];
  const key = `${r} ${g} ${b} ${a}`;
  let made = cache.get(key);
  if (!made) {
    made = new THREE.MeshStandardMaterial({
      color: new THREE.Color().setRGB(r, g, b, THREE.SRGBColorSpace),
      roughness: 0.62,
      metalness: 0.05,
      transparent: a < 1,
      opacity: a,
    });
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
