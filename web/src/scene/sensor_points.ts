// Points that lidars or depth cameras measure, in colours of their range or intensity. Each set stays in the world where
// its frame was at its stamp.
import * as THREE from 'three';
import type { App } from '../app/app';
import { COLOUR_MAP, colourStep, COLOURS, SteadyScale } from '../app/colour_map';
import { PointBuffer } from '../app/points';
import type { Sensor, Sensors } from '../app/sensors';
import { settings, settingsChanged } from '../app/settings';
import { Subscriptions, type Wanted } from '../app/subscriptions';
import { stampOf } from '../app/twin';
import type { Message } from '../protocol/cdr';
import type { FramePoses } from './frame_poses';
import { endText, type Legend, type LegendEntry } from './legend';

const CLOUD = 'sensor_msgs/PointCloud2', SCAN = 'sensor_msgs/LaserScan', INFO = 'sensor_msgs/CameraInfo';
const PIXELS = 3; // of a point
const NEARER = 0.995; // of the distance from the camera
const LONGEST_WAIT = 150; // ms for the robot's state at the stamp of points

// three.js takes colours of vertices as linear.
const LINEAR = Uint8Array.from({ length: COLOURS * 3 }, (_, i) => Math.round(new THREE.Color().setRGB(COLOUR_MAP[i]! / 255, 0, 0, THREE.SRGBColorSpace).r * 255));

// Points lie on the surfaces that were measured, and would be half hidden in them; so they are drawn a little nearer.
function pointMaterial(): THREE.PointsMaterial {
  const material = new THREE.PointsMaterial({ size: PIXELS, sizeAttenuation: false, vertexColors: true, toneMapped: false });
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader.replace('#include <project_vertex>', `#include <project_vertex>
      gl_Position = projectionMatrix * vec4(mvPosition.xyz * ${NEARER}, 1.0);`);
  };
  return material;
}

class PointSet {
  readonly buffer = new PointBuffer();
  readonly points: THREE.Points;
  waiting: Message | null = null; // for the pose at its stamp
  ready: { message: Message; pose: Float64Array } | null = null; // to be decoded
  waitingSince = 0; // ms
  topic = ''; // of the one that waits
  private positions = new THREE.BufferAttribute(new Float32Array(0), 3);
  private colours = new THREE.BufferAttribute(new Uint8Array(0), 3, true);

  constructor(material: THREE.Material) {
    this.points = new THREE.Points(new THREE.BufferGeometry(), material);
    this.points.frustumCulled = false;
    this.points.matrixAutoUpdate = false;
    this.points.visible = false;
  }

  // Decodes the message that is ready. Returns why it cannot be, or ''.
  decode(): string {
    const { message, pose } = this.ready!;
    this.ready = null;
    const problem = message['fields'] === undefined ? this.buffer.readScan(message) : this.buffer.readCloud(message);
    this.points.matrix.compose(new THREE.Vector3(pose[0], pose[1], pose[2]), new THREE.Quaternion(pose[3], pose[4], pose[5], pose[6]), new THREE.Vector3(1, 1, 1));
    this.points.matrixWorldNeedsUpdate = true;
    return problem;
  }

  upload(byIntensity: boolean, most: number): void {
    const { buffer, points } = this;
    const { geometry } = points;
    if (this.positions.array !== buffer.positions) {
      geometry.dispose(); // the graphics card's memory of the smaller ones
      this.positions = new THREE.BufferAttribute(buffer.positions, 3);
      this.colours = new THREE.BufferAttribute(new Uint8Array(buffer.positions.length), 3, true);
      for (const attribute of [this.positions, this.colours]) attribute.setUsage(THREE.DynamicDrawUsage);
      geometry.setAttribute('position', this.positions);
      geometry.setAttribute('color', this.colours);
    }
    const values = byIntensity ? buffer.intensities : buffer.ranges;
    const colours = this.colours.array;
    for (let i = 0; i < buffer.count; i += 1) {
      const o = colourStep(values[i]!, most) * 3;
      colours[3 * i] = LINEAR[o]!;
      colours[3 * i + 1] = LINEAR[o + 1]!;
      colours[3 * i + 2] = LINEAR[o + 2]!;
    }
    for (const attribute of [this.positions, this.colours]) {
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, buffer.count * 3);
      attribute.needsUpdate = true;
    }
    geometry.setDrawRange(0, buffer.count);
    points.visible = buffer.count > 0;
  }

  end(): void {
    this.points.removeFromParent();
    this.points.geometry.dispose();
  }
}

// One layer: the points of lidars, or those of depth cameras.
export class SensorPoints {
  readonly sets = new Map<string, PointSet>(); // by sensor
  private readonly scales = { range: new SteadyScale(), intensity: new SteadyScale() };
  private readonly material = pointMaterial();
  private readonly subscriptions: Subscriptions;
  private readonly flat = new Set<string>(); // lidars of a single ring: their scan is smaller than their points
  private readonly pixels: number;
  private problem = ''; // why the last message cannot be read

  constructor(private readonly app: App, private readonly sensors: Sensors, private readonly frames: FramePoses, private readonly legend: Legend,
    private readonly layer: 'lidar' | 'clouds') {
    this.subscriptions = new Subscriptions(app.twin.client);
    this.pixels = app.world.stage.software ? PIXELS - 1 : PIXELS;
    settingsChanged.on((key) => {
      if (key === 'layers') this.follow();
      if (key === 'pointColour') this.recolour();
    });
    sensors.changed.on(() => this.follow());
    app.twin.robotChanged.on(() => this.flat.clear());
    app.twin.phaseChanged.on((phase) => phase === 'lost' && this.clear());
    frames.recorded.on(() => {
      for (const set of this.sets.values()) this.locate(set);
    });
    app.world.stage.tick.on(() => this.draw());
    this.follow();
  }

  // True if the sensor's points are of this layer: those of cameras have a CameraInfo.
  has(sensor: Sensor): boolean {
    const ofCamera = this.sensors.topicsOf(sensor, INFO).length > 0;
    return ofCamera === (this.layer === 'clouds') && this.sensors.topicsOf(sensor, CLOUD, SCAN).length > 0;
  }

  private topicOf(sensor: Sensor): string {
    const clouds = this.sensors.topicsOf(sensor, CLOUD), scans = this.sensors.topicsOf(sensor, SCAN);
    return (this.flat.has(sensor.name) ? scans[0] : undefined) ?? clouds[0] ?? scans[0]!;
  }

  private follow(): void {
    const on = settings.layers[this.layer] ?? false;
    const wanted = new Map<string, Wanted>();
    for (const sensor of on ? this.sensors.list : []) {
      if (!this.sensors.shown(sensor) || !this.has(sensor)) continue;
      const topic = this.topicOf(sensor);
      wanted.set(sensor.name, { topic, handler: (message) => this.take(sensor, topic, message) });
    }
    for (const [name, set] of this.sets) {
      if (wanted.has(name)) continue;
      set.end();
      this.sets.delete(name);
    }
    this.subscriptions.want(wanted);
    this.legend.show(this.layer, wanted.size > 0 ? this.describe() : null);
    this.app.world.stage.invalidate();
  }

  private clear(): void {
    for (const set of this.sets.values()) {
      set.waiting = set.ready = null;
      set.points.visible = false;
    }
    this.app.world.stage.invalidate();
  }

  private take(sensor: Sensor, topic: string, message: Message): void {
    let set = this.sets.get(sensor.name);
    if (!set) {
      set = new PointSet(this.material);
      this.sets.set(sensor.name, set);
      this.app.world.stage.scene.add(set.points);
    }
    if (!set.waiting) set.waitingSince = performance.now();
    set.waiting = message;
    set.topic = topic;
    this.locate(set);
    if (message['fields'] === undefined || Number(message['height']) > 1 || this.sensors.topicsOf(sensor, SCAN).length === 0) return;
    if (this.layer === 'clouds') return;
    this.flat.add(sensor.name);
    queueMicrotask(() => this.follow());
  }

  // The message that waits is ready once its pose is known, or with the last pose if that takes too long.
  private locate(set: PointSet): void {
    const message = set.waiting;
    if (!message) return;
    const { frame_id: frame, stamp } = message['header'] as { frame_id: string; stamp: Message };
    let pose = this.frames.poseAt(frame, set.topic, stampOf(stamp));
    if (pose === 'later') {
      if (performance.now() - set.waitingSince < LONGEST_WAIT) return;
      pose = this.frames.pose(frame, set.topic);
    }
    set.waiting = null;
    if (pose) set.ready = { message, pose };
    else {
      this.problem = `frame '${frame}' is not in TF`;
      this.legend.show(this.layer, this.describe());
    }
  }

  private get byIntensity(): boolean {
    return settings.pointColour === 'intensity' && [...this.sets.values()].some((set) => set.buffer.hasIntensity);
  }

  // Once a frame at most, whatever the rates of the sensors.
  private draw(): void {
    let any = false;
    for (const set of this.sets.values()) {
      this.locate(set);
      if (!set.ready) continue;
      this.problem = set.decode();
      any = true;
    }
    if (any) this.recolour();
  }

  private recolour(): void {
    const { byIntensity } = this;
    const sets = [...this.sets.values()];
    if (sets.length === 0) return;
    const most = this.scales[byIntensity ? 'intensity' : 'range'].take(Math.max(...sets.map(({ buffer }) => (byIntensity ? buffer.brightest : buffer.farthest))));
    this.material.size = this.pixels * this.app.world.stage.renderer.getPixelRatio();
    for (const set of sets) set.upload(byIntensity, most);
    this.legend.show(this.layer, this.describe());
    this.app.world.stage.invalidate();
  }

  private describe(): LegendEntry {
    const of = this.layer === 'lidar' ? 'Lidar' : 'Depth';
    const by = this.byIntensity ? 'intensity' : 'range';
    const { most } = this.scales[by];
    const end = endText(most, by === 'range' ? 'm' : '');
    return { key: 'colours', label: `${of}, ${by}`, value: this.problem || (most > 0 ? `0 … ${end}` : most === 0 ? 'no points' : end) };
  }
}
