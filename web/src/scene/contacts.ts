// Contact points and forces (/gazebo/contacts): a ball at each point, an arrow along the force.
import * as THREE from 'three';
import type { App } from '../app/app';
import { settings, settingsChanged } from '../app/settings';
import type { Message, Value } from '../protocol/cdr';

const MOST = 64; // maximum number of drawn contacts
const TOPIC = '/gazebo/contacts';
const COLOUR = 0xd55e00;

function vector(value: Value | undefined): THREE.Vector3 {
  const { x, y, z } = (value ?? { x: 0, y: 0, z: 0 }) as { x: number; y: number; z: number };
  return new THREE.Vector3(x, y, z);
}

export class ContactLayer {
  private readonly root = new THREE.Group();
  private readonly marks: { ball: THREE.Mesh; arrow: THREE.ArrowHelper }[] = [];
  private end: (() => void) | null = null;

  constructor(private readonly app: App) {
    app.world.stage.scene.add(this.root);
    settingsChanged.on((key) => {
      if (key === 'layers') this.listen();
    });
    app.twin.phaseChanged.on(() => this.show([]));
    this.listen();
  }

  private listen(): void {
    const wanted = settings.layers['contacts'] ?? false;
    if (wanted === (this.end !== null)) return;
    this.end?.();
    this.end = wanted ? this.app.twin.client.subscribe(TOPIC, (m) => this.show(m['states'] as Message[])) : null;
    if (!wanted) this.show([]);
  }

  private show(states: Message[]): void {
    let used = 0;
    for (const state of states) {
      const normals = state['contact_normals'] as Message[];
      const wrenches = state['wrenches'] as Message[];
      (state['contact_positions'] as Message[]).forEach((point, i) => {
        if (used >= MOST) return;
        const force = vector(wrenches[i]?.['force']);
        this.draw(used, vector(point), force.lengthSq() > 0 ? force : vector(normals[i]).setLength(1e-3));
        used += 1;
      });
    }
    for (let i = used; i < this.marks.length; i += 1) this.marks[i]!.ball.visible = this.marks[i]!.arrow.visible = false;
    this.app.world.stage.invalidate();
  }

  private draw(i: number, at: THREE.Vector3, force: THREE.Vector3): void {
    const { size } = this.app.world;
    let mark = this.marks[i];
    if (!mark) {
      const ball = new THREE.Mesh(new THREE.SphereGeometry(1, 10, 8), new THREE.MeshBasicMaterial({ color: COLOUR, depthTest: false, transparent: true }));
      mark = { ball, arrow: new THREE.ArrowHelper(new THREE.Vector3(0, 0, 1), at, 0.1, COLOUR) };
      this.marks.push(mark);
      this.root.add(ball, mark.arrow);
    }
    const { ball, arrow } = mark;
    const strength = force.length();
    ball.visible = true;
    ball.position.copy(at);
    ball.scale.setScalar(size * 0.008);
    arrow.visible = strength > 1e-9;
    if (!arrow.visible) return;
    const length = Math.min(size * 0.5, size * 0.04 * (1 + Math.log10(1 + strength * 10)));
    arrow.position.copy(at);
    arrow.setDirection(force.normalize());
    arrow.setLength(length, length * 0.3, length * 0.15);
  }
}
