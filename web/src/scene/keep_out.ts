// The boxes of the world that no robot may enter, as published on /doppel/keep_out: translucent, with their names.
import * as THREE from 'three';
import type { App } from '../app/app';
import type { LayerChoice } from '../app/layer_toggles';
import { settings, settingsChanged } from '../app/settings';
import type { Message } from '../protocol/cdr';
import { label } from '../robot/label';

const LAYER: LayerChoice = { id: 'keep_out', label: 'Keep-out boxes', title: 'Boxes of the world that no robot may enter' };
const COLOUR = 0xd55e00;
const LABEL_SHARE = 0.08; // of the picture's size: the height of a name

const FACES = new THREE.MeshBasicMaterial({ color: COLOUR, transparent: true, opacity: 0.16, depthWrite: false, side: THREE.DoubleSide });
const EDGES = new THREE.LineBasicMaterial({ color: COLOUR });

type Vector = { x: number; y: number; z: number };

function vectorOf(message: unknown): THREE.Vector3 {
  const { x, y, z } = message as Vector;
  return new THREE.Vector3(x, y, z);
}

export class KeepOutBoxes {
  readonly root = new THREE.Group();
  names: string[] = [];
  private cubes: Message[] = [];

  constructor(private readonly app: App) {
    app.world.stage.scene.add(this.root);
    app.twin.client.subscribe('/doppel/keep_out', (m) => {
      this.cubes = (m['markers'] as Message[]).filter((one) => one['ns'] === 'keep_out');
      this.draw();
    });
    settingsChanged.on((key) => {
      if (key === 'layers') this.reflect();
    });
    app.world.built.on(() => this.draw()); // the names are as large as the picture needs them
    addEventListener('themechange', () => this.draw());
  }

  offered(): LayerChoice[] {
    return this.cubes.length > 0 ? [LAYER] : [];
  }

  private reflect(): void {
    this.root.visible = settings.layers[LAYER.id] ?? true;
    this.app.world.stage.invalidate();
  }

  private draw(): void {
    this.root.clear();
    this.names = this.cubes.map((one) => String(one['text']));
    const dark = document.documentElement.dataset['theme'] === 'dark';
    for (const cube of this.cubes) {
      const size = vectorOf(cube['scale']);
      const { position, orientation } = cube['pose'] as unknown as { position: Vector; orientation: Vector & { w: number } };
      const holder = new THREE.Group();
      holder.position.copy(vectorOf(position));
      holder.quaternion.set(orientation.x, orientation.y, orientation.z, orientation.w);
      const box = new THREE.BoxGeometry(size.x, size.y, size.z);
      const faces = new THREE.Mesh(box, FACES);
      faces.renderOrder = 3;
      const name = label(String(cube['text']), dark ? '#ffb27a' : '#9a4300', this.app.world.size * LABEL_SHARE);
      name.center.set(0.5, 0);
      name.position.copy(holder.position);
      holder.add(faces, new THREE.LineSegments(new THREE.EdgesGeometry(box), EDGES));
      holder.updateMatrixWorld(true);
      name.position.z = new THREE.Box3().setFromObject(holder).max.z;
      this.root.add(holder, name);
    }
    this.reflect();
  }
}
