// The pose that a joint is brought to: the links that it moves in a colour, its axis, and an arrow in the positive direction.
import * as THREE from 'three';
import type { App } from '../app/app';
import { format, unitOf } from '../app/units';
import { label } from '../robot/label';
import { RobotView } from '../robot/view';
import type { Tree, TreeJoint } from '../robot/tree';
import { cssColour, type Legend } from './legend';

const MOVED = 0xd55e00, AXIS = 0x0072b2;
const ENTRY = 'pose of the calibration', DIRECTION = 'positive direction';
const LENGTH_SHARE = 0.3; // of the picture's size
const ARC = { from: 0.25, to: 1.85 }; // rad, from the pose on

const material = new THREE.MeshBasicMaterial({ color: MOVED, transparent: true, opacity: 0.5, depthWrite: false });
const drawn = new THREE.MeshBasicMaterial({ color: AXIS, depthTest: false, transparent: true });

function tube(path: THREE.Curve<THREE.Vector3>, radius: number): THREE.Mesh {
  const made = new THREE.Mesh(new THREE.TubeGeometry(path, 48, radius, 8), drawn);
  made.renderOrder = 9;
  return made;
}

function cone(at: THREE.Vector3, along: THREE.Vector3, size: number): THREE.Mesh {
  const made = new THREE.Mesh(new THREE.ConeGeometry(size * 0.36, size, 20), drawn);
  made.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), along.clone().normalize());
  made.position.copy(at).addScaledVector(along.clone().normalize(), size * 0.3);
  made.renderOrder = 9;
  return made;
}

class Arc extends THREE.Curve<THREE.Vector3> {
  constructor(private readonly u: THREE.Vector3, private readonly v: THREE.Vector3, private readonly radius: number) {
    super();
  }
  override getPoint(share: number, target = new THREE.Vector3()): THREE.Vector3 {
    const angle = ARC.from + (ARC.to - ARC.from) * share;
    return target.copy(this.u).multiplyScalar(Math.cos(angle) * this.radius).addScaledVector(this.v, Math.sin(angle) * this.radius);
  }
}

// In the frame of the link that the joint moves.
function directionOf(joint: TreeJoint, size: number): THREE.Group {
  const out = new THREE.Group();
  const along = new THREE.Vector3(...joint.axis).normalize();
  const length = size * LENGTH_SHARE, thin = length * 0.014;
  const ends = [along.clone().multiplyScalar(-length * 0.5), along.clone().multiplyScalar(length * 0.5)] as const;
  out.add(tube(new THREE.LineCurve3(...ends), thin));
  const plus = label('+', cssColour(AXIS), length * 0.3);
  plus.center.set(0.5, 0.5);
  if (joint.kind === 'prismatic') {
    out.add(cone(ends[1], along, length * 0.16));
    plus.position.copy(ends[1]).addScaledVector(along, length * 0.22);
  } else {
    const side = Math.abs(along.x) < 0.9 ? new THREE.Vector3(1, 0, 0) : new THREE.Vector3(0, 1, 0);
    const u = side.addScaledVector(along, -side.dot(along)).normalize();
    const arc = new Arc(u, along.clone().cross(u), length * 0.42);
    const end = arc.getPoint(1);
    out.add(tube(arc, thin * 1.5), cone(end, arc.getTangent(1), length * 0.14));
    plus.position.copy(end).multiplyScalar(1.25).addScaledVector(arc.getTangent(1), length * 0.18);
  }
  out.add(plus);
  return out;
}

export interface Target {
  joint: string;
  position: number; // rad or m
}

export class CalibrationGhost {
  target: Target | null = null;
  view: RobotView | null = null;
  moved: string[] = []; // links
  private direction: THREE.Group | null = null;
  private directionOf = '';

  constructor(private readonly app: App, private readonly legend: Legend) {
    app.twin.robotChanged.on(() => {
      this.view?.root.removeFromParent();
      this.view = this.direction = null;
      this.directionOf = '';
      this.draw();
    });
    app.twin.moved.on(() => {
      if (this.target) this.draw();
    });
    addEventListener('themechange', () => {
      this.directionOf = '';
      this.draw();
    });
  }

  // null: no longer.
  show(target: Target | null): void {
    if (target?.joint === this.target?.joint && target?.position === this.target?.position) return;
    this.target = target;
    this.app.world.calibrating = target !== null;
    this.draw();
  }

  // The poses of the links with the joint at this position and the others as measured.
  private posesAt(tree: Tree, joint: TreeJoint, position: number): Float64Array {
    const { twin } = this.app;
    const q = Float64Array.from(twin.q);
    q[joint.index] = position;
    tree.follow(q);
    const poses = Float64Array.from(twin.poses);
    tree.forward(q, poses);
    return poses;
  }

  private hide(): void {
    if (this.view) this.view.root.visible = false;
    for (const entry of [ENTRY, DIRECTION]) this.legend.show(entry, null);
    this.app.world.stage.invalidate();
  }

  private draw(): void {
    const { twin, world } = this.app;
    const { tree } = twin;
    const joint = this.target ? tree?.jointByName.get(this.target.joint) : undefined;
    if (!tree || !joint || !this.target) {
      this.hide();
      return;
    }
    if (!this.view) {
      this.view = new RobotView(tree, world.meshes, world.stage.invalidate, material);
      this.view.show('visual', true);
      world.stage.scene.add(this.view.root);
    }
    const below = new Set([joint.childLink]);
    for (const one of tree.joints) if (below.has(one.parentLink)) below.add(one.childLink);
    this.moved = tree.links.filter((_, i) => below.has(i));
    this.view.links.forEach((link, i) => (link.visible = below.has(i)));
    if (this.directionOf !== joint.name) {
      this.direction?.removeFromParent();
      this.direction = directionOf(joint, world.size);
      this.directionOf = joint.name;
      this.view.links[joint.childLink]!.add(this.direction);
    }
    this.view.place(this.posesAt(tree, joint, this.target.position));
    this.view.root.visible = true;
    this.legend.show(ENTRY, { key: 'line', colour: cssColour(MOVED), label: joint.name, value: `at ${format(joint, this.target.position)} ${unitOf(joint)}` });
    this.legend.show(DIRECTION, { key: 'arrow', colour: cssColour(AXIS), label: 'its positive direction', value: '' });
    world.stage.invalidate();
  }
}
