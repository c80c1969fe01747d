// The tolerances of trajectory controllers for each joint: the reference, and the permitted error while a trajectory
// runs (constraints.JOINT.trajectory) and at its end (constraints.JOINT.goal).
import type { Message } from '../protocol/cdr';
import type { Parameters } from './parameters';
import { stampOf, type Twin } from './twin';

const SETTLING = 1; // s, the minimum time after the last motion for which the goal's tolerance is shown

interface Followed {
  controller: string;
  reference: number;
  movedAt: number; // s, stamp of the last message in which a reference of the controller moved
  now: number; // s, stamp of the last message
}

export class Tolerances {
  private readonly joints = new Map<string, Followed>();
  private readonly subscriptions = new Map<string, () => void>();

  constructor(private readonly twin: Twin, private readonly parameters: Parameters) {
    twin.controllersChanged.on(() => this.listen());
    twin.robotChanged.on(() => this.joints.clear());
  }

  private listen(): void {
    const wanted = new Map(this.twin.controllers.filter((c) => c.state === 'active' && /Trajectory/.test(c.type)).map((c) => [this.twin.own(`/${c.name}/controller_state`), c.name]));
    for (const [topic, end] of this.subscriptions) {
      if (wanted.has(topic)) continue;
      end();
      this.subscriptions.delete(topic);
      for (const [joint, one] of this.joints) if (topic.endsWith(`/${one.controller}/controller_state`)) this.joints.delete(joint);
    }
    for (const [topic, name] of wanted) {
      if (!this.subscriptions.has(topic)) this.subscriptions.set(topic, this.twin.client.subscribe(topic, (m) => this.take(name, m)));
    }
  }

  take(controller: string, message: Message): void {
    const names = message['joint_names'] as string[];
    const reference = message['reference'] as Message;
    const positions = reference['positions'] as ArrayLike<number>, velocities = reference['velocities'] as ArrayLike<number>;
    const now = stampOf((message['header'] as Message)['stamp']);
    const moves = names.some((name, i) => {
      const before = this.joints.get(name)?.reference;
      return Math.abs(velocities[i] ?? 0) > 1e-9 || (before !== undefined && Math.abs(before - positions[i]!) > 1e-9);
    });
    names.forEach((name, i) => {
      const before = this.joints.get(name);
      const back = before !== undefined && before.now > now; // a reset
      this.joints.set(name, { controller, reference: positions[i] ?? NaN, movedAt: moves ? now : before && !back ? before.movedAt : -Infinity, now });
    });
  }

  reference(joint: string): number {
    return this.joints.get(joint)?.reference ?? NaN;
  }

  // Radians or metres on both sides of the reference; NaN: nothing runs, or there is no tolerance.
  tolerance(joint: string): number {
    const one = this.joints.get(joint);
    if (!one) return NaN;
    const still = one.now - one.movedAt;
    const goalTime = this.parameters.number(this.twin.own(`/${one.controller}.constraints.goal_time`));
    if (!(still <= Math.max(SETTLING, goalTime || 0))) return NaN;
    const value = this.parameters.number(this.twin.own(`/${one.controller}.constraints.${joint}.${still === 0 ? 'trajectory' : 'goal'}`));
    return value > 0 ? value : NaN;
  }
}
