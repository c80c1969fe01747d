// Static and free objects of the world, as published on /doppel/objects; a handle on the selected one.
import * as THREE from 'three';
import type { TransformControls } from 'three/addons/controls/TransformControls.js';
import type { App } from '../app/app';
import { toast } from '../app/dom';
import { Signal } from '../app/signal';
import type { Message } from '../protocol/cdr';
import type { Problem } from '../robot/bundle';
import { materialOf } from '../robot/materials';
import { bareOf, partOf, physicalOf } from './looks';
import type { Picker } from './picking';
import { Surroundings } from './surroundings';
import { terrainOf } from './terrain';

export const OBJECTS_TOPIC = '/doppel/objects', SCENE_TOPIC = '/doppel/scene';
export const SPAWN = '/spawn_entity', DELETE = '/delete_entity', SET_STATE = '/gazebo/set_entity_state';
const PERIOD = 40; // ms between two poses sent while dragging
const NEAR_SIZE = 2, NEAR_DISTANCE = 3; // of objects in the first picture, in sizes of the robots
const ACTION = { remove: 2, removeAll: 3 }; // visualization_msgs/Marker
const PLANE = 0.001; // m, the thickness of a box that stands for a plane
const MARKER = { cube: 1, sphere: 2, cylinder: 3, mesh: 10, triangles: 11 };

// The drawn parts of one marker.
interface Part {
  holder: THREE.Group;
  shape: string; // the marker that it was created from
  marker: Message;
  flat: boolean; // a plane, whose size is arbitrary
}

export interface WorldObject {
  name: string;
  holder: THREE.Group; // of its first part, which the handle moves
  parts: Map<number, Part>; // by the marker's id
}

type Vector = { x: number; y: number; z: number };

export class ObjectLayer {
  readonly objects = new Map<string, WorldObject>();
  readonly listChanged = new Signal();
  readonly selectedChanged = new Signal<string | null>();
  readonly placingChanged = new Signal<boolean>();
  selected: string | null = null;
  private readonly root = new THREE.Group();
  private readonly proxy = new THREE.Object3D();
  private controls: TransformControls | null = null;
  private outline: THREE.Box3Helper | null = null;
  private sentAt = 0;
  private loading = 0; // meshes and textures
  private fitted = false;
  private readonly failed: Problem[]; // files of objects
  private materials = new Map<number, Message>(); // of /doppel/scene, by the marker's id
  private terrains = new Map<number, Message>();
  private unconfirmed = new Set<number>(); // markers of another time of a recording
  private readonly surroundings: Surroundings;
  private surrounded = false; // the scene has been received
  private placed: ((at: THREE.Vector3) => void) | null = null;

  constructor(private readonly app: App, private readonly picker: Picker) {
    const { world, twin } = app;
    this.failed = world.failed;
    world.stage.scene.add(this.root, this.proxy);
    this.surroundings = new Surroundings(world.stage);
    world.nearby = (robots) => this.near(robots);
    twin.client.subscribe(OBJECTS_TOPIC, (m) => this.take(m));
    twin.client.subscribe(SCENE_TOPIC, (m) => this.takeScene(m));
    twin.phaseChanged.on((phase) => {
      if (phase === 'open') this.clear(); // a lost twin's picture stays as it was
    });
    twin.statusChanged.on(() => this.fit());
    twin.rewound.on(() => this.rewind());
    app.selected.on((selection) => {
      if (selection) this.select(null);
    });
  }

  // Why objects cannot be changed here; '' if they can.
  get missing(): string {
    if (this.app.twin.recording) return 'This is a recording: its objects cannot be changed.';
    if (this.app.commander.viewing) return 'This view has no physics and therefore no objects.';
    const { services } = this.app.twin.client;
    const lacking = [SPAWN, DELETE, SET_STATE].filter((name) => !services.has(name));
    return lacking.length === 0 ? '' : `This twin cannot spawn objects: it does not offer ${lacking.join(', ')}.`;
  }

  // The markers of the new time follow at once; what is not among them was not there.
  private rewind(): void {
    this.unconfirmed = new Set([...this.objects.values()].flatMap(({ parts }) => [...parts.keys()]));
    queueMicrotask(() => {
      const gone = [...this.unconfirmed].filter((id) => this.drop(id));
      this.unconfirmed.clear();
      if (gone.length > 0) this.listChanged.emit();
      this.app.world.stage.moved();
    });
  }

  private clear(): void {
    this.select(null);
    this.surrounded = false;
    this.root.clear();
    this.objects.clear();
    this.failed.length = 0;
    this.listChanged.emit();
    this.app.world.stage.moved();
  }

  private take(message: Message): void {
    let changed = false;
    for (const marker of message['markers'] as Message[]) {
      const action = Number(marker['action']);
      const name = String(marker['text']) || String(marker['id']);
      if (action === ACTION.removeAll) {
        this.clear();
      } else if (action === ACTION.remove) {
        changed = this.drop(Number(marker['id'])) || changed;
      } else {
        changed = this.put(name, marker) || changed;
      }
    }
    if (changed) this.listChanged.emit();
    this.showOutline();
    this.app.world.stage.moved();
    this.fit();
  }

  // It may come before or after the markers that it completes.
  private takeScene(message: Message): void {
    const byMarker = (name: string): Map<number, Message> => new Map((message[name] as Message[]).map((one) => [Number(one['marker']), one]));
    this.materials = byMarker('materials');
    this.terrains = byMarker('terrains');
    this.surroundings.show(message);
    this.surrounded = true;
    for (const object of this.objects.values()) for (const part of object.parts.values()) this.look(part, part.marker);
    this.fit();
  }

  // Objects of a size and at a distance that belong to the picture of the robots, not the walls of their hall.
  private near(robots: THREE.Box3): THREE.Box3 {
    const size = robots.getSize(new THREE.Vector3()).length(), centre = robots.getCenter(new THREE.Vector3());
    const out = new THREE.Box3();
    for (const object of this.objects.values()) {
      const box = boundsOf(object);
      if (box.isEmpty() || [...object.parts.values()].some((part) => part.flat)) continue;
      if (box.getSize(new THREE.Vector3()).length() < NEAR_SIZE * size && box.distanceToPoint(centre) < NEAR_DISTANCE * size) out.union(box);
    }
    return out;
  }

  // The first picture of a world without a robot, repeated while meshes arrive.
  private fit(): void {
    if (!this.app.twin.withoutRobots) this.app.world.grow();
    if (this.fitted || !this.app.twin.withoutRobots) return;
    const { channels } = this.app.twin.client;
    const expected = !this.surrounded && [...channels.values()].some((channel) => channel.topic === SCENE_TOPIC);
    if (expected) return; // the terrain is in it
    this.fitted = this.loading === 0 && this.objects.size > 0;
    const flat: THREE.Box3[] = [], solid: THREE.Box3[] = [];
    for (const object of this.objects.values()) {
      for (const part of object.parts.values()) {
        const box = new THREE.Box3().setFromObject(part.holder);
        if (!box.isEmpty()) (part.flat ? flat : solid).push(box);
      }
    }
    this.app.world.fitObjects(aroundMost(solid.length > 0 ? solid : flat));
  }

  private drop(id: number): boolean {
    for (const [name, object] of this.objects) {
      const part = object.parts.get(id);
      if (!part) continue;
      this.root.remove(part.holder);
      object.parts.delete(id);
      const [next] = object.parts.values();
      if (next) {
        object.holder = next.holder;
        return false;
      }
      if (this.selected === name) this.select(null);
      this.objects.delete(name);
      return true;
    }
    return false;
  }

  private put(name: string, marker: Message): boolean {
    let object = this.objects.get(name);
    const made = object === undefined;
    const id = Number(marker['id']);
    let part = object?.parts.get(id);
    if (!part) {
      part = { holder: new THREE.Group(), shape: '', marker, flat: false };
      part.holder.userData['object'] = name;
      this.root.add(part.holder);
    }
    if (!object) {
      object = { name, holder: part.holder, parts: new Map() };
      this.objects.set(name, object);
    }
    object.parts.set(id, part);
    this.unconfirmed.delete(id);
    part.marker = marker;
    this.look(part, marker);
    const { position: p, orientation: q } = marker['pose'] as unknown as { position: Vector; orientation: Vector & { w: number } };
    if (this.controls?.dragging && this.selected === name) return made;
    part.holder.position.set(p.x, p.y, p.z);
    part.holder.quaternion.set(q.x, q.y, q.z, q.w);
    if (this.selected === name && part.holder === object.holder) this.follow(object);
    return made;
  }

  private look(part: Part, marker: Message): void {
    const scale = marker['scale'] as unknown as Vector;
    const colour = marker['color'] as unknown as { r: number; g: number; b: number; a: number };
    const type = Number(marker['type']);
    const uri = String(marker['mesh_resource'] ?? '');
    const texture = String(marker['texture_resource'] ?? '');
    const points = marker['points'] as unknown as Vector[];
    const terrain = this.terrains.get(Number(marker['id'])), physical = this.materials.get(Number(marker['id']));
    const shape = JSON.stringify([type, scale, colour, uri, texture, points.length, physical, terrain && [terrain['columns'], terrain['size_x'], terrain['size_y'], terrain['textures']]]);
    if (shape === part.shape) return;
    part.shape = shape;
    part.flat = type === MARKER.cube && Math.min(scale.x, scale.y, scale.z) <= PLANE;
    part.holder.clear();
    const embedded = uri !== '' && marker['mesh_use_embedded_materials'] === true;
    const rgba: [number, number, number, number] = [colour.r, colour.g, colour.b, colour.a > 0 ? colour.a : 1];
    const material = materialOf({ name: '', color: rgba, texture: null });
    const add = (made: THREE.Object3D): void => {
      made.traverse((one) => {
        if (!(one instanceof THREE.Mesh)) return;
        one.castShadow = one.receiveShadow = true;
        if (!embedded) one.material = material;
        else dress(one, material);
      });
      if (texture !== '' || physical) void this.paint(made, { color: rgba, texture, physical }, part, shape);
      part.holder.scale.set(scale.x || 1, scale.y || 1, scale.z || 1); // the mesh has a scale of its own: its unit
      this.put3d(part, made);
    };
    if (terrain) this.later(part, shape, terrainOf(terrain, (one, of) => this.app.world.meshes.texture(one, of), (one, reason) => this.failed.push({ uri: one, reason })), String(marker['text']), (made) => this.put3d(part, made));
    else if (type === MARKER.sphere) add(new THREE.Mesh(new THREE.SphereGeometry(0.5, 32, 20), material));
    else if (type === MARKER.cylinder) add(new THREE.Mesh(new THREE.CylinderGeometry(0.5, 0.5, 1, 40).rotateX(Math.PI / 2), material));
    else if (type === MARKER.triangles && uri !== '') this.later(part, shape, this.app.world.meshes.get(uri.replace(/#.*$/, '')), uri, (loaded) => add('geometry' in loaded ? trianglesOf(marker, material) : partOf(loaded.object, uri) ?? trianglesOf(marker, material)));
    else if (type === MARKER.triangles) add(trianglesOf(marker, material));
    else if (type === MARKER.mesh) {
      this.later(part, shape, this.app.world.meshes.get(uri), uri, (loaded) => {
        add('geometry' in loaded ? new THREE.Mesh(loaded.geometry, material) : loaded.object.clone());
        this.failed.push(...(loaded.problems ?? []));
      });
    } else add(new THREE.Mesh(new THREE.BoxGeometry(1, 1, 1), material));
  }

  private put3d(part: Part, made: THREE.Object3D): void {
    part.holder.add(made);
    this.app.world.stage.moved();
  }

  // Calls `then` with the loaded data if the part still has the same shape.
  private later<T>(part: Part, shape: string, coming: Promise<T>, uri: string, then: (loaded: T) => void): void {
    this.loading += 1;
    coming.then((loaded) => {
      if (part.shape === shape) then(loaded);
    }).catch((problem: Error) => this.failed.push({ uri, reason: problem.message })).finally(() => {
      this.loading -= 1;
      this.fit();
    });
  }

  private async paint(made: THREE.Object3D, look: { color: [number, number, number, number]; texture: string; physical: Message | undefined }, part: Part, shape: string): Promise<void> {
    this.loading += 1;
    const load = async (uri: unknown, colour: boolean): Promise<THREE.Texture | null> => {
      if (!uri) return null;
      try {
        return await this.app.world.meshes.texture(String(uri), colour);
      } catch (problem) {
        this.failed.push({ uri: String(uri), reason: (problem as Error).message });
        return null;
      }
    };
    const painted = await physicalOf(look, this.surroundings.reflection, load);
    this.loading -= 1;
    if (part.shape === shape) {
      made.traverse((one) => {
        if (one instanceof THREE.Mesh) one.material = painted;
      });
      this.app.world.stage.invalidate();
    }
    this.fit();
  }

  // -- dragging and placing

  // The next click on the ground selects the position; a second call cancels that.
  place(then: ((at: THREE.Vector3) => void) | null): void {
    this.placed = then;
    if (this.controls) {
      this.controls.enabled = then === null;
      this.controls.getHelper().visible = then === null;
      if (then !== null) this.controls.axis = null;
    }
    this.placingChanged.emit(then !== null);
  }

  get placing(): boolean {
    return this.placed !== null;
  }

  // True if the pointer is on the handle, or is dragging an object.
  get busy(): boolean {
    return this.controls !== null && this.selected !== null && (this.controls.dragging || this.controls.axis !== null);
  }

  // A click in the picture; true: it was for the objects. `nearest`: the distance of the robot under the pointer.
  click(event: { clientX: number; clientY: number }, nearest: number): boolean {
    const ray = this.picker.rayAt(event);
    if (this.placed) {
      const at = ray.intersectPlane(new THREE.Plane(new THREE.Vector3(0, 0, 1), -this.app.world.stage.ground.height), new THREE.Vector3());
      if (!at || at.length() > 100) return true;
      const then = this.placed;
      this.place(null);
      then(at);
      return true;
    }
    const found = new THREE.Raycaster(ray.origin, ray.direction).intersectObjects(this.root.children, true)[0];
    if (!found || found.distance > nearest) {
      this.select(null);
      return false;
    }
    let at: THREE.Object3D | null = found.object;
    while (at && at.userData['object'] === undefined) at = at.parent;
    if (!at) return false;
    this.app.select(null);
    this.select(String(at.userData['object']));
    return true;
  }

  select(name: string | null): void {
    if (name === this.selected) return;
    this.selected = name;
    const object = name === null ? undefined : this.objects.get(name);
    if (object && this.missing === '') void this.hold(object);
    else this.letGo();
    this.showOutline();
    this.selectedChanged.emit(name);
    this.app.world.stage.invalidate();
  }

  private async hold(object: WorldObject): Promise<void> {
    const { stage, camera } = this.app.world;
    if (!this.controls) {
      const { TransformControls } = await import('three/addons/controls/TransformControls.js');
      const controls = new TransformControls(stage.camera, stage.renderer.domElement);
      controls.setSize(0.6);
      controls.addEventListener('change', stage.invalidate);
      controls.addEventListener('dragging-changed', (event) => {
        camera.controls.enabled = !(event as unknown as { value: boolean }).value;
        if (camera.controls.enabled) this.send(true);
      });
      controls.addEventListener('objectChange', () => this.drag());
      stage.scene.add(controls.getHelper());
      this.controls = controls;
    }
    if (this.selected !== object.name) return;
    this.follow(object);
    this.controls.attach(this.proxy);
    stage.invalidate();
  }

  private letGo(): void {
    this.controls?.detach();
  }

  showMode(mode: 'translate' | 'rotate'): void {
    this.controls?.setMode(mode);
    this.app.world.stage.invalidate();
  }

  private follow(object: WorldObject): void {
    this.proxy.position.copy(object.holder.position);
    this.proxy.quaternion.copy(object.holder.quaternion);
  }

  private drag(): void {
    const object = this.objects.get(this.selected ?? '');
    if (!object) return;
    object.holder.position.copy(this.proxy.position);
    object.holder.quaternion.copy(this.proxy.quaternion);
    this.showOutline();
    this.app.world.stage.moved();
    this.send(false);
  }

  private send(now: boolean): void {
    const object = this.objects.get(this.selected ?? '');
    if (!object || (!now && performance.now() - this.sentAt < PERIOD)) return;
    this.sentAt = performance.now();
    void this.move(object.name, object.holder.position, object.holder.quaternion);
  }

  private showOutline(): void {
    const object = this.objects.get(this.selected ?? '');
    if (this.outline) this.app.world.stage.scene.remove(this.outline);
    this.outline = object ? new THREE.Box3Helper(boundsOf(object), 0x0b6bcb) : null;
    if (this.outline) this.app.world.stage.scene.add(this.outline);
  }

  // -- services

  private async ask(service: string, request: Message): Promise<boolean> {
    try {
      const answer = await this.app.twin.client.call(service, request);
      if (answer['success'] === true) return true;
      toast(String(answer['status_message'] || `${service} refused`), 'warning');
    } catch (problem) {
      toast((problem as Error).message, 'error');
    }
    return false;
  }

  // A marker's pose is that of the object's shape, which may differ from the object's frame.
  move(name: string, p: THREE.Vector3, q: THREE.Quaternion): Promise<boolean> {
    return this.ask(SET_STATE, { state: { name: `${name}::link::collision`, reference_frame: '', pose: poseMessage(p, q) } });
  }

  add(name: string, xml: string, p: THREE.Vector3, q = new THREE.Quaternion()): Promise<boolean> {
    return this.ask(SPAWN, { name, xml, initial_pose: poseMessage(p, q) });
  }

  remove(name: string): Promise<boolean> {
    return this.ask(DELETE, { name });
  }
}

// Parts of a mesh without a material in its file get that of the marker.
function dress(mesh: THREE.Mesh, material: THREE.Material): void {
  const bare = bareOf(mesh);
  if (Array.isArray(mesh.material)) mesh.material = mesh.material.map((one, i) => (bare[i] ? material : one));
  else if (bare[0]) mesh.material = material;
}

function trianglesOf(marker: Message, material: THREE.Material): THREE.Mesh {
  const points = marker['points'] as unknown as Vector[];
  const uv = marker['uv_coordinates'] as unknown as { u: number; v: number }[];
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.Float32BufferAttribute(points.flatMap((at) => [at.x, at.y, at.z]), 3));
  if (uv.length === points.length) geometry.setAttribute('uv', new THREE.Float32BufferAttribute(uv.flatMap((at) => [at.u, at.v]), 2));
  geometry.computeVertexNormals();
  return new THREE.Mesh(geometry, material);
}

// The box around all boxes but those that are far from all others, such as something that falls.
export function aroundMost(boxes: THREE.Box3[]): THREE.Box3 {
  const middle = (values: number[]): number => values.sort((a, b) => a - b)[Math.floor(values.length / 2)] ?? 0;
  const centres = boxes.map((box) => box.getCenter(new THREE.Vector3()));
  const centre = new THREE.Vector3(middle(centres.map((c) => c.x)), middle(centres.map((c) => c.y)), middle(centres.map((c) => c.z)));
  const reach = middle(centres.map((c) => c.distanceTo(centre))) + middle(boxes.map((box) => box.getSize(new THREE.Vector3()).length()));
  const out = new THREE.Box3();
  boxes.forEach((box, i) => {
    if (boxes.length < 3 || centres[i]!.distanceTo(centre) <= 10 * reach) out.union(box);
  });
  return out;
}

function boundsOf(object: WorldObject): THREE.Box3 {
  const out = new THREE.Box3();
  for (const part of object.parts.values()) out.expandByObject(part.holder);
  return out;
}

function poseMessage(p: THREE.Vector3, q: THREE.Quaternion): Message {
  return { position: { x: p.x, y: p.y, z: p.z }, orientation: { x: q.x, y: q.y, z: q.z, w: q.w } };
}
