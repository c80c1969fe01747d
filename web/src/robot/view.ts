// A robot as a three.js object: a group per link, placed by poses of the tree; shapes in layers that are made when
// first shown.

import * as THREE from 'three';
import { collisionMaterial, ghostMaterial, materialOf } from './materials';
import type { MeshStore } from './meshes';
import { STRIDE, type Tree } from './tree';
import type { Shape } from './urdf';

export type Layer = 'visual' | 'collision' | 'inertia' | 'com' | 'frames' | 'axes';
export type LayerMaker = (tree: Tree, link: number, into: THREE.Group) => void;

function applyOrigin(object: THREE.Object3D, shape: Shape): void {
  object.position.set(...shape.origin.xyz);
  object.rotation.set(...shape.origin.rpy, 'ZYX');
}

function primitive(shape: Shape): THREE.BufferGeometry | null {
  const g = shape.geometry;
  switch (g.kind) {
    case 'box':
      return new THREE.BoxGeometry(...g.size);
    case 'sphere':
      return new THREE.SphereGeometry(g.radius, 32, 20);
    case 'cylinder':
      return new THREE.CylinderGeometry(g.radius, g.radius, g.length, 40).rotateX(Math.PI / 2);
    case 'capsule':
      return new THREE.CapsuleGeometry(g.radius, g.length, 8, 28).rotateX(Math.PI / 2);
    case 'mesh':
      return null;
  }
}

export class RobotView {
  readonly root = new THREE.Group();
  readonly links: THREE.Group[] = [];
  private readonly layers = new Map<Layer, THREE.Group[]>();
  loading = 0;
  failed: { uri: string; reason: string }[] = [];

  constructor(
    readonly tree: Tree,
    private readonly meshes: MeshStore,
    private readonly changed: () => void,
    private readonly ghost = false,
  ) {
    for (const name of tree.links) {
      const group = new THREE.Group();
      group.name = name;
      group.matrixAutoUpdate = false;
      group.userData['link'] = this.links.length;
      this.links.push(group);
      this.root.add(group);
    }
  }

  show(layer: Layer, on: boolean, make?: LayerMaker): void {
    let groups = this.layers.get(layer);
    if (!groups && on) {
      groups = this.links.map((link, index) => {
        const group = new THREE.Group();
        group.userData['layer'] = layer;
        link.add(group);
        if (make) make(this.tree, index, group);
        else this.addShapes(index, group, layer === 'collision');
        return group;
      });
      this.layers.set(layer, groups);
    }
    for (const group of groups ?? []) group.visible = on;
    this.changed();
  }

  place(poses: Float64Array): void {
    for (let i = 0; i < this.links.length; i += 1) {
      const o = i * STRIDE;
      position.set(poses[o]!, poses[o + 1]!, poses[o + 2]!);
      turn.set(poses[o + 3]!, poses[o + 4]!, poses[o + 5]!, poses[o + 6]!);
      this.links[i]!.matrix.compose(position, turn, one);
    }
  }

  // What of the link can be highlighted.
  meshesOf(link: number): THREE.Mesh[] {
    const out: THREE.Mesh[] = [];
    for (const group of this.links[link]?.children ?? []) {
      if (group.userData['layer'] !== 'visual' && group.userData['layer'] !== 'collision') continue;
      group.traverse((object) => {
        if (object instanceof THREE.Mesh) out.push(object);
      });
    }
    return out;
  }

  private addShapes(index: number, into: THREE.Group, collision: boolean): void {
    const link = this.tree.robot.links.get(this.tree.links[index]!)!;
    for (const shape of collision ? link.collisions : link.visuals) {
      const holder = new THREE.Group();
      applyOrigin(holder, shape);
      into.add(holder);
      const material = this.ghost ? ghostMaterial : collision ? collisionMaterial : materialOf(shape.material);
      const geometry = primitive(shape);
      if (geometry) holder.add(this.solid(geometry, material, collision));
      else if (shape.geometry.kind === 'mesh') void this.addMesh(shape, holder, material, collision);
    }
  }

  private solid(geometry: THREE.BufferGeometry, material: THREE.Material, collision: boolean): THREE.Mesh {
    const mesh = new THREE.Mesh(geometry, material);
    mesh.castShadow = !collision && !this.ghost;
    mesh.receiveShadow = !collision && !this.ghost;
    return mesh;
  }

  private async addMesh(shape: Shape, holder: THREE.Group, material: THREE.Material, collision: boolean): Promise<void> {
    if (shape.geometry.kind !== 'mesh') return;
    const { uri, scale } = shape.geometry;
    this.loading += 1;
    try {
      const loaded = await this.meshes.get(uri);
      if ('geometry' in loaded) {
        holder.add(this.solid(loaded.geometry, material, collision));
      } else {
        const own = loaded.object.clone();
        own.traverse((object) => {
          if (!(object instanceof THREE.Mesh)) return;
          object.castShadow = object.receiveShadow = !collision && !this.ghost;
          if (this.ghost || collision || shape.material) object.material = material;
        });
        holder.add(own);
      }
      holder.scale.set(...scale);
    } catch (problem) {
      this.failed.push({ uri, reason: (problem as Error).message });
    } finally {
      this.loading -= 1;
      this.changed();
    }
  }
}

const position = new THREE.Vector3();
const turn = new THREE.Quaternion();
const one = new THREE.Vector3(1, 1, 1);
