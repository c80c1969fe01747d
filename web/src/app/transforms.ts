// The TF tree: the last transform of each frame, and the pose in the world.
import type { Message } from '../protocol/cdr';
import type { Client } from '../protocol/client';
import { compose, quatMultiply, type TreeJoint } from '../robot/tree';

export interface Transform {
  parent: string;
  child: string;
  still: boolean;
  pose: Float64Array; // x y z qx qy qz qw
  at: number; // ms, of its arrival
  stamp: number; // s
  rate: number; // Hz, of the last twenty or so
}

export function readTransform(raw: Message, still: boolean, at: number): Transform {
  const header = raw['header'] as Message;
  const time = header['stamp'] as { sec: number; nanosec: number };
  const { translation: t, rotation: r } = raw['transform'] as unknown as {
    translation: { x: number; y: number; z: number };
    rotation: { x: number; y: number; z: number; w: number };
  };
  return {
    parent: String(header['frame_id']),
    child: String(raw['child_frame_id']),
    still,
    pose: Float64Array.of(t.x, t.y, t.z, r.x, r.y, r.z, r.w),
    at,
    stamp: time.sec + time.nanosec * 1e-9,
    rate: 0,
  };
}

// The pose of a nav_msgs/msg/Odometry: x y z qx qy qz qw.
export function poseOf(odometry: Message): Float64Array {
  const { position: p, orientation: q } = (odometry['pose'] as Message)['pose'] as unknown as {
    position: { x: number; y: number; z: number };
    orientation: { x: number; y: number; z: number; w: number };
  };
  return Float64Array.of(p.x, p.y, p.z, q.x, q.y, q.z, q.w);
}

export class TransformStore {
  private readonly intervals = new Map<string, { mean: number; count: number }>(); // ms, by child
  readonly frames = new Map<string, Transform>();
  edges = 0; // counts up whenever a frame is added or changes its parent

  put(transform: Transform): void {
    const before = this.frames.get(transform.child);
    if (before) {
      // The mean of the intervals: a mean of the rates would weight bursts too much.
      const of = this.intervals.get(transform.child) ?? { mean: 0, count: 0 };
      of.count = Math.min(of.count + 1, 20);
      of.mean += (transform.at - before.at - of.mean) / of.count;
      this.intervals.set(transform.child, of);
      transform.rate = of.mean > 0 ? 1000 / of.mean : 0;
    }
    if (before?.parent !== transform.parent) this.edges += 1;
    this.frames.set(transform.child, transform);
  }

  forget(): void {
    this.frames.clear();
    this.intervals.clear();
    this.edges += 1;
  }

  // The frame's pose in the root of its tree; null: unknown.
  toWorld(frame: string): Float64Array | null {
    let at = this.frames.get(frame);
    if (!at) return null;
    const out = Float64Array.from(at.pose);
    for (let depth = 0; depth < 256; depth += 1) {
      at = this.frames.get(at.parent);
      if (!at) break;
      compose(at.pose, 0, Float64Array.from(out), 0, out, 0);
    }
    return out;
  }

  // The root of the frame's tree; the frame itself, if it has no parent.
  rootOf(frame: string): string {
    let root = frame;
    for (let depth = 0; depth < 256; depth += 1) {
      const transform = this.frames.get(root);
      if (!transform) break;
      root = transform.parent;
    }
    return root;
  }

  jointPosition(joint: TreeJoint, transform: Transform): number {
    const o = joint.offset;
    if (joint.kind === 'prismatic') {
      const d = [transform.pose[0]! - o[0]!, transform.pose[1]! - o[1]!, transform.pose[2]! - o[2]!];
      const back = new Float64Array(7);
      compose([0, 0, 0, -o[3]!, -o[4]!, -o[5]!, o[6]!], 0, [d[0]!, d[1]!, d[2]!, 0, 0, 0, 1], 0, back, 0);
      return back[0]! * joint.axis[0] + back[1]! * joint.axis[1] + back[2]! * joint.axis[2];
    }
    const turn = new Float64Array(4);
    quatMultiply([-o[3]!, -o[4]!, -o[5]!, o[6]!], 0, transform.pose, 3, turn, 0);
    const along = turn[0]! * joint.axis[0] + turn[1]! * joint.axis[1] + turn[2]! * joint.axis[2];
    const angle = 2 * Math.atan2(along, turn[3]!);
    return angle > Math.PI ? angle - 2 * Math.PI : angle < -Math.PI ? angle + 2 * Math.PI : angle;
  }
}

// The frames of one robot. Of a robot in the namespace /left they are those below `left/` of the tree of all robots, or
// those of its own tree /left/tf, where it publishes one.
export class RobotFrames {
  private readonly own = new TransformStore();
  private readonly prefix: string;

  constructor(private readonly client: Client, private readonly all: TransformStore, private readonly space: string) {
    this.prefix = space === '' ? '' : `${space.slice(1)}/`;
  }

  // Subscribes to the robot's own tree. Returns the function that ends it.
  listen(taken: (transforms: Transform[], now: number) => void): () => void {
    if (this.space === '') return () => {};
    const take = (message: Message, still: boolean): void => {
      const now = performance.now();
      const transforms = (message['transforms'] as Message[]).map((raw) => readTransform(raw, still, now));
      for (const transform of transforms) this.own.put(transform);
      taken(transforms, now);
    };
    const ends = [
      this.client.subscribe(`${this.space}/tf`, (m) => take(m, false)),
      this.client.subscribe(`${this.space}/tf_static`, (m) => take(m, true)),
    ];
    return () => ends.forEach((end) => end());
  }

  forget(): void {
    this.own.forget();
  }

  // The robot's link of a frame of the common tree; null: the frame belongs to another robot.
  linkOf(frame: string): string | null {
    return frame.startsWith(this.prefix) ? frame.slice(this.prefix.length) : null;
  }

  // The transform of a frame as the headers of this robot name it; undefined: its parent is unknown.
  transform(frame: string): Transform | undefined {
    return this.own.frames.get(frame) ?? this.all.frames.get(frame);
  }

  // The link that a header of this robot names; null: a frame of another robot.
  linkNamed(frame: string): string | null {
    return this.own.frames.has(frame) ? frame : this.linkOf(frame);
  }

  // The link's pose in the world; null: unknown.
  toWorld(link: string): Float64Array | null {
    const own = this.own.toWorld(link);
    if (!own) return this.all.toWorld(this.prefix + link);
    // The root of the robot's own tree, such as its link 'world', may have a place in the tree of all robots.
    const root = this.all.toWorld(this.prefix + this.own.rootOf(link));
    if (!root) return own;
    const out = new Float64Array(own.length);
    compose(root, 0, own, 0, out, 0);
    return out;
  }
}
