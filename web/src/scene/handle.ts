// The handle on the tool: arrows and rings to drag. It is grey where the tool cannot be moved.
import * as THREE from 'three';
import { TransformControls } from 'three/addons/controls/TransformControls.js';
import type { App } from '../app/app';
import { toast } from '../app/dom';
import type { ToolDriver } from '../app/tool';

const GREY = new THREE.Color(0x8b959f);
const NEAR = 40; // px from the tool, within which a press is meant for the handle

export class ToolHandle {
  readonly controls: TransformControls;
  private readonly proxy = new THREE.Object3D();
  private readonly helper: THREE.Object3D;
  on = true;
  refusal = ''; // why it is grey
  private away = false;
  private colours: Map<THREE.MeshBasicMaterial, THREE.Color> | null = null; // while it is grey, those that it had

  constructor(private readonly app: App, private readonly driver: ToolDriver) {
    const { stage, camera } = app.world;
    this.controls = new TransformControls(stage.camera, stage.renderer.domElement);
    this.controls.setSize(0.55);
    this.controls.attach(this.proxy);
    this.helper = this.controls.getHelper();
    stage.scene.add(this.proxy, this.helper);
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
    stage.renderer.domElement.addEventListener('pointerdown', (event) => this.explain(event));
    stage.frame.on(() => this.place());
    app.twin.graphChanged.on(() => stage.invalidate());
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
    const { driver } = this;
    const shown = this.on && !this.away && driver.hasMover();
    this.refusal = shown ? driver.refusal() : '';
    const usable = shown && this.refusal === '';
    this.helper.visible = shown;
    this.controls.enabled = usable;
    this.paint(shown && !usable);
    if (!usable) this.controls.axis = null;
    if (this.controls.dragging) return;
    const pose = driver.goal ?? driver.commanded();
    if (!pose) return;
    this.proxy.position.set(pose[0]!, pose[1]!, pose[2]!);
    this.proxy.quaternion.set(pose[3]!, pose[4]!, pose[5]!, pose[6]!);
  }

  // The controls set each material's colour to its '_color' with every frame.
  private paint(grey: boolean): void {
    if (grey === (this.colours !== null)) return;
    if (!grey) {
      for (const [material, colour] of this.colours!) Object.assign(material, { _color: colour });
      this.colours = null;
      return;
    }
    const colours = new Map<THREE.MeshBasicMaterial, THREE.Color>();
    this.helper.traverse((one) => {
      const { material } = one as THREE.Mesh<THREE.BufferGeometry, THREE.MeshBasicMaterial & { _color?: THREE.Color }>;
      if (!material?.color || colours.has(material)) return;
      colours.set(material, material._color ?? material.color.clone());
      material._color = GREY;
    });
    this.colours = colours;
  }

  // A press on the grey handle shows the reason.
  private explain(event: PointerEvent): void {
    if (!this.refusal) return;
    const box = this.app.world.stage.renderer.domElement.getBoundingClientRect();
    const at = this.proxy.position.clone().project(this.app.world.stage.camera);
    const x = box.left + ((at.x + 1) / 2) * box.width, y = box.top + ((1 - at.y) / 2) * box.height;
    if (Math.hypot(event.clientX - x, event.clientY - y) < NEAR) toast(this.refusal, 'warning');
  }
}
