// Inverse kinematics and reach as the program answers them: the services doppel/ik, doppel/arms and doppel/reach of the
// selected robot.
import type { Message } from '../protocol/cdr';
import { compose, type Tree, type TreeJoint } from '../robot/tree';
import type { Twin } from './twin';

export type Obstacle = 'out_of_reach' | 'rotation' | 'limits' | 'collision' | 'request';

// One configuration of the arm.
export interface Branch {
  positions: [TreeJoint, number][];
  clearance: number; // m; Infinity: nothing is near
  nearest: string[]; // the two bodies of the clearance, or those that touch deepest
  depth: number; // m by which they touch
  manipulability: number;
  limitDistance: number; // of the joint that is nearest to a limit: 0 at the limit, 1 in the middle
}

export interface Question {
  link: number;
  pose: Float64Array; // of the link, in the robot's root link
  keepsOrientation: boolean; // as much of the pose as the arm has joints for, else the position
}

export interface Answer {
  solved: boolean;
  obstacle: Obstacle | null; // null: solved
  message: string; // why there is no solution, or what is left free
  branches: Branch[]; // the nearest to the seed first; without a solution the nearest pose that works
}

export interface Arm {
  group: string;
  tip: number; // link
  length: number; // m: the tip is never farther from the first joint
}

export interface ReachQuestion {
  group: string;
  cell: number; // m
  directions: number;
  approach: [number, number, number] | null; // in the root link; null: all directions
}

export interface ReachAnswer {
  cloud: Message; // in the root link
  farthest: number; // m from the first joint
  volume: number; // m^3, in the direction that was asked for or in any
}

const REACH_TIME = 180_000; // ms

function readBranch(raw: Message, joints: (TreeJoint | undefined)[]): Branch {
  const values = raw['positions'] as ArrayLike<number>;
  return {
    positions: joints.flatMap((joint, i) => (joint && joint.index >= 0 ? [[joint, values[i]!] as [TreeJoint, number]] : [])),
    clearance: Number(raw['clearance']),
    nearest: raw['nearest'] as string[],
    depth: Number(raw['depth']),
    manipulability: Number(raw['manipulability']),
    limitDistance: Number(raw['limit_distance']),
  };
}

// The sum of the distances between the arm's axes, and of what its sliding joints can add.
function lengthOf(tree: Tree, base: number, tip: number): number {
  const joints = [];
  for (let joint = tree.parentJoint[tip]; joint && joint.childLink !== base; joint = tree.parentJoint[joint.parentLink]) joints.unshift(joint);
  let length = 0;
  let moves = false;
  const rigid = Float64Array.of(0, 0, 0, 0, 0, 0, 1);
  for (const joint of joints) {
    compose(rigid.slice(), 0, joint.offset, 0, rigid, 0);
    if (joint.index < 0) continue;
    if (moves) length += Math.hypot(rigid[0]!, rigid[1]!, rigid[2]!);
    if (joint.kind === 'prismatic') length += Number.isFinite(joint.upper - joint.lower) ? Math.max(Math.abs(joint.lower), Math.abs(joint.upper)) : 1;
    moves = true;
    rigid.set([0, 0, 0, 0, 0, 0, 1]);
  }
  return length + Math.hypot(rigid[0]!, rigid[1]!, rigid[2]!);
}

export class Kinematics {
  constructor(private readonly twin: Pick<Twin, 'client' | 'own' | 'tree' | 'target' | 'recording'>) {}

  // Why the program cannot be asked; '' if it can.
  get missing(): string {
    const { client } = this.twin;
    const name = this.twin.own('/doppel/ik');
    if (client.phase !== 'open') return 'The twin is not connected.';
    if (client.services.has(name)) return '';
    if (this.twin.recording) return 'This is a recording: its tool cannot be moved.';
    return `The tool cannot be dragged: nothing here offers ${name}. Start the robot by 'doppel up'; the sliders of the joints work without it.`;
  }

  // The solution that is nearest to the commanded positions, or all of them.
  async solve({ link, pose: [x, y, z, qx, qy, qz, qw], keepsOrientation }: Question, everyBranch = false): Promise<Answer> {
    const { client, own, tree, target } = this.parts();
    const joints = tree.moving.filter((joint) => !joint.mimic);
    const raw = await client.call(own('/doppel/ik'), {
      tip_link: tree.links[link]!,
      pose: { header: { frame_id: tree.links[tree.root]! }, pose: { position: { x: x!, y: y!, z: z! }, orientation: { x: qx!, y: qy!, z: qz!, w: qw! } } },
      task: keepsOrientation ? '' : 'position',
      joint_names: joints.map((joint) => joint.name),
      seed: joints.map((joint) => target[joint.index]!),
      every_branch: everyBranch,
    });
    const chain = (raw['joint_names'] as string[]).map((name) => tree.jointByName.get(name));
    return {
      solved: raw['solved'] === true,
      obstacle: raw['solved'] === true ? null : raw['reason'] as Obstacle,
      message: String(raw['message']),
      branches: (raw['branches'] as Message[]).map((branch) => readBranch(branch, chain)),
    };
  }

  // The arm that shares the most joints with the link's chain; null: the robot has none.
  async armOf(link: number): Promise<Arm | null> {
    const { client, own, tree } = this.parts();
    const raw = await client.call(own('/doppel/arms'));
    const chain = new Set(tree.chain(link));
    const [bases, tips] = [raw['base_links'] as string[], raw['tip_links'] as string[]];
    let best: { i: number; shared: number } | null = null;
    for (const [i, name] of tips.entries()) {
      const tip = tree.linkIndex.get(name);
      if (tip === undefined) continue;
      const shared = tip === link ? Infinity : tree.chain(tip).filter((joint) => chain.has(joint)).length;
      if (!best || shared > best.shared) best = { i, shared };
    }
    if (!best) return null;
    const tip = tree.linkIndex.get(tips[best.i]!)!;
    return { group: (raw['groups'] as string[])[best.i]!, tip, length: lengthOf(tree, tree.linkIndex.get(bases[best.i]!) ?? tree.root, tip) };
  }

  async reach({ group, cell, directions, approach }: ReachQuestion): Promise<ReachAnswer> {
    const { client, own } = this.parts();
    const [x, y, z] = approach ?? [0, 0, 0];
    const raw = await client.call(own('/doppel/reach'), { group, cell, directions, approach: { x, y, z } }, REACH_TIME);
    if (raw['success'] !== true) throw new Error(String(raw['message']) || 'there is no map');
    return { cloud: raw['cloud'] as Message, farthest: Number(raw['farthest']), volume: Number(raw[approach ? 'dexterous_volume' : 'volume']) };
  }

  private parts(): { client: Twin['client']; own: (name: string) => string; tree: Tree; target: Float64Array } {
    const { client, tree, target } = this.twin;
    if (!tree) throw new Error('there is no robot');
    return { client, own: (name) => this.twin.own(name), tree, target };
  }
}
