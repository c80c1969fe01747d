// The 3D part as a whole: stage, camera, the robot in its layers, its ghost, the trace of the tool.
import * as THREE from 'three';
import { Commander } from '../app/commander';
import { set, settings } from '../app/settings';
import { Signal, Standing } from '../app/signal';
import type { Client } from '../protocol/client';
import type { AssetStore } from '../robot/assets';
import type { Twin } from '../app/twin';
import { COMMANDED, ghostMaterial, PAST } from '../robot/materials';
import type { Problem } from '../robot/bundle';
import { MeshStore } from '../robot/meshes';
import { RobotView, type Layer, type LayerMaker } from '../robot/view';
import { STRIDE, type Tree } from '../robot/tree';
import { CameraMan, type ViewName } from './camera';
import { OtherRobots } from './other_robots';
import { AxisLayer, centres, frames, inertiaBoxes } from './layers';
import { Stage } from './stage';
import { Trace } from './trace';

const GROUND_TIMEOUT = 1200; // ms after which the ground is drawn without a robot
const FITTING_TIME = 8000; // ms after the first picture in which it grows by robots and objects that arrive later
const PICKED = new THREE.Color(0x0b6bcb);

export class World {
  readonly stage: Stage;
  readonly camera: CameraMan;
  readonly meshes: MeshStore;
  readonly trace = new Trace();
  readonly built = new Standing<RobotView>();
  readonly pictured = new Standing<void>(); // the first picture with the whole robot is drawn
  view: RobotView | null = null;
  ghost: RobotView | null = null;
  size = 0.5;
  tool = 0;
  readonly failed: Problem[] = []; // files of the world's objects
  calibrating = false; // the only ghost is the pose of a calibration
  readonly toolChanged = new Signal<number>();
  firstPicture = 0; // ms since the start of loading
  readonly others: OtherRobots;
  // The box around the objects that belong to the picture of robots in that box.
  nearby: (robots: THREE.Box3) => THREE.Box3 = () => new THREE.Box3();
  private selecting = false; // the next robot is another one of the same picture
  private framed = new THREE.Box3(); // by the camera
  private unframed = false; // the selected robot is not in the middle of the picture yet
  private readonly outline = new THREE.Box3Helper(new THREE.Box3(), PICKED);
  private axes = new AxisLayer();
  private ghostPoses = new Float64Array();
  private stale = false;
  private past: ArrayLike<number> | null = null;
  private complete = false; // shadows and ground wait for the first picture
  private fitted = false;
  private highlighted: { mesh: THREE.Mesh; material: THREE.Material | THREE.Material[] }[] = [];
  private highlightedLink = -1;

  constructor(host: HTMLElement, private readonly twin: Twin, private readonly commander: Commander, private readonly assets: AssetStore) {
    this.stage = new Stage(host);
    this.camera = new CameraMan(this.stage);
    this.meshes = new MeshStore(assets);
    this.stage.scene.add(this.trace.line, this.outline);
    this.outline.visible = false;
    (this.outline.material as THREE.LineBasicMaterial).transparent = true;
    (this.outline.material as THREE.LineBasicMaterial).opacity = 0.55;
    this.others = new OtherRobots(twin, this);
    twin.selectedRobot.on(() => (this.selecting = true));
    twin.robotChanged.on((tree) => this.build(tree));
    twin.moved.on(() => {
      this.stale = true;
      this.stage.moved();
    });
    twin.phaseChanged.on((phase) => {
      if (phase === 'lost') this.meshes.forget();
      host.classList.toggle('lost', phase !== 'open');
    });
    commander.stopChanged.on(() => {
      this.stale = true;
      this.stage.invalidate();
    });
    this.stage.frame.on(() => {
      this.place();
      this.showOutline();
    });
    twin.robotsChanged.on(() => this.stage.invalidate());
    // For an arm at rest, the ghost is hidden only when the difference to the target ends.
    twin.sampled.on(() => {
      if (!this.ghost?.root.visible || this.past !== null || this.ghostDiffers()) return;
      this.stale = true;
      this.stage.invalidate();
    });
    twin.rewound.on(() => this.trace.clear());
    this.applyOthers();
    setTimeout(() => this.stage.begin(), GROUND_TIMEOUT);
    twin.referenceChanged.on(() => {
      if (this.ghostDiffers()) this.stage.invalidate();
    });
  }

  private build(tree: Tree): void {
    for (const old of [this.view, this.ghost]) if (old) this.stage.scene.remove(old.root);
    this.highlighted = [];
    this.highlightedLink = -1;
    this.axes = new AxisLayer();
    this.ghostPoses = tree.newPoses();
    this.showPast(null);
    this.view = new RobotView(tree, this.meshes, () => this.loaded());
    this.ghost = new RobotView(tree, this.meshes, this.stage.invalidate, ghostMaterial);
    this.view.place(this.twin.poses);
    this.stage.scene.add(this.view.root, this.ghost.root);
    this.size = this.guessSize(tree);
    const wanted = tree.linkIndex.get(settings.tool);
    this.tool = wanted ?? tree.toolLink();
    this.trace.clear();
    for (const layer of ['visual', 'collision', 'inertia', 'com', 'frames', 'axes'] as Layer[]) {
      if (settings.layers[layer]) this.applyLayer(layer, true);
    }
    this.applyOthers();
    this.fitted = this.unframed = this.selecting && this.complete;
    this.selecting = false;
    if (this.fitted) this.frameSelected();
    else this.fit();
    this.built.emit(this.view);
    this.toolChanged.emit(this.tool);
  }

  private guessSize(tree: Tree): number {
    const poses = tree.newPoses();
    tree.forward(tree.rest(), poses);
    const box = new THREE.Box3();
    for (let i = 0; i < tree.links.length; i += 1) {
      box.expandByPoint(new THREE.Vector3(poses[i * STRIDE], poses[i * STRIDE + 1], poses[i * STRIDE + 2]));
    }
    return Math.max(0.1, box.getSize(new THREE.Vector3()).length() * 1.2);
  }

  private loaded(): void {
    this.stage.moved();
    if (this.view?.loading === 0 && !this.fitted) this.fit();
    if (this.unframed) this.frameSelected();
  }

  // The robot that was chosen among several.
  private frameSelected(): void {
    if (!this.view || this.view.loading > 0) return;
    this.unframed = false;
    this.camera.frame(this.bounds(this.view));
  }

  private showOutline(): void {
    const { view } = this;
    this.outline.visible = view !== null && this.twin.robots.length > 1;
    if (view && this.outline.visible) this.outline.box.copy(this.bounds(view)).expandByScalar(this.size * 0.01);
  }

  // A robot of another source in one colour. Its meshes come from there, or are those of this one.
  addGhost(tree: Tree, client: Client | null, colour: number, opacity: number): RobotView {
    const material = ghostMaterial.clone();
    material.color.set(colour);
    material.opacity = opacity;
    const ghost = new RobotView(tree, client ? new MeshStore(this.assets.of(client)) : this.meshes, this.stage.invalidate, material);
    ghost.show('visual', true);
    this.stage.scene.add(ghost.root);
    return ghost;
  }

  // A robot that is not selected has a new shape.
  othersChanged(): void {
    this.stage.moved();
    this.grow();
  }

  // The first picture contains what arrives shortly after it.
  grow(): void {
    const first = !this.complete || (!this.camera.touched && performance.now() - this.firstPicture < FITTING_TIME);
    if (!first || !this.view || this.view.loading > 0) return;
    if (!this.complete || !this.framed.containsBox(this.everything(this.view))) this.fit();
  }

  // Shows the objects of a world that has no robot.
  fitObjects(box: THREE.Box3): void {
    if (this.view) return;
    if (!box.isEmpty()) this.frame(box);
    this.stage.begin();
    this.finish();
  }

  private bounds(view: RobotView): THREE.Box3 {
    view.root.updateMatrixWorld(true);
    const box = new THREE.Box3();
    for (let i = 0; i < view.links.length; i += 1) for (const mesh of view.meshesOf(i)) box.expandByObject(mesh);
    if (box.isEmpty()) {
      for (const link of view.links) box.expandByPoint(new THREE.Vector3().setFromMatrixPosition(link.matrixWorld));
      box.expandByScalar(this.size * 0.1);
    }
    return box;
  }

  private fit(): void {
    const { view } = this;
    if (!view) return;
    this.frame(this.everything(view));
    if (view.loading > 0) return;
    this.fitted = true;
    if (!this.complete) performance.mark('doppel: meshes');
    this.stage.begin();
    if (!this.complete) requestAnimationFrame(() => {
      performance.mark('doppel: drawn');
      this.stage.finished(() => this.finish());
    });
  }

  private everything(view: RobotView): THREE.Box3 {
    const robots = this.bounds(view).union(this.others.bounds());
    return robots.union(this.nearby(robots.clone()));
  }

  private frame(box: THREE.Box3): void {
    this.framed = box.clone().expandByScalar(box.getSize(new THREE.Vector3()).length() * 0.05);
    this.size = Math.max(0.05, box.getSize(new THREE.Vector3()).length());
    this.camera.fit(box);
    this.stage.fit(box.getCenter(new THREE.Vector3()), this.size);
    this.camera.jump('corner');
  }

  private finish(): void {
    if (this.complete) return;
    this.complete = true;
    this.firstPicture = performance.now();
    this.applyOthers();
    this.pictured.emit();
  }

  refit(): void {
    if (this.view) this.fit();
    else this.camera.jump('corner');
  }

  // The robot in its current pose, or the world without one, from that side.
  look(from: ViewName): void {
    if (this.view) this.camera.fit(this.bounds(this.view));
    this.camera.go(from);
  }

  setTool(link: number): void {
    this.tool = link;
    set('tool', this.view?.tree.links[link] ?? '');
    this.trace.clear();
    this.toolChanged.emit(link);
    this.stage.invalidate();
  }

  setLayer(layer: string, on: boolean): void {
    set('layers', { ...settings.layers, [layer]: on });
    if (['visual', 'collision', 'inertia', 'com', 'frames', 'axes'].includes(layer)) this.applyLayer(layer as Layer, on);
    else this.applyOthers();
  }

  private applyLayer(layer: Layer, on: boolean): void {
    const makers: Partial<Record<Layer, LayerMaker>> = {
      inertia: inertiaBoxes,
      com: centres(this.size),
      frames: frames(this.size),
      axes: this.axes.make(this.size),
    };
    this.view?.show(layer, on, makers[layer]);
    this.stage.moved();
    this.axes.update(this.twin.q);
  }

  private applyOthers(): void {
    const { layers } = settings;
    this.stage.ground.grid.visible = layers['grid'] ?? true;
    this.stage.shadows(this.complete && (layers['shadows'] ?? true));
    this.trace.line.visible = layers['trace'] ?? false;
    if (!layers['trace']) this.trace.clear();
    this.stage.invalidate();
  }

  theme(dark: boolean): void {
    this.stage.ground.colour(dark ? '#5b6670' : '#8b959f', dark ? 0.45 : 0.2);
    this.stage.theme(dark ? 2.1 : 2.5, dark ? 1.25 : 1.6);
  }

  // The ghost shows these positions of a past time instead of the commanded ones; null: no longer.
  showPast(q: ArrayLike<number> | null): void {
    if (q === null && this.past === null) return;
    this.past = q;
    ghostMaterial.color.set(q ? PAST : COMMANDED);
    this.stale = true;
    this.stage.invalidate();
  }

  private ghostDiffers(): boolean {
    const { q, target, tree } = this.twin;
    if (!tree) return false;
    for (const joint of tree.moving) {
      if (Math.abs(q[joint.index]! - target[joint.index]!) > (joint.kind === 'prismatic' ? 0.002 : 0.012)) return true;
    }
    return false;
  }

  private place(): void {
    const { view, twin, ghost } = this;
    if (!view || !this.stale) return;
    this.stale = false;
    view.place(twin.poses);
    this.stage.ground.stand(view.tree.linkIndex.has('ground') ? null : twin.transforms.toWorld('ground'));
    this.axes.update(twin.q);
    const o = this.tool * STRIDE;
    if (settings.layers['trace']) this.trace.add(twin.poses[o]!, twin.poses[o + 1]!, twin.poses[o + 2]!);
    if (!ghost) return;
    const show = this.past !== null || !this.calibrating && (settings.layers['ghost'] ?? true) && !this.commander.viewing && !this.commander.stopped && this.ghostDiffers();
    if (show) {
      ghost.show('visual', true);
      const root = view.tree.root * STRIDE;
      this.ghostPoses.set(twin.poses.subarray(root, root + STRIDE), root);
      view.tree.forward(this.past ?? twin.target, this.ghostPoses);
      ghost.place(this.ghostPoses);
    }
    ghost.root.visible = show;
  }

  highlight(link: number): void {
    if (link === this.highlightedLink) return;
    for (const { mesh, material } of this.highlighted) mesh.material = material;
    this.highlighted = [];
    this.highlightedLink = link;
    if (link >= 0 && this.view) {
      for (const mesh of this.view.meshesOf(link)) {
        this.highlighted.push({ mesh, material: mesh.material });
        const base = Array.isArray(mesh.material) ? mesh.material[0]! : mesh.material;
        const glowing = base.clone() as THREE.MeshStandardMaterial;
        glowing.color.lerp(PICKED, 0.75);
        if (glowing.emissive) {
          glowing.emissive.copy(PICKED);
          glowing.emissiveIntensity = 0.35;
        } else {
          glowing.opacity = Math.max(glowing.opacity, 0.4);
        }
        mesh.material = glowing;
      }
    }
    this.stage.invalidate();
  }

  toolPosition(): THREE.Vector3 {
    const o = this.tool * STRIDE;
    return new THREE.Vector3(this.twin.poses[o], this.twin.poses[o + 1], this.twin.poses[o + 2]);
  }
}
