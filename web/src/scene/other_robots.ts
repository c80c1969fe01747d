// The robots that are not selected, drawn from their transforms; a click on one selects it.
import * as THREE from 'three';
import { poseOf, type RobotFrames } from '../app/transforms';
import type { Twin } from '../app/twin';
import { compose, inversePose, STRIDE, Tree } from '../robot/tree';
import { parseUrdf } from '../robot/urdf';
import { RobotView } from '../robot/view';
import type { World } from './world';

class OtherRobot {
  tree: Tree | null = null;
  view: RobotView | null = null;
  readonly frames: RobotFrames;
  private readonly ends: (() => void)[];
  private truth: Float64Array | null = null;
  private poses = new Float64Array();
  placed = false; // at a known pose

  constructor(readonly space: string, twin: Twin, private readonly world: World) {
    this.frames = twin.framesOf(space);
    const { client } = twin;
    this.ends = [
      client.subscribe(`${space}/robot_description`, (m) => this.describe(String(m['data']))),
      client.subscribe(`${space}/ground_truth/odom`, (m) => {
        this.truth = poseOf(m);
        this.follow();
      }),
      this.frames.listen(() => this.follow()),
      twin.transformed.on(() => this.follow()),
    ];
  }

  end(): void {
    for (const end of this.ends) end();
    if (this.view) this.world.stage.scene.remove(this.view.root);
  }

  private follow(): void {
    const before = this.placed;
    if (this.place()) this.world.stage.moved();
    if (this.placed !== before) this.world.othersChanged();
  }

  private describe(text: string): void {
    if (this.view) this.world.stage.scene.remove(this.view.root);
    this.tree = new Tree(parseUrdf(text));
    this.poses = this.tree.newPoses();
    this.placed = false;
    this.view = new RobotView(this.tree, this.world.meshes, () => this.world.othersChanged());
    this.view.root.userData['robot'] = this.space;
    this.view.show('visual', true);
    this.world.stage.scene.add(this.view.root);
    this.follow();
    this.world.othersChanged();
  }

  // The true world seen from the root of TF; null: TF does not have the robot.
  inTruth(): Float64Array | null {
    const root = this.tree && this.frames.toWorld(this.tree.links[this.tree.root]!);
    if (!root) return null;
    const out = Float64Array.of(0, 0, 0, 0, 0, 0, 1);
    if (this.truth) compose(this.truth, 0, inversePose(root), 0, out, 0);
    return out;
  }

  // True if it is drawn elsewhere than before.
  private place(): boolean {
    const { tree, view } = this;
    const inTruth = this.inTruth();
    if (!tree || !view || !inTruth) return false;
    let moved = false;
    const pose = new Float64Array(STRIDE);
    tree.links.forEach((link, i) => {
      const known = this.frames.toWorld(link);
      if (!known) return;
      compose(inTruth, 0, known, 0, pose, 0);
      for (let k = 0; k < STRIDE && !moved; k += 1) moved = Math.abs(this.poses[i * STRIDE + k]! - pose[k]!) > 2e-5;
      this.poses.set(pose, i * STRIDE);
    });
    if (moved) {
      view.place(this.poses);
      this.placed = true;
    }
    return moved;
  }
}

export class OtherRobots {
  private readonly robots = new Map<string, OtherRobot>();

  constructor(private readonly twin: Twin, private readonly world: World) {
    twin.robotsChanged.on(() => this.update());
    twin.selectedRobot.on(() => this.update());
  }

  private update(): void {
    const wanted = this.twin.robots.filter((space) => space !== this.twin.space);
    for (const [space, robot] of this.robots) {
      if (wanted.includes(space)) continue;
      robot.end();
      this.robots.delete(space);
    }
    for (const space of wanted) if (!this.robots.has(space)) this.robots.set(space, new OtherRobot(space, this.twin, this.world));
    this.world.stage.moved();
  }

  get(space: string): OtherRobot | undefined {
    return this.robots.get(space);
  }

  bounds(): THREE.Box3 {
    const out = new THREE.Box3();
    for (const { view, placed } of this.robots.values()) if (view && placed) out.expandByObject(view.root);
    return out;
  }

  // The robot that the ray hits first, and how far from its origin.
  hit(ray: THREE.Ray): { space: string; distance: number } | null {
    const caster = new THREE.Raycaster(ray.origin, ray.direction);
    let nearest: { space: string; distance: number } | null = null;
    for (const { space, view } of this.robots.values()) {
      const found = view && caster.intersectObject(view.root, true)[0];
      if (found && (!nearest || found.distance < nearest.distance)) nearest = { space, distance: found.distance };
    }
    return nearest;
  }
}
