// Finds the object under the pointer.
import * as THREE from 'three';
import type { World } from './world';

export interface Hit {
  link: number;
  point: THREE.Vector3;
}

export class Picker {
  private readonly ray = new THREE.Raycaster();

  constructor(private readonly world: World) {}

  rayAt(event: { clientX: number; clientY: number }): THREE.Ray {
    const { stage } = this.world;
    const box = stage.renderer.domElement.getBoundingClientRect();
    const at = new THREE.Vector2(((event.clientX - box.left) / box.width) * 2 - 1, 1 - ((event.clientY - box.top) / box.height) * 2);
    this.ray.setFromCamera(at, stage.camera);
    return this.ray.ray;
  }

  hit(event: { clientX: number; clientY: number }): Hit | null {
    const { view } = this.world;
    if (!view) return null;
    this.rayAt(event);
    const meshes: THREE.Object3D[] = [];
    for (let i = 0; i < view.links.length; i += 1) meshes.push(...view.meshesOf(i).filter((mesh) => mesh.parent));
    for (const found of this.ray.intersectObjects(meshes, false)) {
      for (let at: THREE.Object3D | null = found.object; at; at = at.parent) {
        if (!at.visible) break;
        const link = at.userData['link'] as number | undefined;
        if (link !== undefined) return { link, point: found.point };
      }
    }
    return null;
  }
}
