// The layers over the links: inertia boxes, centres of mass, frames with names, joint axes with limits.
import * as THREE from 'three';
import { label } from '../robot/label';
import { inertiaMaterial } from '../robot/materials';
import { eigen3 } from './eigen';
import type { Tree } from '../robot/tree';
import type { LayerMaker } from '../robot/view';

const RED = 0xd1492e, GREEN = 0x2f9e63, BLUE = 0x2a7fd4;

function lines(points: number[], colour: number, opacity = 1): THREE.LineSegments {
  const geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.Float32BufferAttribute(points, 3));
  const made = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color: colour, depthTest: false, transparent: true, opacity }));
  made.renderOrder = 9;
  return made;
}

export function frameAxes(length: number): THREE.Group {
  const group = new THREE.Group();
  group.add(lines([0, 0, 0, length, 0, 0], RED), lines([0, 0, 0, 0, length, 0], GREEN), lines([0, 0, 0, 0, 0, length], BLUE));
  return group;
}

// The number of frames of parent links at the same place, so that names do not overlap.
function stacked(tree: Tree, link: number, near: number): number {
  let count = 0;
  for (let joint = tree.parentJoint[link]; joint && joint.index < 0 && Math.hypot(...joint.origin.xyz) < near; joint = tree.parentJoint[joint.parentLink]) count += 1;
  return count;
}

export function frames(size: number): LayerMaker {
  return (tree, link, into) => {
    into.add(frameAxes(size * 0.12));
    const dark = document.documentElement.dataset['theme'] === 'dark';
    const text = label(tree.links[link]!, dark ? '#e6e9ec' : '#1b1f24', size * 0.034);
    text.position.set(size * 0.012, 0, size * 0.012);
    text.center.y = -1.1 * stacked(tree, link, size * 0.03);
    into.add(text);
  };
}

export function centres(size: number): LayerMaker {
  return (tree, link, into) => {
    const inertial = tree.robot.links.get(tree.links[link]!)?.inertial;
    if (!inertial || inertial.mass <= 0) return;
    const radius = Math.min(size * 0.03, Math.max(size * 0.006, Math.cbrt(inertial.mass / 1000) * 0.12));
    const ball = new THREE.Mesh(new THREE.SphereGeometry(radius, 16, 12), new THREE.MeshBasicMaterial({ color: 0xd55e00, depthTest: false, transparent: true, opacity: 0.9 }));
    ball.position.set(...inertial.origin.xyz);
    ball.renderOrder = 8;
    into.add(ball);
  };
}

// The box of the same mass and inertia.
export const inertiaBoxes: LayerMaker = (tree, link, into) => {
  const inertial = tree.robot.links.get(tree.links[link]!)?.inertial;
  if (!inertial || inertial.mass <= 0) return;
  const [xx, xy, xz, yy, yz, zz] = inertial.inertia;
  const { values, vectors } = eigen3([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]);
  const [a, b, c] = values as [number, number, number];
  const side = (sum: number): number => Math.sqrt(Math.max(0, (6 * sum) / inertial.mass));
  const x = side(b + c - a), y = side(a + c - b), z = side(a + b - c);
  const holder = new THREE.Group();
  holder.position.set(...inertial.origin.xyz);
  holder.rotation.set(...inertial.origin.rpy, 'ZYX');
  const box = new THREE.Mesh(new THREE.BoxGeometry(x, y, z), inertiaMaterial);
  const [r0, r1, r2] = vectors as [number[], number[], number[]];
  const basis = new THREE.Matrix4().set(r0[0]!, r0[1]!, r0[2]!, 0, r1[0]!, r1[1]!, r1[2]!, 0, r2[0]!, r2[1]!, r2[2]!, 0, 0, 0, 0, 1);
  if (basis.determinant() < 0) basis.scale(new THREE.Vector3(1, 1, -1));
  box.setRotationFromMatrix(basis);
  box.add(new THREE.LineSegments(new THREE.EdgesGeometry(box.geometry), new THREE.LineBasicMaterial({ color: 0xcc79a7 })));
  holder.add(box);
  into.add(holder);
};

const sectorMaterial = new THREE.MeshBasicMaterial({ color: 0xe69f00, transparent: true, opacity: 0.16, side: THREE.DoubleSide, depthTest: false, depthWrite: false });

// The joint that carries the link: its axis and its range as an arc, in the joint's frame; rotated back by q.
export class AxisLayer {
  private readonly arcs: { joint: number; group: THREE.Group }[] = [];

  make(size: number): LayerMaker {
    return (tree: Tree, link: number, into: THREE.Group) => {
      const joint = tree.parentJoint[link];
      if (!joint || joint.index < 0) return;
      const length = size * 0.14;
      const along = new THREE.Vector3(...joint.axis);
      const arrow = new THREE.ArrowHelper(along, along.clone().multiplyScalar(-length * 0.5), length * 1.2, BLUE, length * 0.22, length * 0.1);
      for (const part of [arrow.line, arrow.cone]) {
        (part.material as THREE.Material).depthTest = false;
        part.renderOrder = 9;
      }
      into.add(arrow);
      if (joint.kind === 'prismatic') {
        const [lo, hi] = [joint.lower, joint.upper];
        const still = new THREE.Group();
        still.add(lines([...along.clone().multiplyScalar(lo).toArray(), ...along.clone().multiplyScalar(hi).toArray()], 0xe69f00));
        into.add(still);
        this.arcs.push({ joint: joint.index, group: still });
        still.userData['slide'] = along;
        return;
      }
      const side = Math.abs(along.x) < 0.9 ? new THREE.Vector3(1, 0, 0) : new THREE.Vector3(0, 1, 0);
      const u = side.sub(along.clone().multiplyScalar(side.dot(along))).normalize();
      const v = along.clone().cross(u);
      const radius = length * 0.62;
      const bounded = Number.isFinite(joint.lower);
      const [from, to] = bounded ? [joint.lower, joint.upper] : [0, 2 * Math.PI];
      const at = (angle: number, r: number): number[] => u.clone().multiplyScalar(Math.cos(angle) * r).addScaledVector(v, Math.sin(angle) * r).toArray();
      const points: number[] = [];
      const steps = Math.max(8, Math.ceil(((to - from) / Math.PI) * 32));
      for (let i = 0; i < steps; i += 1) {
        points.push(...at(from + ((to - from) * i) / steps, radius), ...at(from + ((to - from) * (i + 1)) / steps, radius));
      }
      if (bounded) points.push(...at(from, radius * 0.8), ...at(from, radius * 1.15), ...at(to, radius * 0.8), ...at(to, radius * 1.15));
      const still = new THREE.Group();
      const sector = new THREE.Mesh(new THREE.RingGeometry(radius * 0.08, radius, steps, 1, from, to - from), sectorMaterial);
      sector.setRotationFromMatrix(new THREE.Matrix4().makeBasis(u, v, along));
      sector.renderOrder = 8;
      still.add(sector, lines(points, 0xe69f00, 0.9));
      into.add(still, lines([...at(0, 0), ...at(0, radius)], 0xd55e00));
      this.arcs.push({ joint: joint.index, group: still });
      still.userData['axis'] = along;
    };
  }

  update(q: ArrayLike<number>): void {
    for (const { joint, group } of this.arcs) {
      const axis = group.userData['axis'] as THREE.Vector3 | undefined;
      if (axis) group.quaternion.setFromAxisAngle(axis, -q[joint]!);
      else group.position.copy(group.userData['slide'] as THREE.Vector3).multiplyScalar(-q[joint]!);
    }
  }
}
