// Materials of the description, one three.js material per colour.
import * as THREE from 'three';
import type { Material } from './urdf';

export type Lit = THREE.MeshStandardMaterial | THREE.MeshLambertMaterial;
const cache = new Map<string, Lit>();
let simple = false;

// For rendering without a graphics card: lighting per vertex costs a fraction of lighting per pixel.
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

// The description's material with its texture.
export function texturedOf(material: Material, map: THREE.Texture): Lit {
  const key = `${material.texture} ${material.color?.join(' ')}`;
  let made = cache.get(key);
  if (!made) {
    made = materialOf({ ...material, color: material.color ?? [1, 1, 1, 1] }).clone();
    made.map = map;
    cache.set(key, made);
  }
  return made;
}

export const COMMANDED = 0x56b4e9, PAST = 0xcc79a7; // colours of the ghost

export const ghostMaterial = new THREE.MeshBasicMaterial({
  color: COMMANDED,
  transparent: true,
  opacity: 0.28,
  depthWrite: false,
});

export const collisionMaterial = new THREE.MeshBasicMaterial({ color: 0xe69f00, transparent: true, opacity: 0.16, depthWrite: false });
export const collisionEdges = new THREE.LineBasicMaterial({ color: 0xc98200, transparent: true, opacity: 0.8 });
export const inertiaMaterial = new THREE.MeshBasicMaterial({ color: 0xcc79a7, transparent: true, opacity: 0.4, depthWrite: false });
