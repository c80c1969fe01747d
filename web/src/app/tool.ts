// Moving the tool: inverse kinematics follows a goal in the world sixty times a second from the commanded pose.
import { Ik, type Solution } from '../robot/ik';
import { compose, inversePose, quatMultiply, rotate, STRIDE } from '../robot/tree';
import type { App } from './app';
import { settings } from './settings';
import { Signal } from './signal';

export class ToolDriver {
  readonly changed = new Signal();
  goal: Float64Array | null = null; // in the world
  dragging = false;
  solution: Solution | null = null;
  private ik: Ik | null = null;
  private q = new Float64Array();
  private until = 0;
  private left = 0; // minimum number of solutions before the goal is dropped, for low frame rates

  constructor(private readonly app: App) {
    app.twin.robotChanged.on((tree) => {
      this.ik = new Ik(tree);
      this.drop();
    });
    app.world.stage.tick.on((dt) => this.tick(dt));
    app.commander.stopChanged.on(() => this.drop());
  }

  // The tool's pose at the commanded positions.
  commanded(): Float64Array | null {
    const { twin, world } = this.app;
    if (!twin.tree) return null;
    const poses = twin.tree.newPoses();
    const root = twin.tree.root * STRIDE;
    poses.set(twin.poses.subarray(root, root + STRIDE), root);
    twin.tree.forward(this.goal ? this.q : twin.target, poses);
    return poses.slice(world.tool * STRIDE, world.tool * STRIDE + STRIDE);
  }

  canMove(): boolean {
    const { twin, world, commander } = this.app;
    return !commander.stopped && (twin.tree?.chain(world.tool).some((joint) => commander.canMove(joint)) ?? false);
  }

  begin(): void {
    this.take();
    this.dragging = true;
  }

  // The goal is kept for a while after release, so that the last millimetres are solved.
  release(): void {
    this.dragging = false;
    this.keep(700);
  }

  private keep(ms: number): void {
    this.until = performance.now() + ms;
    this.left = 10;
  }

  private take(): void {
    const pose = this.commanded();
    if (!pose) return;
    if (!this.goal) this.q = Float64Array.from(this.app.twin.target);
    this.goal = pose;
  }

  setGoal(pose: ArrayLike<number>): void {
    if (!this.goal) this.take();
    this.goal?.set(pose);
    if (!this.dragging) this.keep(1500);
  }

  // Translates and rotates the goal, along the axes of the world or of the tool.
  nudge(move: [number, number, number], turn: [number, number, number], local: boolean): void {
    if (!this.goal) this.take();
    const { goal } = this;
    if (!goal) return;
    const d: [number, number, number] = [...move];
    if (local) rotate(goal.slice(3), 0, ...move, d, 0);
    for (let i = 0; i < 3; i += 1) goal[i]! += d[i]!;
    const angle = Math.hypot(...turn);
    if (angle > 0) {
      const s = Math.sin(angle / 2) / angle;
      const delta = [turn[0] * s, turn[1] * s, turn[2] * s, Math.cos(angle / 2)];
      const now = goal.slice(3);
      if (local) quatMultiply(now, 0, delta, 0, goal, 3);
      else quatMultiply(delta, 0, now, 0, goal, 3);
    }
    // A goal far beyond reach would respond late when it is moved back.
    const at = this.commanded();
    if (at) {
      const ahead = Math.hypot(goal[0]! - at[0]!, goal[1]! - at[1]!, goal[2]! - at[2]!);
      const most = this.app.world.size * 0.05;
      if (ahead > most) for (let i = 0; i < 3; i += 1) goal[i] = at[i]! + ((goal[i]! - at[i]!) * most) / ahead;
    }
    this.keep(400);
  }

  drop(): void {
    this.goal = null;
    this.dragging = false;
    this.solution = null;
    this.changed.emit();
  }

  private tick(dt: number): void {
    const { goal, ik } = this;
    const { twin, world, commander } = this.app;
    if (!goal || !ik || !twin.tree) return;
    this.left -= 1;
    if (!this.dragging && performance.now() > this.until && this.left < 0) {
      this.drop();
      return;
    }
    const root = twin.tree.root * STRIDE;
    const local = new Float64Array(7);
    compose(inversePose(twin.poses.subarray(root, root + STRIDE)), 0, goal, 0, local, 0);
    const before = Float64Array.from(this.q);
    this.solution = ik.solve(this.q, { link: world.tool, position: local, orientation: settings.keepOrientation ? local.slice(3) : null },
      { iterations: 12, maxStep: 0.2, rotationWeight: 0.15, usable: (joint) => commander.canMove(joint) });
    // No joint exceeds its velocity limit: a jump of the solution becomes a motion.
    for (const joint of twin.tree.moving) {
      const most = (joint.velocity > 0 ? joint.velocity : joint.kind === 'prismatic' ? 0.5 : 3) * Math.max(dt, 1 / 60);
      const i = joint.index;
      this.q[i] = before[i]! + Math.max(-most, Math.min(most, this.q[i]! - before[i]!));
    }
    const moved = twin.tree.moving.filter((joint) => !joint.mimic && Math.abs(this.q[joint.index]! - twin.target[joint.index]!) > 1e-6);
    if (moved.length > 0) commander.setMany(moved.map((joint) => [joint, this.q[joint.index]!]));
    this.changed.emit();
  }
}
