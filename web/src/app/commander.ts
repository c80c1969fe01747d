// The commands of the page: targets of joints, through the active controller that claims them; in a twin without
// controllers, the joints themselves.

import type { Message } from '../protocol/cdr';
import type { TreeJoint } from '../robot/tree';
import { toast } from './dom';
import { settings } from './settings';
import { Signal } from './signal';
import type { Controller, Twin } from './twin';

const PERIOD = 40; // ms, the minimum between two commands to one controller
export const VIEW_TOPIC = '/joint_command';

export function duration(seconds: number): { sec: number; nanosec: number } {
  const nanoseconds = Math.round(seconds * 1e9);
  return { sec: Math.floor(nanoseconds / 1e9), nanosec: nanoseconds % 1e9 };
}

export interface Waypoint {
  time: number; // s from the start
  positions: Float64Array; // by joint index
}

export class Commander {
  readonly stopChanged = new Signal<boolean>();
  stopped = false;
  private stoppedControllers: string[] = [];
  private stoppedSpace = ''; // the robot of the stopped controllers
  private stoppedOthers: string[] = []; // controller managers in their emergency stop
  private readonly owners = new Map<string, Controller>(); // by joint
  private ownersOf: Controller[] | null = null; // the list from which `owners` was built
  private readonly waiting = new Set<string>();
  private readonly sentAt = new Map<string, number>();
  private refusedAt = 0;
  private glide: ReturnType<typeof setInterval> | null = null;

  constructor(private readonly twin: Twin) {
    twin.selectedRobot.on(() => this.endGlide());
  }

  get viewing(): boolean {
    const { client } = this.twin;
    const simulated = client.services.has('/gazebo/pause_physics') || client.services.has(this.twin.own('/controller_manager/list_controllers'));
    return client.phase === 'open' && client.services.size > 0 && !simulated || client.channel(VIEW_TOPIC) !== null;
  }

  owner(joint: TreeJoint): Controller | null {
    if (this.ownersOf !== this.twin.controllers) {
      this.ownersOf = this.twin.controllers;
      this.owners.clear();
      for (const c of this.ownersOf) {
        if (c.state === 'active' && this.takesPositions(c)) for (const name of c.joints) this.owners.set(name, c);
      }
    }
    return this.owners.get(joint.name) ?? null;
  }

  private takesPositions(c: Controller): boolean {
    return /JointTrajectoryController|trajectory/i.test(c.type) || (/forward|JointGroupPosition/i.test(c.type) && c.interface === 'position');
  }

  canMove(joint: TreeJoint): boolean {
    return !joint.mimic && (this.viewing || this.owner(joint) !== null);
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
      if (performance.now() - this.refusedAt > 3000) toast('Stopped. Release the stop first.', 'warning');
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
    const wait = (this.sentAt.get(name) ?? -1e9) + PERIOD - performance.now();
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
    if (/trajectory/i.test(controller.type)) {
      const time = seconds > 0 ? seconds : this.timeFor(joints, twin.q, twin.target);
      this.publishTrajectory(controller, joints, [{ positions, time_from_start: duration(time) }]);
    } else {
      twin.client.publish(twin.own(`/${name}/commands`), 'std_msgs/msg/Float64MultiArray', { data: positions });
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

  // Cancels goals and holds; then, if that setting is on, deactivates the controllers that command joints. The managers
  // of the other robots take their own emergency stop.
  async stop(): Promise<void> {
    const { twin } = this;
    if (this.stopped) return; // what was stopped first is what is released
    this.stopped = true;
    this.stopChanged.emit(true);
    this.hold();
    this.stoppedSpace = twin.space;
    this.stoppedOthers = twin.robots.filter((space) => space !== twin.space).map((space) => `${space}/controller_manager`);
    for (const manager of this.stoppedOthers) {
      twin.client.call(`${manager}/emergency_stop`).catch((problem: Error) => toast(`${manager} does not stop: ${problem.message}`, 'error'));
    }
    const movers = twin.controllers.filter((c) => c.state === 'active' && c.joints.length > 0).map((c) => c.name);
    for (const name of movers) {
      const cancel = twin.own(`/${name}/follow_joint_trajectory/_action/cancel_goal`);
      if (twin.client.services.has(cancel)) void twin.client.call(cancel).catch(() => {});
    }
    if (settings.stopDoes === 'deactivate' && movers.length > 0) {
      this.stoppedControllers = movers;
      await this.switchControllers([], movers, this.stoppedSpace);
    }
  }

  async release(): Promise<void> {
    const { twin } = this;
    twin.target.set(twin.q);
    const again = this.stoppedControllers;
    this.stoppedControllers = [];
    const others = this.stoppedOthers;
    this.stoppedOthers = [];
    for (const manager of others) {
      twin.client.call(`${manager}/reset_emergency_stop`).catch((problem: Error) => toast(`${manager} remains stopped: ${problem.message}`, 'error'));
    }
    if (again.length > 0) await this.switchControllers(again, [], this.stoppedSpace);
    this.stopped = false;
    twin.target.set(twin.q);
    this.stopChanged.emit(false);
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
