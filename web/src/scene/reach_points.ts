// The map of the reach as points, each the middle of a cell, in colours of the share of directions in which the tool can
// point there. The half towards the camera is not drawn, so that the robot stays visible.
import * as THREE from 'three';
import type { App } from '../app/app';
import { COLOUR_MAP, colourStep } from '../app/colour_map';
import { PointBuffer } from '../app/points';
import type { Reach, ReachMap } from '../app/reach';
import { STRIDE } from '../robot/tree';
import { cssColour, type Legend } from './legend';

const PART = 0.42; // of a cell, the diameter of a point
const DOWN = 0x2a7fd4; // the colour of what is reached in the only direction

// Round points; those nearer to the camera than the middle are not current.
function pointMaterial(middle: THREE.Vector3, size: number): THREE.PointsMaterial {
  const material = new THREE.PointsMaterial({ size, vertexColors: true, toneMapped: false });
  material.onBeforeCompile = (shader) => {
    shader.uniforms['middle'] = { value: middle };
    shader.vertexShader = shader.vertexShader.replace('void main() {', 'uniform vec3 middle;\nvoid main() {')
      .replace('#include <fog_vertex>', `#include <fog_vertex>
      if (mvPosition.z > (modelViewMatrix * vec4(middle, 1.0)).z) gl_Position = vec4(0.0, 0.0, 2.0, 1.0);`);
    shader.fragmentShader = shader.fragmentShader.replace('#include <color_fragment>', `#include <color_fragment>
      if (length(gl_PointCoord - 0.5) > 0.5) discard;`);
  };
  return material;
}

export class ReachPoints {
  points: THREE.Points | null = null;
  private current: ReachMap | null = null;

  constructor(private readonly app: App, private readonly reach: Reach, private readonly legend: Legend) {
    reach.changed.on(() => this.update());
    app.world.stage.frame.on(() => this.place());
  }

  private update(): void {
    const { map } = this.reach;
    if (map === this.current) return;
    this.current = map;
    this.clear();
    if (map) this.draw(map);
    this.app.world.stage.invalidate();
  }

  private clear(): void {
    this.points?.removeFromParent();
    this.points?.geometry.dispose();
    (this.points?.material as THREE.Material | undefined)?.dispose();
    this.points = null;
    this.legend.show('reach', null);
  }

  private draw(map: ReachMap): void {
    const buffer = new PointBuffer();
    if (buffer.readCloud(map.cloud, 'share') !== '') return;
    const one = map.question.approach !== null;
    const positions: number[] = [], colours: number[] = [];
    const colour = new THREE.Color(), middle = new THREE.Vector3();
    for (let i = 0; i < buffer.count; i += 1) {
      const share = buffer.intensities[i]!;
      middle.x += buffer.positions[3 * i]! / buffer.count;
      middle.y += buffer.positions[3 * i + 1]! / buffer.count;
      middle.z += buffer.positions[3 * i + 2]! / buffer.count;
      if (one && share === 0) continue;
      const o = colourStep(share, 1) * 3;
      if (one) colour.set(DOWN);
      else colour.setRGB(COLOUR_MAP[o]! / 255, COLOUR_MAP[o + 1]! / 255, COLOUR_MAP[o + 2]! / 255, THREE.SRGBColorSpace);
      positions.push(...buffer.positions.subarray(3 * i, 3 * i + 3));
      colours.push(colour.r, colour.g, colour.b);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
    geometry.setAttribute('color', new THREE.Float32BufferAttribute(colours, 3));
    this.points = new THREE.Points(geometry, pointMaterial(middle, PART * map.question.cell));
    this.points.frustumCulled = false;
    this.points.matrixAutoUpdate = false;
    this.app.world.stage.scene.add(this.points);
    this.legend.show('reach', one ? { key: 'line', colour: cssColour(DOWN), label: 'Reach', value: 'tool pointing down' }
      : { key: 'colours', label: 'Reach, share of directions', value: '0 … 100 %' });
  }

  // In the robot's root link.
  private place(): void {
    const { twin } = this.app;
    if (!this.points || !twin.tree) return;
    const [x, y, z, qx, qy, qz, qw] = twin.poses.subarray(twin.tree.root * STRIDE);
    this.points.matrix.compose(new THREE.Vector3(x, y, z), new THREE.Quaternion(qx, qy, qz, qw), new THREE.Vector3(1, 1, 1));
    this.points.matrixWorldNeedsUpdate = true;
  }
}
