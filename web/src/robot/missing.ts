// The replacement of a mesh file that cannot be loaded: the collision shapes of its link, or a hatched red box with
// the file's name.
import * as THREE from 'three';
import { label } from './label';

const EDGE = 0.1; // m, as in `doppel snapshot`
const STRIPE = 8; // pixels
const LABEL = '#b3261e';

let material: THREE.MeshLambertMaterial | null = null;

function hatched(): THREE.MeshLambertMaterial {
  if (material) return material;
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 4 * STRIPE;
  const context = canvas.getContext('2d')!;
  context.fillStyle = '#fad6d2';
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.fillStyle = '#ce2c26';
  for (let x = -4; x < 8; x += 2) {
    context.beginPath();
    context.moveTo(x * STRIPE, 0);
    context.lineTo((x + 1) * STRIPE, 0);
    context.lineTo((x - 3) * STRIPE, 4 * STRIPE);
    context.lineTo((x - 4) * STRIPE, 4 * STRIPE);
    context.fill();
  }
  const map = new THREE.CanvasTexture(canvas);
  map.colorSpace = THREE.SRGBColorSpace;
  material = new THREE.MeshLambertMaterial({ map });
  return material;
}

export function missingBox(uri: string): THREE.Object3D {
  const box = new THREE.Mesh(new THREE.BoxGeometry(EDGE, EDGE, EDGE), hatched());
  box.castShadow = box.receiveShadow = true;
  box.userData['missing'] = uri;
  const name = label(uri.split('/').pop() ?? uri, LABEL, EDGE * 0.32);
  name.position.set(0, 0, EDGE * 0.6);
  box.add(name);
  return box;
}
