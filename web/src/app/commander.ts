// The commands of the page: targets of joints, through the active controller that claims them; in a twin without
// controllers, the joints themselves.

import type { Message } from '../protocol/cdr';
import type { TreeJoint } from '../robot/tree';
import { toast } from './dom';
import { settings } from './settings';
import { Signal } from './signal';
import type { Controller, Twin } from './twin';

const PERIOD = 40; // ms, the minimum between two commands to one controller
const GRIPPER_PERIOD = 120; // ms, between two goals of a gripper
const GRIPPER_TIME = 4000; // ms, in which a gripper reaches its goal
export const VIEW_TOPIC = '/joint_command';

export function duration(seconds: number): { sec: number; nanosec: number } {
  const nanoseconds = Math.round(seconds * 1e9);
  return { sec: Math.floor(nanoseconds / 1e9), nanosec: nanoseconds % 1e9 };
}

// Grippers of one joint, with the action ~/gripper_cmd.
function isGripper(controller: Controller | null | undefined): boolean {
  return /GripperActionController/.test(controller?.type ?? '');
}

export interface Waypoint {
  time: number; // s from the start
  positions: Float64Array; // by joint index
}

export class Commander {
  readonly stopChanged = new Signal<boolean>();
  stopped = false;
  unsent = false; // the stop waits for a connection
  private stoppedManagers: string[] = []; // controller managers in their emergency stop
  private latched = false; // the selected robot's emergency stop is on
  private readonly owners = new Map<string, Controller>(); // by joint
  private ownersOf: Controller[] | null = null; // the list from which `owners` was built
  private readonly waiting = new Set<string>();
  private readonly sentAt = new Map<string, number>();
  private refusedAt = 0;
  private viewed = false; // with the last connection
  private glide: ReturnType<typeof setInterval> | null = null;

  constructor(private readonly twin: Twin) {
    twin.selectedRobot.on(() => this.endGlide());
    // A twin that was started again is not stopped yet.
    twin.phaseChanged.on((phase) => {
      if (phase === 'lost' && this.stopped) this.unsent = true;
      if (twin.recording && this.stopped) {
        this.stopped = this.unsent = this.latched = false; // of the twin that was shown before
        this.stopChanged.emit(false);
      }
    });
    twin.follow('/controller_manager/emergency_stop_active', (m) => this.takeStop(m['data'] === true));
    // Nothing publishes the target of a gripper: its slider follows the finger unless it is in use.
    twin.sampled.on(() => {
      const now = performance.now();
      for (const joint of twin.tree?.moving ?? []) {
        const idle = now - twin.commandedAt[joint.index]! > GRIPPER_TIME;
        if (idle && isGripper(this.owner(joint))) twin.target[joint.index] = twin.q[joint.index]!;
      }
    });
    twin.controllersChanged.on(() => {
      if (this.unsent && twin.client.phase === 'open' && twin.controllers.length > 0) void this.sendStop();
    });
  }

  get viewing(): boolean {
    const { client } = this.twin;
    if (this.twin.recording) return false;
    if (client.phase === 'lost') return this.viewed;
    const simulated = client.services.has('/gazebo/pause_physics') || client.services.has(this.twin.own('/controller_manager/list_controllers'));
    this.viewed = client.phase === 'open' && client.services.size > 0 && !simulated || client.channel(VIEW_TOPIC) !== null;
    return this.viewed;
  }

  owner(joint: TreeJoint): Controller | null {
    this.findOwners();
    return this.owners.get(joint.name) ?? null;
  }

  private findOwners(): void {
    if (this.ownersOf === this.twin.controllers) return;
    this.ownersOf = this.twin.controllers;
    this.owners.clear();
    for (const c of this.ownersOf) {
      if (c.state === 'active' && this.takesPositions(c)) for (const name of c.joints) this.owners.set(name, c);
    }
  }

  private takesPositions(c: Controller): boolean {
    return /trajectory/i.test(c.type) || isGripper(c) || (/forward|JointGroupPosition/i.test(c.type) && c.interface === 'position');
  }

  canMove(joint: TreeJoint): boolean {
    return !joint.mimic && (this.viewing || this.owner(joint) !== null);
  }

  // True if a controller, active or not, takes positions of the joint.
  hasMover(joint: TreeJoint): boolean {
    const moved = joint.mimic?.joint ?? joint.name;
    if (this.twin.recording) return false;
    return this.viewing || this.twin.controllers.some((c) => this.takesPositions(c) && c.joints.includes(moved));
  }

  // Why the joint cannot be moved from this page; '' if it can.
  refusal(joint: TreeJoint): string {
    if (this.twin.recording) return 'a recording';
    if (this.canMove(joint)) return '';
    if (joint.mimic) return `follows ${joint.mimic.joint}`;
    const claims = this.twin.controllers.filter((c) => c.joints.includes(joint.name));
    const active = claims.find((c) => c.state === 'active');
    if (active) return `moved by ${active.name}${active.interface && active.interface !== 'position' ? `, by ${active.interface}` : ''}`;
    const idle = claims.find((c) => this.takesPositions(c));
    return idle ? `${idle.name} is ${idle.state}` : 'no controller takes its position';
  }

  // Sets the target of a joint; sent at once, or with the next permitted command.
  set(joint: TreeJoint, value: number): void {
    this.setMany([[joint, value]]);
  }

  setMany(values: Iterable<[TreeJoint, number]>, seconds = 0): void {
    this.endGlide();
    this.command(values, seconds);
  }

  private command(values: Iterable<[TreeJoint, number]>, seconds: number): void {
    const { twin } = this;
    if (this.stopped) {
      if (performance.now() - this.refusedAt > 3000) toast('Stopped. Reset STOP first.', 'warning');
      this.refusedAt = performance.now();
      return;
    }
    const owners = new Set<string>();
    const now = performance.now();
    for (const [joint, value] of values) {
      if (joint.mimic || !Number.isFinite(value)) continue;
      const owner = this.viewing ? null : this.owner(joint);
      if (!this.viewing && !owner) continue;
      twin.target[joint.index] = Math.min(joint.upper, Math.max(joint.lower, value));
      twin.commandedAt[joint.index] = now;
      owners.add(owner ? owner.name : '');
    }
    twin.tree?.follow(twin.target);
    for (const name of owners) this.schedule(name, seconds);
    twin.moved.emit();
  }

  private schedule(name: string, seconds: number): void {
    if (this.waiting.has(name)) return;
    const period = isGripper(this.twin.controllers.find((c) => c.name === name)) ? GRIPPER_PERIOD : PERIOD;
    const wait = (this.sentAt.get(name) ?? -1e9) + period - performance.now();
    if (wait <= 0) {
      this.send(name, seconds);
      return;
    }
    this.waiting.add(name);
    const { space } = this.twin;
    setTimeout(() => {
      this.waiting.delete(name);
      if (!this.stopped && space === this.twin.space) this.send(name, seconds);
    }, wait);
  }

  private send(name: string, seconds: number): void {
    const { twin } = this;
    this.sentAt.set(name, performance.now());
    if (!twin.tree) return;
    if (name === '') {
      const joints = twin.tree.moving.filter((joint) => !joint.mimic);
      twin.client.publish(VIEW_TOPIC, 'sensor_msgs/msg/JointState', {
        name: joints.map((joint) => joint.name),
        position: joints.map((joint) => twin.target[joint.index]!),
      });
      return;
    }
    const controller = twin.controllers.find((c) => c.name === name);
    if (!controller) return;
    const joints = this.jointsOf(controller);
    const positions = joints.map((joint) => twin.target[joint.index]!);
    if (isGripper(controller)) {
      for (const joint of joints.slice(0, 1)) void this.sendGrip(controller, joint);
    } else if (/trajectory/i.test(controller.type)) {
      const time = seconds > 0 ? seconds : this.timeFor(joints, twin.q, twin.target);
      this.publishTrajectory(controller, joints, [{ positions, time_from_start: duration(time) }]);
    } else {
      twin.client.publish(twin.own(`/${name}/commands`), 'std_msgs/msg/Float64MultiArray', { data: positions });
    }
  }

  // A goal of the action of GripperCommand or ParallelGripperCommand; it replaces the one before.
  private async sendGrip(controller: Controller, joint: TreeJoint): Promise<void> {
    const { client, target } = this.twin;
    const service = this.twin.own(`/${controller.name}/gripper_cmd/_action/send_goal`);
    const position = target[joint.index]!;
    const command: Message = /Parallel/.test(client.services.get(service)?.type ?? '') ? { name: [joint.name], position: [position] } : { position, max_effort: joint.effort };
    try {
      const answer = await client.call(service, { goal_id: { uuid: [...crypto.getRandomValues(new Uint8Array(16))] }, goal: { command } });
      if (answer['accepted'] !== true) toast(`${controller.name} rejects ${position.toPrecision(4)}; the log has the reason.`, 'warning');
    } catch (problem) {
      toast((problem as Error).message, 'error');
    }
  }

  private jointsOf(controller: Controller): TreeJoint[] {
    return controller.joints
      .map((name) => this.twin.tree?.jointByName.get(name))
      .filter((joint): joint is TreeJoint => joint !== undefined && joint.index >= 0);
  }

  private publishTrajectory(controller: Controller, joints: TreeJoint[], points: Message[]): void {
    this.twin.client.publish(this.twin.own(`/${controller.name}/joint_trajectory`), 'trajectory_msgs/msg/JointTrajectory', {
      joint_names: joints.map((joint) => joint.name),
      points,
    });
  }

  // The duration of the motion in seconds at the page's share of the velocity limits.
  timeFor(joints: TreeJoint[], from: ArrayLike<number>, to: ArrayLike<number>): number {
    let time = 0.08;
    for (const joint of joints) {
      const limit = (joint.velocity > 0 ? joint.velocity : joint.kind === 'prismatic' ? 0.2 : 2) * settings.speedShare;
      time = Math.max(time, Math.abs(to[joint.index]! - from[joint.index]!) / limit);
    }
    return time;
  }

  // Plays waypoints through all controllers that command one of their joints. The first one is the current position.
  play(waypoints: Waypoint[]): void {
    const { twin } = this;
    const last = waypoints[waypoints.length - 1];
    if (this.stopped || !last || !twin.tree) return;
    const now = performance.now();
    for (const controller of twin.controllers) {
      if (controller.state !== 'active' || !/trajectory/i.test(controller.type)) continue;
      const joints = this.jointsOf(controller);
      this.publishTrajectory(controller, joints, waypoints.map((point) => ({
        positions: joints.map((joint) => point.positions[joint.index]!),
        time_from_start: duration(Math.max(point.time, 0.01)),
      })));
      for (const joint of joints) twin.commandedAt[joint.index] = now - 1400;
    }
    if (this.viewing) this.glideAlong(waypoints);
  }

  // Without controllers the page itself commands one waypoint after another.
  private glideAlong(waypoints: Waypoint[]): void {
    const { twin } = this;
    const { tree } = twin;
    this.endGlide();
    const points = [{ time: 0, positions: Float64Array.from(twin.q) }, ...waypoints];
    const began = performance.now();
    this.glide = setInterval(() => {
      const time = (performance.now() - began) / 1000;
      const next = points.findIndex((point) => point.time > time);
      if (next < 0 || this.stopped || twin.tree !== tree) this.endGlide();
      if (this.stopped || !tree || twin.tree !== tree) return;
      const to = points[next < 0 ? points.length - 1 : next]!, from = next < 0 ? to : points[next - 1]!;
      const share = to.time > from.time ? (time - from.time) / (to.time - from.time) : 1;
      this.command(tree.moving.map((joint) => [joint, from.positions[joint.index]! + (to.positions[joint.index]! - from.positions[joint.index]!) * share]), 0);
    }, PERIOD);
  }

  private endGlide(): void {
    if (this.glide) clearInterval(this.glide);
    this.glide = null;
  }

  // Every active controller holds its current position.
  hold(): void {
    const { twin } = this;
    this.endGlide();
    for (const controller of twin.controllers) {
      if (controller.state !== 'active') continue;
      const joints = this.jointsOf(controller);
      if (!this.takesPositions(controller)) continue;
      for (const joint of joints) {
        twin.target[joint.index] = twin.q[joint.index]!;
        twin.commandedAt[joint.index] = performance.now();
      }
      this.send(controller.name, 0.02);
    }
  }

  // The emergency stop of every robot, as `doppel stop` does it: its joints hold, and no client can command them. Without
  // a connection it is sent with the next one.
  async stop(): Promise<void> {
    if (this.stopped || this.twin.isReadOnly || this.twin.isDrivenElsewhere) return; // what was stopped first is what is reset
    this.stopped = true;
    this.unsent = this.twin.client.phase !== 'open';
    this.stopChanged.emit(true);
    if (!this.unsent) await this.sendStop();
  }

  private async sendStop(): Promise<void> {
    const { twin } = this;
    this.unsent = false;
    const own = `${twin.space}/controller_manager`;
    const managers = twin.robots.map((space) => `${space}/controller_manager`).filter((manager) => twin.client.services.has(`${manager}/emergency_stop`));
    this.stoppedManagers = managers;
    const calls = managers.map((manager) => twin.client.call(`${manager}/emergency_stop`)
      .catch((problem: Error) => toast(`${manager} does not stop: ${problem.message}`, 'error')));
    if (managers.includes(own)) this.endGlide();
    else this.endGoals();
    await Promise.all(calls);
  }

  // A controller manager on a ROS 2 graph has no emergency stop: the joints hold, and goals end. The
  // controllers stay active: without one an arm may fall.
  private endGoals(): void {
    const { twin } = this;
    this.hold();
    for (const { name } of twin.controllers.filter((c) => c.state === 'active' && c.joints.length > 0)) {
      for (const action of ['follow_joint_trajectory', 'gripper_cmd']) {
        const cancel = twin.own(`/${name}/${action}/_action/cancel_goal`);
        if (twin.client.services.has(cancel)) void twin.client.call(cancel).catch(() => {});
      }
    }
  }

  // The emergency stop of the selected robot, as its controller manager publishes it: other clients stop and reset it, too.
  private takeStop(active: boolean): void {
    if (this.unsent) return; // the page's own stop is on its way
    const before = this.stopped;
    if (active) this.stopped = true;
    else if (this.latched) this.stopped = false;
    this.latched = active;
    if (this.stopped === before) return;
    this.twin.target.set(this.twin.q);
    this.stopChanged.emit(this.stopped);
  }

  async resetStop(): Promise<void> {
    const { twin } = this;
    const managers = new Set(this.stoppedManagers);
    if (this.latched) managers.add(`${twin.space}/controller_manager`);
    this.stoppedManagers = [];
    if (!this.unsent) {
      const calls = [...managers].map((manager) => twin.client.call(`${manager}/reset_emergency_stop`)
        .catch((problem: Error) => toast(`${manager} remains stopped: ${problem.message}`, 'error')));
      await Promise.all(calls);
    }
    this.stopped = this.unsent = this.latched = false;
    twin.target.set(twin.q);
    this.stopChanged.emit(false);
    await twin.listControllers();
  }

  async switchControllers(activate: string[], deactivate: string[], space = this.twin.space): Promise<void> {
    const { twin } = this;
    try {
      const answer = await twin.client.call(`${space}/controller_manager/switch_controller`, {
        activate_controllers: activate,
        deactivate_controllers: deactivate,
        strictness: 1,
        timeout: duration(3),
      });
      if (answer['ok'] !== true) toast(String(answer['message'] || 'cannot switch the controllers'), 'error');
    } catch (problem) {
      toast((problem as Error).message, 'error');
    }
    await twin.listControllers();
  }
}
