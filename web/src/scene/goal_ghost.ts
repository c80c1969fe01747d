// The program's answer in the picture: the hand at a goal without a solution, or the arm in the solution that is
// looked at, translucent, in the colour of the reason and with its name; a line from the tool to the goal.
import * as THREE from 'three';
import type { App } from '../app/app';
import { h, say } from '../app/dom';
import type { Answer, Branch, Obstacle } from '../app/kinematics';
import type { ToolDriver } from '../app/tool';
import { compose, inversePose, STRIDE, type Tree, type TreeJoint } from '../robot/tree';
import { RobotView } from '../robot/view';
import { cssColour } from './legend';

interface Look {
  colour: number;
  text: string;
}

const EDGE = 8, OFFSET = 16; // px

export const SOLUTION: Look = { colour: 0x009e73, text: 'solution' };
export const OBSTACLES: Record<Obstacle, Look> = {
  out_of_reach: { colour: 0xcc79a7, text: 'out of reach' },
  rotation: { colour: 0x9467bd, text: 'not in this rotation' },
  limits: { colour: 0xe69f00, text: 'beyond a joint limit' },
  collision: { colour: 0xd55e00, text: 'in collision' },
  request: { colour: 0x8b959f, text: 'not solved' },
};

// The links that the last joint of the chain moves: the tool, and what is fixed to it or mounted on it.
function handOf(tree: Tree, tool: number): boolean[] {
  const first = tree.chain(tool).filter((joint) => !joint.mimic).at(-1)?.childLink ?? tool;
  return tree.links.map((_, i) => {
    let link = i;
    while (link !== first && tree.parentJoint[link]) link = tree.parentJoint[link]!.parentLink;
    return link === first;
  });
}

export class GoalGhost {
  readonly material = new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.42, depthWrite: false });
  view: RobotView | null = null;
  appearance: Look | null = null;
  private preview: { branch: Branch; text: string } | null = null; // of the list of solutions
  private readonly sign = h('div', { class: 'goal-sign', hidden: true });
  private readonly signPlace = new THREE.Vector3(); // where the sign is
  private readonly gap: THREE.Line;

  constructor(private readonly app: App, private readonly driver: ToolDriver) {
    this.gap = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineDashedMaterial({ depthTest: false }));
    this.gap.visible = false;
    this.gap.frustumCulled = false;
    this.gap.renderOrder = 9;
    app.world.stage.scene.add(this.gap);
    app.world.stage.host.append(this.sign);
    app.world.stage.frame.on(() => this.placeSign());
    app.twin.robotChanged.on(() => this.forget());
    driver.changed.on(() => this.update());
  }

  // Shows a solution; null: no longer.
  show(branch: Branch | null, text = ''): void {
    if (!branch && !this.preview) return;
    this.preview = branch && { branch, text };
    this.update();
  }

  private forget(): void {
    this.view?.root.removeFromParent();
    this.view = this.preview = null;
    this.update();
  }

  private update(): void {
    const { answer, goal } = this.driver;
    if (this.preview) this.showBranch(this.preview.branch, { ...SOLUTION, text: this.preview.text });
    else if (goal && answer && !answer.solved) this.showGoal(goal, answer);
    else this.hide();
  }

  private hide(): void {
    if (!this.appearance) return;
    this.appearance = null;
    this.gap.visible = false;
    if (this.view) this.view.root.visible = false;
    this.sign.hidden = true;
    this.app.world.stage.invalidate();
  }

  private showBranch({ positions }: Branch, look: Look): void {
    const { tree } = this.app.twin;
    const poses = this.driver.posesAt(positions);
    if (!tree || !poses) return;
    const chain = new Set(positions.map(([joint]) => joint));
    this.gap.visible = false;
    this.place(tree, poses, tree.links.map((_, link) => this.isMoved(tree, link, chain)), look);
  }

  private isMoved(tree: Tree, link: number, joints: Set<TreeJoint>): boolean {
    for (let joint = tree.parentJoint[link]; joint; joint = tree.parentJoint[joint.parentLink]) if (joints.has(joint)) return true;
    return false;
  }

  // The hand at the goal; where the program's configuration touches, the whole arm as it touches.
  private showGoal(goal: Float64Array, answer: Answer): void {
    const { twin, world } = this.app;
    const [best] = answer.branches;
    const look = OBSTACLES[answer.obstacle ?? 'request'];
    if (best && best.depth > 0) {
      this.showBranch(best, look);
      this.showGap(goal, look);
      return;
    }
    const poses = this.driver.posesAt([]);
    if (!twin.tree || !poses) return;
    const hand = handOf(twin.tree, world.tool);
    const change = new Float64Array(STRIDE);
    const tool = world.tool * STRIDE;
    compose(goal, 0, inversePose(poses.subarray(tool, tool + STRIDE)), 0, change, 0);
    const target = poses.slice();
    for (let i = 0; i < hand.length; i += 1) if (hand[i]) compose(change, 0, poses, i * STRIDE, target, i * STRIDE);
    this.place(twin.tree, target, hand, look);
    this.showGap(goal, look);
  }

  private place(tree: Tree, poses: Float64Array, links: boolean[], look: Look): void {
    const { world } = this.app;
    if (!this.view) {
      this.view = new RobotView(tree, world.meshes, world.stage.invalidate, this.material);
      this.view.show('visual', true);
      world.stage.scene.add(this.view.root);
    }
    links.forEach((on, i) => (this.view!.links[i]!.visible = on));
    this.view.place(poses);
    this.view.root.visible = true;
    this.material.color.set(look.colour);
    const tool = world.tool * STRIDE;
    this.signPlace.set(poses[tool]!, poses[tool + 1]!, poses[tool + 2]!);
    this.sign.hidden = false;
    this.sign.style.setProperty('--key', cssColour(look.colour));
    say(this.sign, look.text);
    this.appearance = look;
    world.stage.invalidate();
  }

  // Above the tool, or at the picture's edge.
  private placeSign(): void {
    if (this.sign.hidden) return;
    const { camera, host } = this.app.world.stage;
    const at = this.signPlace.clone().project(camera);
    const x = ((at.x + 1) / 2) * host.clientWidth + OFFSET, y = ((1 - at.y) / 2) * host.clientHeight - OFFSET - this.sign.offsetHeight;
    const most = [host.clientWidth - this.sign.offsetWidth - EDGE, host.clientHeight - this.sign.offsetHeight - EDGE];
    this.sign.style.transform = `translate(${Math.max(EDGE, Math.min(most[0]!, x))}px, ${Math.max(EDGE, Math.min(most[1]!, y))}px)`;
  }

  private showGap(goal: Float64Array, look: Look): void {
    const at = this.driver.commanded();
    this.gap.visible = at !== null && Math.hypot(at[0]! - goal[0]!, at[1]! - goal[1]!, at[2]! - goal[2]!) > 0.002;
    if (!at || !this.gap.visible) return;
    const material = this.gap.material as THREE.LineDashedMaterial;
    material.color.set(look.colour);
    material.dashSize = this.app.world.size * 0.012;
    material.gapSize = this.app.world.size * 0.008;
    this.gap.geometry.setFromPoints([new THREE.Vector3(at[0], at[1], at[2]), new THREE.Vector3(goal[0], goal[1], goal[2])]);
    this.gap.computeLineDistances();
  }
}
