// The poses of TF frames in the picture, which shows robots at their true poses while TF may have the odometry's.
import type { Twin } from '../app/twin';
import type { RobotFrames } from '../app/transforms';
import { Signal } from '../app/signal';
import { compose, STRIDE } from '../robot/tree';
import type { OtherRobots } from './other_robots';

const DEEPEST = 256;
const KEPT = 32; // poses of a frame
const SET_BACK = 1; // s: a smaller step back is the order of two publishers, a larger one a reset
const FORGOTTEN = 5000; // ms after the last question

// Between two poses, x y z qx qy qz qw: a straight line and, for the small turns between two messages, the normalised
// mean of the quaternions.
export function between(a: Float64Array, b: Float64Array, share: number): Float64Array {
  const same = a[3]! * b[3]! + a[4]! * b[4]! + a[5]! * b[5]! + a[6]! * b[6]! < 0 ? -1 : 1;
  const out = a.map((value, i) => value + ((i < 3 ? 1 : same) * b[i]! - value) * share);
  const norm = Math.hypot(out[3]!, out[4]!, out[5]!, out[6]!);
  for (let i = 3; i < STRIDE; i += 1) out[i]! /= norm;
  return out;
}

// The last poses of a frame, by their stamps.
export class PoseHistory {
  asked = performance.now(); // ms
  private readonly entries: { stamp: number; pose: Float64Array }[] = [];

  add(stamp: number, pose: Float64Array): void {
    const { entries } = this;
    const last = entries.at(-1)?.stamp ?? -Infinity;
    if (stamp < last - SET_BACK) entries.length = 0;
    else if (stamp < last) return;
    else if (stamp === last) entries.pop();
    if (entries.length === KEPT) entries.shift();
    entries.push({ stamp, pose });
  }

  // null: nothing is known; 'later': not yet.
  at(stamp: number): Float64Array | 'later' | null {
    const { entries } = this;
    const next = entries.findIndex((one) => one.stamp >= stamp);
    if (next < 0) return entries.length > 0 ? 'later' : null;
    const after = entries[next]!, before = entries[Math.max(0, next - 1)]!;
    return after === before ? after.pose : between(before.pose, after.pose, (stamp - before.stamp) / (after.stamp - before.stamp));
  }
}

export class FramePoses {
  readonly recorded = new Signal(); // poses of another stamp are known
  private readonly histories = new Map<string, { frame: string; topic: string; history: PoseHistory }>();

  constructor(private readonly twin: Twin, private readonly others: OtherRobots) {
    twin.placed.on((stamp) => this.record(stamp));
    twin.robotChanged.on(() => this.histories.clear());
  }

  private record(stamp: number): void {
    const now = performance.now();
    for (const [name, { frame, topic, history }] of this.histories) {
      const pose = now - history.asked < FORGOTTEN ? this.pose(frame, topic) : null;
      if (pose) history.add(stamp, pose);
      else this.histories.delete(name);
    }
    this.recorded.emit();
  }

  // The pose at a stamp, s, where the frame moves with the selected robot; else, and for the first message, the last
  // one. 'later': the robot's state of that time has not been received.
  poseAt(frame: string, topic: string, stamp: number): Float64Array | 'later' | null {
    if (this.spaceOf(topic) !== this.twin.space) return this.pose(frame, topic);
    const name = `${topic} ${frame}`;
    let entry = this.histories.get(name);
    if (!entry) {
      entry = { frame, topic, history: new PoseHistory() };
      this.histories.set(name, entry);
    }
    entry.history.asked = performance.now();
    return entry.history.at(stamp) ?? this.pose(frame, topic);
  }

  // The robot in whose namespace a topic is; '' also for topics of none.
  private spaceOf(topic: string): string {
    const inside = this.twin.robots.filter((space) => topic.startsWith(`${space}/`));
    return inside.reduce((longest, space) => (space.length > longest.length ? space : longest), '');
  }

  // x y z qx qy qz qw of the frame that a header on this topic names; null: TF does not have it.
  pose(frame: string, topic: string): Float64Array | null {
    const { twin } = this;
    const space = this.spaceOf(topic);
    if (space === twin.space) return this.inSelected(frame);
    const other = this.others.get(space);
    const out = chain(frame, other?.frames ?? twin.frames, () => null);
    const inTruth = other?.inTruth();
    if (out && inTruth && this.belongs(frame, other!.frames)) compose(inTruth, 0, Float64Array.from(out), 0, out, 0);
    return out;
  }

  // A robot's frames move with it where it truly is; those of the world do not.
  private belongs(frame: string, frames: RobotFrames): boolean {
    return frame !== 'world' && frames.linkNamed(frame) !== null;
  }

  private inSelected(frame: string): Float64Array | null {
    const { frames, tree, poses } = this.twin;
    return chain(frame, frames, (name) => {
      const link = tree?.linkIndex.get(frames.linkNamed(name) ?? '');
      return link === undefined ? null : poses.subarray(link * STRIDE, (link + 1) * STRIDE);
    });
  }
}

// The frame's pose by the transforms up to the first frame whose pose is known, or to the root.
function chain(frame: string, frames: RobotFrames, known: (frame: string) => Float64Array | null): Float64Array | null {
  const out = Float64Array.of(0, 0, 0, 0, 0, 0, 1);
  let at = frame;
  for (let depth = 0; depth < DEEPEST; depth += 1) {
    const pose = known(at);
    if (pose) {
      compose(pose, 0, Float64Array.from(out), 0, out, 0);
      return out;
    }
    const transform = frames.transform(at);
    if (!transform) return depth > 0 || at === 'world' ? out : null;
    compose(transform.pose, 0, Float64Array.from(out), 0, out, 0);
    at = transform.parent;
  }
  return null;
}
