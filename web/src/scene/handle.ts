// The handle on the tool: arrows and rings to drag; a line to the tool if the goal is out of reach.
import * as THREE from 'three';
import { TransformControls } from 'three/addons/controls/TransformControls.js';
import type { App } from '../app/app';
import type { ToolDriver } from '../app/tool';

export class ToolHandle {
  readonly controls: TransformControls;
  private readonly proxy = new THREE.Object3D();
  private readonly helper: THREE.Object3D;
  private readonly gap: THREE.Line;
  on = true;
  private away = false;

  constructor(private readonly app: App, private readonly driver: ToolDriver) {
    const { stage, camera } = app.world;
    this.controls = new TransformControls(stage.camera, stage.renderer.domElement);
    this.controls.setSize(0.55);
    this.controls.attach(this.proxy);
    this.helper = this.controls.getHelper();
    this.gap = new THREE.Line(new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3()]),
      new THREE.LineDashedMaterial({ color: 0xd55e00, dashSize: 0.01, gapSize: 0.006, depthTest: false }));
    this.gap.visible = false;
    this.gap.frustumCulled = false;
    stage.scene.add(this.proxy, this.helper, this.gap);
    this.controls.addEventListener('change', stage.invalidate);
    this.controls.addEventListener('dragging-changed', (event) => {
      const dragging = (event as unknown as { value: boolean }).value;
      camera.controls.enabled = !dragging;
      if (dragging) driver.begin();
      else driver.release();
    });
    this.controls.addEventListener('objectChange', () => {
      const { position: p, quaternion: q } = this.proxy;
      driver.setGoal([p.x, p.y, p.z, q.x, q.y, q.z, q.w]);
    });
    stage.frame.on(() => this.place());
    driver.changed.on(() => this.showGap());
    this.showMode('translate');
  }

  get busy(): boolean {
    return this.controls.dragging || this.controls.axis !== null;
  }

  showMode(mode: 'translate' | 'rotate', space: 'world' | 'local' = 'world'): void {
    this.controls.setMode(mode);
    this.controls.setSpace(space);
    this.app.world.stage.invalidate();
  }

  show(on: boolean): void {
    this.on = on;
    this.app.world.stage.invalidate();
  }

  // Disabled for clicks that are meant for something else.
  stepAside(away: boolean): void {
    this.away = away;
    this.place();
    this.app.world.stage.invalidate();
  }

  private place(): void {
    const usable = this.on && !this.away && this.driver.canMove();
    this.helper.visible = usable;
    this.controls.enabled = usable;
    if (!usable) this.controls.axis = null;
    if (this.controls.dragging) return;
    const pose = this.driver.goal ?? this.driver.commanded();
    if (!pose) return;
    this.proxy.position.set(pose[0]!, pose[1]!, pose[2]!);
    this.proxy.quaternion.set(pose[3]!, pose[4]!, pose[5]!, pose[6]!);
  }

  private showGap(): void {
    const { goal, solution } = this.driver;
    const far = goal !== null && solution !== null && !solution.reached && solution.distance > 0.002;
    if (far !== this.gap.visible) this.app.world.stage.invalidate();
    this.gap.visible = far;
    if (!far) return;
    const at = this.driver.commanded();
    if (!at || !goal) return;
    this.gap.geometry.setFromPoints([new THREE.Vector3(at[0], at[1], at[2]), new THREE.Vector3(goal[0], goal[1], goal[2])]);
    this.gap.computeLineDistances();
    this.app.world.stage.invalidate();
  }
}
