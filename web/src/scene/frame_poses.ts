// Where frames of TF are in the picture, which shows robots at their true poses while TF may have the odometry's.
import type { Twin } from '../app/twin';
import type { RobotFrames } from '../app/transforms';
import { compose, STRIDE } from '../robot/tree';
import type { OtherRobots } from './other_robots';

const DEEPEST = 256;

export class FramePoses {
  constructor(private readonly twin: Twin, private readonly others: OtherRobots) {}

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
