// Kinematics of a robot: link poses from joint positions. Plain arrays: a pose is a position (3) and a unit quaternion
// x y z w (4).

import type { Joint, Pose, Robot } from './urdf';

export const STRIDE = 7;

export interface TreeJoint extends Joint {
  index: number; // in the position vector; -1: fixed
  parentLink: number;
  childLink: number;
  mimicIndex: number; // of the leader; -1: none
  offset: Float64Array; // pose of the joint in its parent
}

export function quatMultiply(a: ArrayLike<number>, ai: number, b: ArrayLike<number>, bi: number, out: Float64Array, o: number): void {
  const ax = a[ai]!, ay = a[ai + 1]!, az = a[ai + 2]!, aw = a[ai + 3]!;
  const bx = b[bi]!, by = b[bi + 1]!, bz = b[bi + 2]!, bw = b[bi + 3]!;
  out[o] = aw * bx + ax * bw + ay * bz - az * by;
  out[o + 1] = aw * by - ax * bz + ay * bw + az * bx;
  out[o + 2] = aw * bz + ax * by - ay * bx + az * bw;
  out[o + 3] = aw * bw - ax * bx - ay * by - az * bz;
}

// out = q * v, with v at vi
export function rotate(q: ArrayLike<number>, qi: number, x: number, y: number, z: number, out: Float64Array | number[], o: number): void {
  const qx = q[qi]!, qy = q[qi + 1]!, qz = q[qi + 2]!, qw = q[qi + 3]!;
  const tx = 2 * (qy * z - qz * y), ty = 2 * (qz * x - qx * z), tz = 2 * (qx * y - qy * x);
  out[o] = x + qw * tx + qy * tz - qz * ty;
  out[o + 1] = y + qw * ty + qz * tx - qx * tz;
  out[o + 2] = z + qw * tz + qx * ty - qy * tx;
}

export function poseToArray(pose: Pose): Float64Array {
  const [r, p, y] = pose.rpy.map((angle) => angle / 2) as [number, number, number];
  const cr = Math.cos(r), sr = Math.sin(r), cp = Math.cos(p), sp = Math.sin(p), cy = Math.cos(y), sy = Math.sin(y);
  return Float64Array.of(
    ...pose.xyz,
    sr * cp * cy - cr * sp * sy,
    cr * sp * cy + sr * cp * sy,
    cr * cp * sy - sr * sp * cy,
    cr * cp * cy + sr * sp * sy,
  );
}

export function compose(a: ArrayLike<number>, ai: number, b: ArrayLike<number>, bi: number, out: Float64Array, o: number): void {
  const t = [0, 0, 0];
  rotate(a, ai + 3, b[bi]!, b[bi + 1]!, b[bi + 2]!, t, 0);
  const x = a[ai]! + t[0]!, y = a[ai + 1]! + t[1]!, z = a[ai + 2]! + t[2]!;
  quatMultiply(a, ai + 3, b, bi + 3, out, o + 3);
  out[o] = x;
  out[o + 1] = y;
  out[o + 2] = z;
}

export function inversePose(pose: ArrayLike<number>): Float64Array {
  const out = Float64Array.of(0, 0, 0, -pose[3]!, -pose[4]!, -pose[5]!, pose[6]!);
  rotate(out, 3, -pose[0]!, -pose[1]!, -pose[2]!, out, 0);
  return out;
}

export class Tree {
  readonly links: string[] = [];
  readonly linkIndex = new Map<string, number>();
  readonly joints: TreeJoint[] = []; // parents first
  readonly moving: TreeJoint[] = []; // those with a position, in its order
  readonly jointByName = new Map<string, TreeJoint>();
  readonly parentJoint: (TreeJoint | null)[] = []; // by link
  readonly root: number;

  constructor(readonly robot: Robot) {
    for (const name of robot.links.keys()) {
      this.linkIndex.set(name, this.links.length);
      this.links.push(name);
      this.parentJoint.push(null);
    }
    const children = new Map<string, Joint[]>();
    const owned = new Set<string>();
    for (const joint of robot.joints) {
      const list = children.get(joint.parent) ?? [];
      list.push(joint);
      children.set(joint.parent, list);
      owned.add(joint.child);
    }
    this.root = Math.max(0, this.links.findIndex((name) => !owned.has(name)));
    // Depth first, so that the joints of a limb follow each other in lists; parents precede their children.
    const root = this.links[this.root] ?? '';
    const waiting = (children.get(root) ?? []).slice().reverse();
    const done = new Set([root]);
    while (waiting.length > 0) {
      const joint = waiting.pop()!;
      if (done.has(joint.child)) continue;
      done.add(joint.child);
      this.add(joint);
      waiting.push(...(children.get(joint.child) ?? []).slice().reverse());
    }
    for (const joint of this.moving) {
      if (joint.mimic) joint.mimicIndex = this.jointByName.get(joint.mimic.joint)?.index ?? -1;
    }
  }

  private add(joint: Joint): void {
    const moves = joint.kind === 'revolute' || joint.kind === 'continuous' || joint.kind === 'prismatic';
    const made: TreeJoint = {
      ...joint,
      index: moves ? this.moving.length : -1,
      parentLink: this.linkIndex.get(joint.parent)!,
      childLink: this.linkIndex.get(joint.child)!,
      mimicIndex: -1,
      offset: poseToArray(joint.origin),
    };
    this.joints.push(made);
    this.jointByName.set(joint.name, made);
    this.parentJoint[made.childLink] = made;
    if (moves) this.moving.push(made);
  }

  get size(): number {
    return this.moving.length;
  }

  rest(): Float64Array {
    return Float64Array.from(this.moving, (joint) => Math.min(joint.upper, Math.max(joint.lower, 0)));
  }

  // Sets mimic joints according to their leaders.
  follow(q: Float64Array): void {
    for (const joint of this.moving) {
      if (joint.mimic && joint.mimicIndex >= 0) {
        q[joint.index] = joint.mimic.multiplier * q[joint.mimicIndex]! + joint.mimic.offset;
      }
    }
  }

  newPoses(): Float64Array {
    const poses = new Float64Array(this.links.length * STRIDE);
    for (let i = 6; i < poses.length; i += STRIDE) poses[i] = 1;
    return poses;
  }

  // The root's pose in `poses` is not changed.
  forward(q: ArrayLike<number>, poses: Float64Array): void {
    const frame = scratch;
    const turn = scratch2;
    for (const joint of this.joints) {
      compose(poses, joint.parentLink * STRIDE, joint.offset, 0, frame, 0);
      const o = joint.childLink * STRIDE;
      if (joint.index < 0) {
        poses.set(frame, o);
        continue;
      }
      const value = q[joint.index]!;
      const [x, y, z] = joint.axis;
      if (joint.kind === 'prismatic') {
        turn.set([x * value, y * value, z * value, 0, 0, 0, 1]);
      } else {
        const s = Math.sin(value / 2);
        turn.set([0, 0, 0, x * s, y * s, z * s, Math.cos(value / 2)]);
      }
      compose(frame, 0, turn, 0, poses, o);
    }
  }

  // Joints with a position between the root and the link, from the root; a mimic joint is represented by its leader.
  chain(link: number): TreeJoint[] {
    const out: TreeJoint[] = [];
    for (let joint = this.parentJoint[link]; joint; joint = this.parentJoint[joint.parentLink]) {
      if (joint.index >= 0) out.push(joint);
    }
    return out.reverse();
  }

  // The link that users usually call the tool: the one with the most moving joints above it that are neither mimic
  // joints nor a side branch; names that suggest a tool are preferred.
  toolLink(): number {
    const named = this.links.findIndex((name) => /(^|_)(tcp|tool0?|ee_link|end_effector|flange)(_|$|\d)/i.test(name));
    if (named >= 0) return named;
    let best = this.root;
    let most = -1;
    for (let link = 0; link < this.links.length; link += 1) {
      const chain = this.chain(link);
      if (chain.some((joint) => joint.mimic)) continue;
      if (chain.length > most) {
        most = chain.length;
        best = link;
      }
    }
    return best;
  }
}

const scratch = new Float64Array(STRIDE);
const scratch2 = new Float64Array(STRIDE);
