// A path over the last seconds: of the tool, or of the base.
import * as THREE from 'three';

const SIZE = 3000;

export class Trace {
  private readonly positions = new Float32Array(SIZE * 3);
  private readonly geometry = new THREE.BufferGeometry();
  readonly line: THREE.Line;
  private count = 0;

  constructor(colour = 0xd55e00) {
    const attribute = new THREE.BufferAttribute(this.positions, 3);
    attribute.setUsage(THREE.DynamicDrawUsage);
    this.geometry.setAttribute('position', attribute);
    this.line = new THREE.Line(this.geometry, new THREE.LineBasicMaterial({ color: colour }));
    this.line.frustumCulled = false;
    this.geometry.setDrawRange(0, 0);
  }

  add(x: number, y: number, z: number): void {
    const { positions } = this;
    if (this.count > 0) {
      const o = (this.count - 1) * 3;
      if (Math.hypot(positions[o]! - x, positions[o + 1]! - y, positions[o + 2]! - z) < 0.0005) return;
    }
    if (this.count === SIZE) {
      positions.copyWithin(0, SIZE * 0.25 * 3);
      this.count = SIZE * 0.75;
    }
    positions.set([x, y, z], this.count * 3);
    this.count += 1;
    this.geometry.setDrawRange(0, this.count);
    this.geometry.getAttribute('position').needsUpdate = true;
  }

  clear(): void {
    this.count = 0;
    this.geometry.setDrawRange(0, 0);
  }
}
