// A robot as a three.js object: a group per link, placed by poses of the tree; shapes in layers that are created when
// first shown.

import * as THREE from 'three';
import { collisionEdges, collisionMaterial, materialOf, texturedOf } from './materials';
import type { MeshStore } from './meshes';
import { missingBox } from './missing';
import { STRIDE, type Tree } from './tree';
import type { Link, Material, Shape, Vec3 } from './urdf';

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
    private readonly ghost: THREE.Material | null = null, // of all shapes, instead of their own
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

  // The meshes of the link that can be highlighted.
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
      const geometry = primitive(shape);
      if (geometry) holder.add(collision ? colliding(geometry) : this.solid(geometry, shape));
      else if (shape.geometry.kind === 'mesh') void this.addMesh(shape, shape.geometry, holder, collision ? null : { link, into });
    }
  }

  private solid(geometry: THREE.BufferGeometry, shape: Shape): THREE.Mesh {
    const mesh = new THREE.Mesh(geometry, this.ghost ?? materialOf(shape.material));
    mesh.castShadow = mesh.receiveShadow = !this.ghost;
    if (!this.ghost && shape.material?.texture) void this.paint(mesh, shape.material);
    return mesh;
  }

  private async paint(mesh: THREE.Mesh, material: Material): Promise<void> {
    try {
      mesh.material = texturedOf(material, await this.meshes.texture(material.texture!));
    } catch (problem) {
      this.failed.push({ uri: material.texture!, reason: (problem as Error).message });
    }
    this.changed();
  }

  private async addMesh(shape: Shape, { uri, scale }: { uri: string; scale: Vec3 }, holder: THREE.Group, visual: { link: Link; into: THREE.Group } | null): Promise<void> {
    this.loading += 1;
    try {
      if (!visual) {
        holder.add(colliding(await this.meshes.hull(uri)));
      } else {
        const loaded = await this.meshes.get(uri);
        holder.add('geometry' in loaded ? this.solid(loaded.geometry, shape) : this.own(loaded.object, shape));
        if (!this.ghost) this.failed.push(...(loaded.problems ?? []));
      }
      holder.scale.set(...scale);
    } catch (problem) {
      this.failed.push({ uri, reason: (problem as Error).message });
      if (visual && !this.ghost) this.replace(uri, visual.link, visual.into, holder);
    } finally {
      this.loading -= 1;
      this.changed();
    }
  }

  // In place of a mesh that is missing; the collision shapes are those of the whole link.
  private replace(uri: string, link: Link, into: THREE.Group, holder: THREE.Group): void {
    if (into.userData['replaced']) return;
    into.userData['replaced'] = true;
    let shapes = 0;
    for (const shape of link.collisions) {
      const geometry = primitive(shape);
      if (!geometry) continue;
      const made = new THREE.Group();
      applyOrigin(made, shape);
      made.add(this.solid(geometry, { ...shape, material: null }));
      into.add(made);
      shapes += 1;
    }
    if (shapes === 0) holder.add(missingBox(uri));
  }

  // A mesh file's own materials are kept, as in RViz; the description's material is used where there is none.
  private own(object: THREE.Object3D, shape: Shape): THREE.Object3D {
    const made = object.clone();
    made.traverse((one) => {
      if (!(one instanceof THREE.Mesh)) return;
      one.castShadow = one.receiveShadow = !this.ghost;
      if (this.ghost) one.material = this.ghost;
      else one.material = dressed(one.material as THREE.Material | THREE.Material[], one.userData['bare'] as boolean[] | undefined, materialOf(shape.material));
    });
    return made;
  }
}

function dressed(materials: THREE.Material | THREE.Material[], bare: boolean[] | undefined, own: THREE.Material): THREE.Material | THREE.Material[] {
  return Array.isArray(materials) ? materials.map((one, i) => (bare?.[i] ? own : one)) : bare?.[0] ? own : materials;
}

function colliding(geometry: THREE.BufferGeometry): THREE.Mesh {
  const mesh = new THREE.Mesh(geometry, collisionMaterial);
  mesh.add(new THREE.LineSegments(new THREE.EdgesGeometry(geometry, 12), collisionEdges));
  mesh.renderOrder = 2;
  return mesh;
}

const position = new THREE.Vector3();
const turn = new THREE.Quaternion();
const one = new THREE.Vector3(1, 1, 1);
