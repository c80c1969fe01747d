// Moving the tool to a goal in the world: the program solves the inverse kinematics, and the arm follows its last solution
// at the picture's rate.
import { compose, inversePose, quatMultiply, rotate, STRIDE, type TreeJoint } from '../robot/tree';
import type { App } from './app';
import { Kinematics, type Answer, type Branch, type Question } from './kinematics';
import { Newest } from './newest';
import { settings, settingsChanged } from './settings';
import { Signal } from './signal';

const LONGEST_MOTION = 20_000; // ms after which a goal that is not reached is dropped
const READING_TIME = 3000; // ms for which a goal without a solution stays after release
const SAME_POSE = 1e-6; // m, or of a quaternion

export class ToolDriver {
  readonly changed = new Signal();
  readonly kinematics: Kinematics;
  goal: Float64Array | null = null; // in the world
  dragging = false;
  answer: Answer | null = null; // to the newest goal that has one
  outcome: Answer | null = null; // of the last goal, if it had no solution
  private aim: [TreeJoint, number][] = []; // the configuration that the arm moves to
  private lastQuestion: Question | null = null;
  private readonly questions = new Newest<Question, Answer>((question) => this.kinematics.solve(question), (answer) => this.take(answer),
    (problem) => this.take({ solved: false, obstacle: 'request', message: problem.message, branches: [] }));
  private until = 0; // ms: a goal stays at least so long after the last input

  constructor(private readonly app: App) {
    const { twin, world, commander } = app;
    this.kinematics = new Kinematics(twin);
    for (const ends of [twin.robotChanged, commander.stopChanged, world.toolChanged] as Signal<unknown>[]) ends.on(() => this.drop());
    twin.phaseChanged.on((phase) => phase !== 'open' && this.drop());
    settingsChanged.on((key) => key === 'keepOrientation' && this.ask());
    world.stage.tick.on((dt) => this.tick(dt));
  }

  // The tool's pose in the world at the commanded positions.
  commanded(): Float64Array | null {
    const { twin, world } = this.app;
    const poses = this.posesAt([]);
    return poses && twin.tree ? poses.slice(world.tool * STRIDE, world.tool * STRIDE + STRIDE) : null;
  }

  // The poses of all links in the world at the commanded positions with the changed ones.
  posesAt(changes: [TreeJoint, number][]): Float64Array | null {
    const { twin } = this.app;
    if (!twin.tree) return null;
    const q = Float64Array.from(twin.target);
    for (const [joint, value] of changes) q[joint.index] = value;
    twin.tree.follow(q);
    const poses = twin.tree.newPoses();
    const root = twin.tree.root * STRIDE;
    poses.set(twin.poses.subarray(root, root + STRIDE), root);
    twin.tree.forward(q, poses);
    return poses;
  }

  // True if a joint above the tool takes commands.
  hasMover(): boolean {
    const { twin, world, commander } = this.app;
    return !commander.stopped && (twin.tree?.chain(world.tool).some((joint) => commander.canMove(joint)) ?? false);
  }

  // Why the tool cannot be moved; '' if it can.
  refusal(): string {
    if (this.app.commander.stopped) return 'Stopped: reset STOP to move the tool.';
    return this.hasMover() || this.app.twin.recording ? this.kinematics.missing : 'No active controller moves this link.';
  }

  canMove(): boolean {
    return this.refusal() === '';
  }

  begin(): void {
    this.aimHere();
    this.dragging = true;
  }

  // The goal is kept until the arm is there, and for a while.
  release(): void {
    this.dragging = false;
    this.keep(700);
  }

  private keep(ms: number): void {
    this.until = performance.now() + ms;
  }

  private aimHere(): void {
    const pose = this.canMove() ? this.commanded() : null;
    if (!pose) return;
    this.goal = pose;
    this.outcome = null;
  }

  setGoal(pose: ArrayLike<number>): void {
    if (!this.goal) this.aimHere();
    this.goal?.set(pose);
    if (!this.dragging) this.keep(700);
    this.ask();
  }

  // Translates and rotates the goal, along the axes of the world or of the tool.
  nudge(move: [number, number, number], turn: [number, number, number], local: boolean): void {
    if (!this.goal) this.aimHere();
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
    this.ask();
  }

  drop(): void {
    this.questions.clear();
    this.goal = this.answer = this.outcome = this.lastQuestion = null;
    this.aim = [];
    this.dragging = false;
    this.changed.emit();
  }

  // All solutions for a pose of the tool in the world.
  everyBranch(pose: ArrayLike<number>): Promise<Answer> {
    return this.kinematics.solve(this.questionFor(pose), true);
  }

  // Moves the arm to a solution as the sliders do.
  moveTo({ positions }: Branch): void {
    const { twin, commander } = this.app;
    this.drop();
    if (!commander.viewing) {
      commander.setMany(positions);
      return;
    }
    const to = Float64Array.from(twin.target);
    for (const [joint, value] of positions) to[joint.index] = value;
    commander.play([{ time: commander.timeFor(positions.map(([joint]) => joint), twin.q, to), positions: to }]);
  }

  // Joints that the solution moves and that no controller takes positions for.
  blockedJoints(): string[] {
    const { twin, commander } = this.app;
    return this.aim.filter(([joint, value]) => Math.abs(value - twin.target[joint.index]!) > 1e-3 && !commander.canMove(joint)).map(([joint]) => joint.name);
  }

  private questionFor(pose: ArrayLike<number>): Question {
    const { twin, world } = this.app;
    const root = twin.tree!.root * STRIDE;
    const local = new Float64Array(STRIDE);
    compose(inversePose(twin.poses.subarray(root, root + STRIDE)), 0, pose, 0, local, 0);
    return { link: world.tool, pose: local, keepsOrientation: settings.keepOrientation };
  }

  // Asks unless the same has been asked. The root may move under a goal that stays.
  private ask(): void {
    if (!this.goal || !this.app.twin.tree) return;
    const question = this.questionFor(this.goal);
    const last = this.lastQuestion;
    if (last && last.keepsOrientation === question.keepsOrientation && last.pose.every((value, i) => Math.abs(value - question.pose[i]!) < SAME_POSE)) return;
    this.lastQuestion = question;
    this.questions.put(question);
  }

  // The arm follows to the nearest pose that works, but not into a collision.
  private take(answer: Answer): void {
    const [best] = answer.branches;
    this.answer = answer;
    this.aim = best && (answer.solved || (answer.obstacle !== 'collision' && best.depth <= 0)) ? best.positions : [];
    this.changed.emit();
  }

  private tick(dt: number): void {
    if (!this.goal || !this.app.twin.tree) return;
    this.ask();
    const moves = this.advance(dt);
    const wait = this.answer?.solved === false ? READING_TIME - 700 : 0;
    const late = performance.now() - this.until - wait;
    const isSettled = !moves && !this.questions.busy && late > 0;
    if (!this.dragging && (isSettled || late > LONGEST_MOTION)) {
      const outcome = this.answer?.solved === false ? this.answer : null;
      this.drop();
      this.outcome = outcome;
    }
    this.changed.emit();
  }

  // No joint exceeds its velocity limit: a jump of the solution becomes a motion. Returns whether a joint was moved.
  private advance(dt: number): boolean {
    const { twin, commander } = this.app;
    const steps: [TreeJoint, number][] = [];
    for (const [joint, value] of this.aim) {
      const now = twin.target[joint.index]!;
      const left = Math.min(joint.upper, Math.max(joint.lower, value)) - now;
      if (!commander.canMove(joint) || Math.abs(left) <= 1e-6) continue;
      const most = (joint.velocity > 0 ? joint.velocity : joint.kind === 'prismatic' ? 0.5 : 3) * Math.max(dt, 1 / 60);
      steps.push([joint, now + Math.max(-most, Math.min(most, left))]);
    }
    if (steps.length > 0) commander.setMany(steps);
    return steps.length > 0;
  }
}
