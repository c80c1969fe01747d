// Inverse kinematics by damped least squares (Levenberg-Marquardt on the pose error) within joint limits: a joint that
// a step would move beyond its limit is held there and the others are solved again.

import { quatMultiply, STRIDE, type Tree, type TreeJoint } from './tree';

export interface Goal {
  link: number;
  position: ArrayLike<number>;
  orientation: ArrayLike<number> | null; // x y z w; null: any
  local?: ArrayLike<number>; // the point on the link, in its frame; its origin when absent
}

export interface Solution {
  distance: number; // m, remaining
  angle: number; // rad, remaining; 0 if the orientation is free
  reached: boolean;
  iterations: number;
}

export interface IkOptions {
  iterations?: number;
  tolerance?: number; // m
  angleTolerance?: number; // rad
  rotationWeight?: number; // m per rad
  maxStep?: number; // maximum of a joint in one iteration, rad or m
  usable?: (joint: TreeJoint) => boolean;
}

// Solves A x = b in place for a symmetric positive definite A of size n.
function solve(a: Float64Array, b: Float64Array, n: number): void {
  for (let j = 0; j < n; j += 1) {
    let d = a[j * n + j]!;
    for (let k = 0; k < j; k += 1) d -= a[j * n + k]! ** 2;
    d = Math.sqrt(Math.max(d, 1e-18));
    a[j * n + j] = d;
    for (let i = j + 1; i < n; i += 1) {
      let s = a[i * n + j]!;
      for (let k = 0; k < j; k += 1) s -= a[i * n + k]! * a[j * n + k]!;
      a[i * n + j] = s / d;
    }
  }
  for (let i = 0; i < n; i += 1) {
    let s = b[i]!;
    for (let k = 0; k < i; k += 1) s -= a[i * n + k]! * b[k]!;
    b[i] = s / a[i * n + i]!;
  }
  for (let i = n - 1; i >= 0; i -= 1) {
    let s = b[i]!;
    for (let k = i + 1; k < n; k += 1) s -= a[k * n + i]! * b[k]!;
    b[i] = s / a[i * n + i]!;
  }
}

export class Ik {
  private readonly poses: Float64Array;
  private readonly error = new Float64Array(6);
  private readonly point = new Float64Array(3);
  private readonly quat = new Float64Array(8);

  constructor(private readonly tree: Tree) {
    this.poses = tree.newPoses();
  }

  private measure(q: Float64Array, goal: Goal, weight: number): number {
    const { poses, error, point } = this;
    this.tree.forward(q, poses);
    const at = goal.link * STRIDE;
    point.set(poses.subarray(at, at + 3));
    if (goal.local) {
      const [x, y, z] = [goal.local[0]!, goal.local[1]!, goal.local[2]!];
      const [qx, qy, qz, qw] = poses.subarray(at + 3, at + 7) as unknown as [number, number, number, number];
      const tx = 2 * (qy * z - qz * y), ty = 2 * (qz * x - qx * z), tz = 2 * (qx * y - qy * x);
      point[0]! += x + qw * tx + qy * tz - qz * ty;
      point[1]! += y + qw * ty + qz * tx - qx * tz;
      point[2]! += z + qw * tz + qx * ty - qy * tx;
    }
    for (let i = 0; i < 3; i += 1) error[i] = goal.position[i]! - point[i]!;
    error.fill(0, 3);
    if (goal.orientation) {
      const inverse = this.quat.subarray(4);
      inverse.set([-poses[at + 3]!, -poses[at + 4]!, -poses[at + 5]!, poses[at + 6]!]);
      quatMultiply(goal.orientation, 0, inverse, 0, this.quat, 0);
      const sign = this.quat[3]! < 0 ? -1 : 1;
      const length = Math.hypot(this.quat[0]!, this.quat[1]!, this.quat[2]!);
      const angle = 2 * Math.atan2(length, this.quat[3]! * sign);
      const scale = length < 1e-12 ? 0 : (sign * angle * weight) / length;
      for (let i = 0; i < 3; i += 1) error[3 + i] = this.quat[i]! * scale;
    }
    return error.reduce((sum, e) => sum + e * e, 0);
  }

  // Changes q; the root's pose is the identity (goals are in the root's frame).
  solve(q: Float64Array, goal: Goal, options: IkOptions = {}): Solution {
    const { tree } = this;
    const weight = goal.orientation ? options.rotationWeight ?? 0.2 : 0;
    const tolerance = options.tolerance ?? 1e-4;
    const angleTolerance = options.angleTolerance ?? 1e-3;
    const rows = goal.orientation ? 6 : 3;
    const columns = [...new Set(tree.chain(goal.link).map((j) => (j.mimic ? j.mimicIndex : j.index)))]
      .filter((index) => index >= 0 && (options.usable?.(tree.moving[index]!) ?? true));
    const n = columns.length;
    const jacobian = new Float64Array(6 * n);
    const trial = Float64Array.from(q);
    const maxStep = options.maxStep ?? 0.3;
    let lambda = 1e-4;
    tree.follow(q);
    let cost = this.measure(q, goal, weight);
    let iterations = 0;
    for (; iterations < (options.iterations ?? 50) && n > 0; iterations += 1) {
      if (this.within(weight, tolerance, angleTolerance)) break;
      tree.jacobian(this.poses, goal.link, this.point, columns, jacobian);
      for (let i = 3 * n; i < 6 * n; i += 1) jacobian[i]! *= weight;
      let better = false;
      for (let attempt = 0; attempt < 6 && !better; attempt += 1) {
        trial.set(q);
        this.step(q, trial, jacobian, columns, rows, lambda, maxStep);
        tree.follow(trial);
        const error = Float64Array.from(this.error);
        const next = this.measure(trial, goal, weight);
        if (next < cost * (1 - 1e-9)) {
          q.set(trial);
          cost = next;
          lambda = Math.max(1e-7, lambda * 0.3);
          better = true;
        } else {
          this.error.set(error);
          lambda *= 6;
        }
      }
      if (!better) break;
    }
    this.measure(q, goal, weight);
    const distance = Math.hypot(this.error[0]!, this.error[1]!, this.error[2]!);
    const angle = weight > 0 ? Math.hypot(this.error[3]!, this.error[4]!, this.error[5]!) / weight : 0;
    return { distance, angle, iterations, reached: distance <= Math.max(tolerance, 1e-3) && angle <= Math.max(angleTolerance, 0.02) };
  }

  private within(weight: number, tolerance: number, angleTolerance: number): boolean {
    const e = this.error;
    if (Math.hypot(e[0]!, e[1]!, e[2]!) > tolerance) return false;
    return weight === 0 || Math.hypot(e[3]!, e[4]!, e[5]!) / weight <= angleTolerance;
  }

  private step(q: Float64Array, out: Float64Array, j: Float64Array, columns: number[], rows: number, lambda: number, maxStep: number): void {
    const n = columns.length;
    const free = new Array<boolean>(n).fill(true);
    const a = new Float64Array(rows * rows);
    const y = new Float64Array(rows);
    for (let round = 0; round <= n; round += 1) {
      for (let r = 0; r < rows; r += 1) {
        y[r] = this.error[r]!;
        for (let c = 0; c <= r; c += 1) {
          let s = r === c ? lambda : 0;
          for (let k = 0; k < n; k += 1) if (free[k]) s += j[r * n + k]! * j[c * n + k]!;
          a[r * rows + c] = s;
          a[c * rows + r] = s;
        }
      }
      solve(a, y, rows);
      let held = false;
      let largest = 0;
      const change = new Float64Array(n);
      for (let k = 0; k < n; k += 1) {
        if (!free[k]) continue;
        let d = 0;
        for (let r = 0; r < rows; r += 1) d += j[r * n + k]! * y[r]!;
        change[k] = d;
        largest = Math.max(largest, Math.abs(d));
      }
      const scale = largest > maxStep ? maxStep / largest : 1;
      for (let k = 0; k < n; k += 1) {
        const joint = this.tree.moving[columns[k]!]!;
        const now = q[joint.index]!;
        const next = now + change[k]! * scale;
        if (free[k] && (next > joint.upper || next < joint.lower)) {
          const limit = next > joint.upper ? joint.upper : joint.lower;
          if (Math.abs(now - limit) < 1e-9) {
            free[k] = false;
            held = true;
          }
          out[joint.index] = limit;
        } else if (free[k]) {
          out[joint.index] = next;
        }
      }
      if (!held) return;
      for (let k = 0; k < n; k += 1) {
        const joint = this.tree.moving[columns[k]!]!;
        if (free[k]) out[joint.index] = q[joint.index]!;
      }
    }
  }
}
