// The robot in a configuration that shows why a check fails: translucent, with the links that the check names in a colour.
import * as THREE from 'three';
import type { App } from '../app/app';
import { jointsOf } from '../app/linked_pose';
import type { ToolDriver } from '../app/tool';
import type { PosedEvidence } from '../app/validation';
import { Signal } from '../app/signal';
import { RobotView } from '../robot/view';
import type { Tree } from '../robot/tree';
import { cssColour, type Legend } from './legend';

const PLAIN = 0x8b959f, NAMED = 0xd55e00;
const ENTRY = 'configuration of the validation';

// The named links are seen through the others, because what touches is often inside.
const MATERIALS = {
  plain: new THREE.MeshBasicMaterial({ color: PLAIN, transparent: true, opacity: 0.42, depthWrite: false }),
  named: new THREE.MeshBasicMaterial({ color: NAMED, transparent: true, opacity: 0.6, depthTest: false, depthWrite: false }),
};

export function positionsOf(evidence: PosedEvidence): Map<string, number> {
  return new Map(Object.entries(evidence.joints).filter((one): one is [string, number] => one[1] !== null));
}

export class EvidenceGhost {
  readonly changed = new Signal();
  shown: PosedEvidence | null = null;
  plain: RobotView | null = null;
  named: RobotView | null = null;

  constructor(private readonly app: App, private readonly driver: ToolDriver, private readonly legend: Legend) {
    app.twin.robotChanged.on(() => {
      for (const view of [this.plain, this.named]) view?.root.removeFromParent();
      this.plain = this.named = null;
      this.show(null);
    });
  }

  // null: no longer.
  show(evidence: PosedEvidence | null): void {
    if (evidence === null && this.shown === null) return;
    this.shown = evidence;
    if (evidence) this.draw(evidence);
    else this.hide();
    this.app.world.stage.invalidate();
    this.changed.emit();
  }

  private make(tree: Tree, kind: keyof typeof MATERIALS): RobotView {
    const { world } = this.app;
    const view = new RobotView(tree, world.meshes, world.stage.invalidate, MATERIALS[kind]);
    view.show('visual', true);
    world.stage.scene.add(view.root);
    return view;
  }

  private hide(): void {
    this.legend.show(ENTRY, null);
    for (const view of [this.plain, this.named]) if (view) view.root.visible = false;
  }

  private draw(evidence: PosedEvidence): void {
    const { twin, world } = this.app;
    const poses = this.driver.posesAt(jointsOf(this.app, positionsOf(evidence)));
    if (!twin.tree || !poses) return;
    this.plain ??= this.make(twin.tree, 'plain');
    this.named ??= this.make(twin.tree, 'named');
    const names = new Set(evidence.links);
    twin.tree.links.forEach((name, i) => {
      this.plain!.links[i]!.visible = !names.has(name);
      this.named!.links[i]!.visible = names.has(name);
    });
    for (const view of [this.plain, this.named]) {
      view.place(poses);
      view.root.visible = true;
    }
    const shown = evidence.links.filter((name) => twin.tree!.linkIndex.has(name));
    this.legend.show(ENTRY, { key: 'line', colour: cssColour(shown.length > 0 ? NAMED : PLAIN), label: evidence.caption, value: shown.join(', ') });
  }
}
