// Pulling a link with the mouse: a spring between the grabbed point and the pointer, as a force that acts slightly
// longer than until the next one.
import * as THREE from 'three';
import type { App } from '../app/app';
import { toast } from '../app/dom';
import { Signal } from '../app/signal';
import type { Hit, Picker } from './picking';

const PERIOD = 50; // ms

export class Pusher {
  armed = false;
  stiffness = 100; // N/m
  most = 50; // N
  readonly forceChanged = new Signal<number>();
  private link = -1;
  private readonly local = new THREE.Vector3();
  private readonly target = new THREE.Vector3();
  private readonly plane = new THREE.Plane();
  private readonly arrow = new THREE.ArrowHelper(new THREE.Vector3(0, 0, 1), new THREE.Vector3(), 0.1, 0xe69f00);
  private timer: ReturnType<typeof setInterval> | null = null;

  constructor(private readonly app: App, private readonly picker: Picker) {
    this.arrow.visible = false;
    app.world.stage.scene.add(this.arrow);
  }

  get active(): boolean {
    return this.link >= 0;
  }

  begin(hit: Hit): void {
    const { world, twin } = this.app;
    if (!twin.client.services.has('/gazebo/apply_link_wrench')) {
      toast(twin.recording ? 'This is a recording: nothing can be pushed.' : 'Nothing can be pushed here: this twin has no physics.', 'warning');
      return;
    }
    this.link = hit.link;
    world.view!.root.updateMatrixWorld(true);
    world.view!.links[hit.link]!.worldToLocal(this.local.copy(hit.point));
    this.target.copy(hit.point);
    this.plane.setFromNormalAndCoplanarPoint(world.stage.camera.getWorldDirection(new THREE.Vector3()), hit.point);
    world.camera.controls.enabled = false;
    this.timer = setInterval(() => this.push(), PERIOD);
  }

  move(event: PointerEvent): void {
    if (!this.active) return;
    this.picker.rayAt(event).intersectPlane(this.plane, this.target);
    this.draw();
  }

  private point(): THREE.Vector3 {
    const link = this.app.world.view!.links[this.link]!;
    return this.local.clone().applyMatrix4(link.matrix);
  }

  private force(): THREE.Vector3 {
    const force = this.target.clone().sub(this.point()).multiplyScalar(this.stiffness);
    return force.length() > this.most ? force.setLength(this.most) : force;
  }

  private draw(): void {
    const from = this.point();
    const way = this.target.clone().sub(from);
    const length = way.length();
    this.arrow.visible = length > 1e-4;
    if (this.arrow.visible) {
      this.arrow.position.copy(from);
      this.arrow.setDirection(way.normalize());
      this.arrow.setLength(length, Math.min(length * 0.3, this.app.world.size * 0.05), this.app.world.size * 0.02);
    }
    this.app.world.stage.invalidate();
  }

  private push(): void {
    const { twin } = this.app;
    if (!this.active || !twin.tree) return;
    const force = this.force();
    this.forceChanged.emit(force.length());
    this.draw();
    twin.client.call('/gazebo/apply_link_wrench', {
      link_name: twin.linkName(this.link),
      reference_point: { x: this.local.x, y: this.local.y, z: this.local.z },
      wrench: { force: { x: force.x, y: force.y, z: force.z } },
      duration: { sec: 0, nanosec: PERIOD * 1e6 },
    }, 1000).then((answer) => {
      if (answer['success'] === false) toast(String(answer['status_message']), 'warning');
    }, () => {});
  }

  end(): void {
    if (!this.active) return;
    const name = this.app.twin.linkName(this.link);
    this.link = -1;
    if (this.timer !== null) clearInterval(this.timer);
    this.arrow.visible = false;
    this.app.world.camera.controls.enabled = true;
    this.forceChanged.emit(0);
    void this.app.twin.client.call('/gazebo/clear_link_wrenches', { link_name: name }).catch(() => {});
    this.app.world.stage.invalidate();
  }
}
