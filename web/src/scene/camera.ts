// Orbiting, named views, fitting and following.
import * as THREE from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import type { Stage } from './stage';

export const VIEWS = {
  corner: { label: 'Isometric', from: [1.0, -1.25, 0.75] },
  front: { label: 'Front', from: [1, 0, 0.0001] },
  back: { label: 'Back', from: [-1, 0, 0.0001] },
  left: { label: 'Left', from: [0, 1, 0.0001] },
  right: { label: 'Right', from: [0, -1, 0.0001] },
  top: { label: 'Top', from: [0.0001, 0, 1] },
} as const;
export type ViewName = keyof typeof VIEWS;

export class CameraMan {
  readonly controls: OrbitControls;
  private goal: { position: THREE.Vector3; target: THREE.Vector3 } | null = null;
  private centre = new THREE.Vector3(0, 0, 0.2);
  private size = 0.5;
  follow: (() => THREE.Vector3 | null) | null = null;
  touched = false; // by the user: the view is not chosen for them any more

  constructor(private readonly stage: Stage) {
    this.controls = new OrbitControls(stage.camera, stage.renderer.domElement);
    this.controls.enableDamping = false;
    this.controls.zoomToCursor = true;
    this.controls.minDistance = 0.02;
    this.controls.maxDistance = 80;
    this.controls.addEventListener('change', stage.invalidate);
    this.controls.addEventListener('start', () => {
      this.touched = true;
      this.goal = null;
    });
    stage.tick.on((dt) => this.advance(dt));
    stage.renderer.domElement.addEventListener('keydown', (event) => {
      if (this.key(event.key, event.shiftKey)) event.preventDefault();
    });
    this.jump('corner');
  }

  fit(box: THREE.Box3): void {
    if (box.isEmpty()) return;
    box.getCenter(this.centre);
    this.size = Math.max(0.05, box.getSize(new THREE.Vector3()).length());
    this.controls.maxDistance = Math.max(80, this.size * 4);
  }

  // Moves to the box without turning.
  frame(box: THREE.Box3): void {
    if (box.isEmpty()) return;
    this.fit(box);
    const { camera } = this.stage;
    this.goal = this.towards(camera.position.clone().sub(this.controls.target).normalize());
    if (!matchMedia('(prefers-reduced-motion: reduce)').matches) return;
    camera.position.copy(this.goal.position);
    this.controls.target.copy(this.goal.target);
    this.goal = null;
    this.controls.update();
    this.stage.invalidate();
  }

  private place(view: ViewName): { position: THREE.Vector3; target: THREE.Vector3 } {
    return this.towards(new THREE.Vector3(...VIEWS[view].from).normalize());
  }

  private towards(direction: THREE.Vector3): { position: THREE.Vector3; target: THREE.Vector3 } {
    const { camera } = this.stage;
    const vertical = THREE.MathUtils.degToRad(camera.fov) / 2;
    const narrow = Math.min(vertical, Math.atan(Math.tan(vertical) * camera.aspect));
    const distance = (this.size * 0.58) / Math.sin(narrow);
    const target = this.centre.clone();
    target.z += this.size * 0.04; // the buttons lie over the upper edge
    return { position: target.clone().addScaledVector(direction, distance), target };
  }

  jump(view: ViewName): void {
    const { position, target } = this.place(view);
    this.stage.camera.position.copy(position);
    this.controls.target.copy(target);
    this.controls.update();
    this.stage.invalidate();
  }

  go(view: ViewName): void {
    this.touched = true;
    if (matchMedia('(prefers-reduced-motion: reduce)').matches) this.jump(view);
    else this.goal = this.place(view);
  }

  // Arrows rotate, with shift they translate; Page Up and Page Down zoom. True: the key was for the camera.
  private key(key: string, shift: boolean): boolean {
    const { camera } = this.stage;
    const across = { ArrowLeft: -1, ArrowRight: 1 }[key] ?? 0, up = { ArrowUp: 1, ArrowDown: -1 }[key] ?? 0;
    const nearer = { PageUp: 1, PageDown: -1 }[key] ?? 0;
    if (across === 0 && up === 0 && nearer === 0) return false;
    this.touched = true;
    this.goal = null;
    const { target } = this.controls;
    const offset = camera.position.clone().sub(target);
    if (shift) {
      const step = offset.length() * 0.05;
      const move = new THREE.Vector3().setFromMatrixColumn(camera.matrix, 0).multiplyScalar(across * step).addScaledVector(new THREE.Vector3().setFromMatrixColumn(camera.matrix, 1), up * step);
      target.add(move);
    } else {
      const at = new THREE.Spherical().setFromVector3(offset.applyQuaternion(UP_TO_Y));
      at.theta += across * 0.1;
      at.phi = Math.min(Math.PI - 0.01, Math.max(0.01, at.phi - up * 0.1));
      at.radius = Math.min(this.controls.maxDistance, Math.max(this.controls.minDistance, at.radius * 0.85 ** nearer));
      offset.setFromSpherical(at).applyQuaternion(Y_TO_UP);
    }
    camera.position.copy(target).add(offset);
    this.controls.update();
    this.stage.invalidate();
    return true;
  }

  private advance(dt: number): void {
    const { camera } = this.stage;
    if (this.goal) {
      const share = 1 - Math.exp(-dt * 10);
      const fromOffset = camera.position.clone().sub(this.controls.target);
      const toOffset = this.goal.position.clone().sub(this.goal.target);
      const a = new THREE.Spherical().setFromVector3(fromOffset.applyQuaternion(UP_TO_Y));
      const b = new THREE.Spherical().setFromVector3(toOffset.applyQuaternion(UP_TO_Y));
      let turn = b.theta - a.theta;
      if (turn > Math.PI) turn -= 2 * Math.PI;
      if (turn < -Math.PI) turn += 2 * Math.PI;
      a.set(a.radius + (b.radius - a.radius) * share, a.phi + (b.phi - a.phi) * share, a.theta + turn * share);
      this.controls.target.lerp(this.goal.target, share);
      camera.position.setFromSpherical(a).applyQuaternion(Y_TO_UP).add(this.controls.target);
      if (camera.position.distanceTo(this.goal.position) < this.size * 0.002) this.goal = null;
      this.controls.update();
      this.stage.invalidate();
    } else if (this.follow) {
      const point = this.follow();
      if (!point) return;
      const move = point.clone().sub(this.controls.target);
      if (move.length() < 1e-5) return;
      camera.position.add(move);
      this.controls.target.add(move);
      this.controls.update();
      this.stage.invalidate();
    }
  }
}

const UP_TO_Y = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 0, 1), new THREE.Vector3(0, 1, 0));
const Y_TO_UP = UP_TO_Y.clone().invert();
