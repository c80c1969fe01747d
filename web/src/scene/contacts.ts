// Contact points and forces, from whatever topic tells them (gazebo_msgs or ros_gz_interfaces).
import * as THREE from 'three';
import type { App } from '../app/app';
import { settings, settingsChanged } from '../app/settings';
import type { Message, Value } from '../protocol/cdr';

const MOST = 64;

export class ContactLayer {
  private readonly root = new THREE.Group();
  private readonly arrows: THREE.ArrowHelper[] = [];
  private end: (() => void) | null = null;
  private topic = '';

  constructor(private readonly app: App) {
    app.world.stage.scene.add(this.root);
    app.twin.graphChanged.on(() => this.listen());
    settingsChanged.on((key) => {
      if (key === 'layers') this.listen();
    });
  }

  private listen(): void {
    const found = settings.layers['contacts']
      ? [...this.app.twin.client.channels.values()].find((c) => /\/(ContactsState|Contacts)$/.test(c.schemaName))?.topic ?? '' : '';
    if (found === this.topic) return;
    this.end?.();
    this.topic = found;
    this.end = found === '' ? null : this.app.twin.client.subscribe(found, (m) => this.show(m));
    this.root.clear();
    this.arrows.length = 0;
    this.app.world.stage.invalidate();
  }

  private show(message: Message): void {
    let used = 0;
    const vector = (v: Value | undefined): THREE.Vector3 => {
      const { x, y, z } = (v ?? { x: 0, y: 0, z: 0 }) as { x: number; y: number; z: number };
      return new THREE.Vector3(x, y, z);
    };
    for (const state of (message['states'] ?? message['contacts'] ?? []) as Message[]) {
      const points = (state['contact_positions'] ?? state['positions'] ?? []) as Message[];
      const normals = (state['contact_normals'] ?? state['normals'] ?? []) as Message[];
      const wrenches = (state['wrenches'] ?? []) as Message[];
      points.forEach((point, i) => {
        if (used >= MOST) return;
        const wrench = wrenches[i];
        const body = (wrench?.['body_1_wrench'] ?? wrench) as Message | undefined;
        const force = body ? vector(body['force']) : vector(normals[i]);
        this.draw(used, vector(point), force, body !== undefined);
        used += 1;
      });
    }
    for (let i = used; i < this.arrows.length; i += 1) this.arrows[i]!.visible = false;
    this.app.world.stage.invalidate();
  }

  private draw(i: number, at: THREE.Vector3, force: THREE.Vector3, scaled: boolean): void {
    const { size } = this.app.world;
    let arrow = this.arrows[i];
    if (!arrow) {
      arrow = new THREE.ArrowHelper(new THREE.Vector3(0, 0, 1), at, 0.1, 0xd55e00);
      this.arrows.push(arrow);
      this.root.add(arrow);
    }
    const strength = force.length();
    arrow.visible = strength > 1e-9;
    if (!arrow.visible) return;
    const length = scaled ? Math.min(size * 0.5, size * 0.04 * (1 + Math.log10(1 + strength * 10))) : size * 0.08;
    arrow.position.copy(at);
    arrow.setDirection(force.normalize());
    arrow.setLength(length, length * 0.3, length * 0.15);
  }
}
