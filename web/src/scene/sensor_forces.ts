// Arrows of the forces that contact and force-torque sensors measure: of contacts where they touch, of wrenches where
// the sensor is, about which their torque is.
import * as THREE from 'three';
import type { App } from '../app/app';
import { SteadyScale } from '../app/colour_map';
import type { Sensor, Sensors } from '../app/sensors';
import { settings, settingsChanged } from '../app/settings';
import { Subscriptions, type Wanted } from '../app/subscriptions';
import { readTouches } from '../app/touches';
import type { Message } from '../protocol/cdr';
import { vector } from './contacts';
import { ForceArrows } from './force_arrows';
import type { FramePoses } from './frame_poses';
import { cssColour, endText, type Legend, type LegendEntry } from './legend';

const MOST = 64; // arrows of each kind
const LENGTH = 0.35; // of the size of the robot, of the longest arrow
const BALL = 0.008;
const FORCE = 0xd55e00, TORQUE = 0x9467bd;
const WRENCH = 'geometry_msgs/WrenchStamped', CONTACTS = 'ros_gz_interfaces/Contacts', BUMPER = 'gazebo_msgs/ContactsState';

interface Arrow {
  at: THREE.Vector3; // in the frame
  value: THREE.Vector3;
}

// One kind of arrow with its own scale.
class Kind {
  readonly arrows: ForceArrows;
  readonly scale = new SteadyScale();

  constructor(readonly layer: 'touches' | 'wrenches', readonly name: string, readonly label: string, readonly unit: string, private readonly colour: number) {
    this.arrows = new ForceArrows(colour, MOST);
  }

  legend(): LegendEntry {
    return { key: 'arrow', colour: cssColour(this.colour), label: this.label, value: endText(this.scale.most, this.unit) };
  }
}

export class SensorForces {
  readonly kinds = {
    touch: new Kind('touches', 'touch', 'Contact force, longest arrow', 'N', FORCE),
    force: new Kind('wrenches', 'force', 'Force, longest arrow', 'N', FORCE),
    torque: new Kind('wrenches', 'torque', 'Torque, longest arrow', 'N m', TORQUE),
  };
  private readonly last = new Map<string, { topic: string; message: Message }>(); // by sensor
  private readonly subscriptions: Subscriptions;
  private fresh = false;

  constructor(private readonly app: App, private readonly sensors: Sensors, private readonly frames: FramePoses, private readonly legend: Legend) {
    this.subscriptions = new Subscriptions(app.twin.client);
    for (const { arrows } of Object.values(this.kinds)) app.world.stage.scene.add(arrows.root);
    settingsChanged.on((key) => key === 'layers' && this.follow());
    sensors.changed.on(() => this.follow());
    app.twin.phaseChanged.on((phase) => {
      if (phase !== 'lost') return;
      this.last.clear();
      this.fresh = true;
    });
    app.world.stage.tick.on(() => this.fresh && this.draw());
    this.follow();
  }

  has(sensor: Sensor, layer: 'touches' | 'wrenches'): boolean {
    return this.topicOf(sensor, layer) !== undefined;
  }

  private topicOf(sensor: Sensor, layer: 'touches' | 'wrenches'): string | undefined {
    return this.sensors.topicsOf(sensor, ...(layer === 'touches' ? [CONTACTS, BUMPER] : [WRENCH]))[0];
  }

  private follow(): void {
    const wanted = new Map<string, Wanted>();
    const layers = new Set<string>();
    for (const layer of ['touches', 'wrenches'] as const) {
      if (!(settings.layers[layer] ?? false)) continue;
      for (const sensor of this.sensors.list) {
        const topic = this.sensors.shown(sensor) ? this.topicOf(sensor, layer) : undefined;
        if (!topic) continue;
        layers.add(layer);
        wanted.set(sensor.name, { topic, handler: (message) => {
          this.last.set(sensor.name, { topic, message });
          this.fresh = true;
        } });
      }
    }
    for (const name of [...this.last.keys()]) if (!wanted.has(name)) this.last.delete(name);
    this.subscriptions.want(wanted);
    for (const kind of Object.values(this.kinds)) this.legend.show(kind.name, layers.has(kind.layer) ? kind.legend() : null);
    this.fresh = true;
  }

  // Once a frame at most, whatever the rates of the sensors.
  private draw(): void {
    this.fresh = false;
    const { touch, force, torque } = this.kinds;
    const found = { touch: [] as Arrow[], force: [] as Arrow[], torque: [] as Arrow[] };
    for (const [name, { topic, message }] of this.last) {
      const pose = this.frames.pose((message['header'] as { frame_id: string }).frame_id, topic);
      if (!pose) continue;
      const turn = new THREE.Quaternion(pose[3], pose[4], pose[5], pose[6]);
      const origin = new THREE.Vector3(pose[0], pose[1], pose[2]);
      const put = (into: Arrow[], at: THREE.Vector3, value: THREE.Vector3): number => into.push({ at, value: value.applyQuaternion(turn) });
      const wrench = message['wrench'] as Message | undefined;
      if (wrench) {
        const at = this.originOf(name, topic);
        if (!at) continue;
        put(found.force, at, vector(wrench['force']));
        put(found.torque, at.clone(), vector(wrench['torque']));
      } else {
        for (const { points, forces } of readTouches(message)) {
          points.forEach((at, i) => put(found.touch, vector(at).applyQuaternion(turn).add(origin), vector(forces[i])));
        }
      }
    }
    this.drawKind(touch, found.touch);
    this.drawKind(force, found.force);
    this.drawKind(torque, found.torque);
    this.app.world.stage.invalidate();
  }

  // The position of the sensor: the frame of its header may be that of another link.
  private originOf(name: string, topic: string): THREE.Vector3 | null {
    const sensor = this.sensors.list.find((one) => one.name === name);
    const pose = sensor ? this.frames.pose(sensor.originFrame, topic) : null;
    if (!sensor || !pose) return null;
    const [x, y, z] = sensor.origin;
    return new THREE.Vector3(x, y, z).applyQuaternion(new THREE.Quaternion(pose[3], pose[4], pose[5], pose[6])).add(new THREE.Vector3(pose[0], pose[1], pose[2]));
  }

  private drawKind(kind: Kind, arrows: Arrow[]): void {
    const { size } = this.app.world;
    const strongest = arrows.reduce((most, { value }) => Math.max(most, value.length()), 0);
    const most = arrows.length > 0 ? kind.scale.take(strongest) : kind.scale.most;
    kind.arrows.begin();
    for (const { at, value } of arrows) kind.arrows.add(at, value, most > 0 ? (value.length() / most) * size * LENGTH : 0, size * BALL);
    kind.arrows.end();
    if (arrows.length > 0) this.legend.show(kind.name, kind.legend());
  }
}
