// Contact points and forces (/gazebo/contacts): a ball at each point, an arrow along the force.
import * as THREE from 'three';
import type { App } from '../app/app';
import { settings, settingsChanged } from '../app/settings';
import type { Message, Value } from '../protocol/cdr';
import { ForceArrows } from './force_arrows';

const MOST = 64; // maximum number of drawn contacts
const TOPIC = '/gazebo/contacts';
const COLOUR = 0xd55e00;

export function vector(value: Value | undefined): THREE.Vector3 {
  const { x, y, z } = (value ?? { x: 0, y: 0, z: 0 }) as { x: number; y: number; z: number };
  return new THREE.Vector3(x, y, z);
}

export class ContactLayer {
  private readonly arrows = new ForceArrows(COLOUR, MOST);
  private end: (() => void) | null = null;

  constructor(private readonly app: App) {
    app.world.stage.scene.add(this.arrows.root);
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
    const { size, stage } = this.app.world;
    this.arrows.begin();
    for (const state of states) {
      const normals = state['contact_normals'] as Message[];
      const wrenches = state['wrenches'] as Message[];
      (state['contact_positions'] as Message[]).forEach((point, i) => {
        const force = vector(wrenches[i]?.['force']);
        const along = force.lengthSq() > 0 ? force : vector(normals[i]).setLength(1e-3);
        const strength = along.length();
        const length = strength > 1e-9 ? Math.min(size * 0.5, size * 0.04 * (1 + Math.log10(1 + strength * 10))) : 0;
        this.arrows.add(vector(point), along, length, size * 0.008);
      });
    }
    this.arrows.end();
    stage.invalidate();
  }
}
