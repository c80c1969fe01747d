// The views of cameras as frusta, from their camera_info.
import * as THREE from 'three';
import type { App } from '../app/app';
import type { Sensors } from '../app/sensors';
import { settings, settingsChanged } from '../app/settings';
import { Subscriptions, type Wanted } from '../app/subscriptions';
import type { Message } from '../protocol/cdr';
import type { FramePoses } from './frame_poses';

const COLOUR = 0x0072b2;
const STEPS = 12; // of an edge of the picture
const LENGTH = 0.3; // of the size of the robot

export interface Lens {
  width: number;
  height: number;
  fx: number;
  fy: number;
  cx: number;
  cy: number;
  fisheye: boolean;
}

export function lensOf(info: Message): Lens | null {
  const k = info['k'] as ArrayLike<number> | undefined;
  const lens = {
    width: Number(info['width']), height: Number(info['height']), fx: k?.[0] ?? 0, fy: k?.[4] ?? 0, cx: k?.[2] ?? 0, cy: k?.[5] ?? 0,
    fisheye: /equidistant|fisheye/.test(String(info['distortion_model'])),
  };
  return lens.width > 0 && lens.height > 0 && lens.fx > 0 && lens.fy > 0 ? lens : null;
}

// The direction that a pixel sees in the optical frame (x right, y down, z forward), without distortion: in the plane
// z = 1 of a pinhole, of unit length with a fisheye lens.
export function rayOf({ fx, fy, cx, cy, fisheye }: Lens, u: number, v: number): [number, number, number] {
  const x = (u - cx) / fx, y = (v - cy) / fy;
  if (!fisheye) return [x, y, 1];
  const angle = Math.hypot(x, y);
  const s = angle > 1e-9 ? Math.sin(angle) / angle : 1;
  return [x * s, y * s, Math.cos(angle)];
}

// Pairs of points: the border of the picture, the edges from the centre, and a mark at the upper edge. The outer edges
// of pixels are half a pixel beyond their centres.
export function frustumLines(lens: Lens): number[] {
  const [left, top, right, bottom] = [-0.5, -0.5, lens.width - 0.5, lens.height - 0.5];
  const corners: [number, number][] = [[left, top], [right, top], [right, bottom], [left, bottom]];
  const points: number[] = [];
  corners.forEach(([u, v], i) => {
    points.push(0, 0, 0, ...rayOf(lens, u, v));
    const [u1, v1] = corners[(i + 1) % 4]!;
    for (let k = 0; k < STEPS; k += 1) {
      for (const share of [k / STEPS, (k + 1) / STEPS]) points.push(...rayOf(lens, u + (u1 - u) * share, v + (v1 - v) * share));
    }
  });
  const middle = (left + right) / 2, side = lens.width * 0.12, up = top - lens.height * 0.14;
  for (const [u0, v0, u1, v1] of [[middle - side, top, middle, up], [middle, up, middle + side, top]] as const) points.push(...rayOf(lens, u0, v0), ...rayOf(lens, u1, v1));
  return points;
}

export class CameraViews {
  readonly frusta = new Map<string, { lines: THREE.LineSegments; frame: string; revision: string }>(); // by topic of the camera_info
  private readonly material = new THREE.LineBasicMaterial({ color: COLOUR, transparent: true, opacity: 0.85 });
  private readonly subscriptions: Subscriptions;

  constructor(private readonly app: App, private readonly sensors: Sensors, private readonly frames: FramePoses) {
    this.subscriptions = new Subscriptions(app.twin.client);
    settingsChanged.on((key) => key === 'layers' && this.follow());
    sensors.changed.on(() => this.follow());
    app.world.stage.frame.on(() => this.place());
    this.follow();
  }

  private drop(topic: string): void {
    const { lines } = this.frusta.get(topic)!;
    lines.removeFromParent();
    lines.geometry.dispose();
    this.frusta.delete(topic);
  }

  // A camera_info is read once, until an edit changes the sensor: a standing subscription would count as a reader.
  private follow(): void {
    const shown = new Map<string, string>(); // revisions by topic
    if (settings.layers['cameras'] ?? false) {
      for (const sensor of this.sensors.list) {
        if (this.sensors.shown(sensor)) for (const topic of this.sensors.topicsOf(sensor, 'sensor_msgs/CameraInfo')) shown.set(topic, sensor.revision);
      }
    }
    for (const [topic, { revision }] of [...this.frusta]) if (shown.get(topic) !== revision) this.drop(topic);
    const wanted = new Map<string, Wanted>();
    for (const [topic, revision] of shown) {
      if (!this.frusta.has(topic)) wanted.set(`${revision} ${topic}`, { topic, handler: (m) => this.take(topic, revision, m), fresh: true });
    }
    this.subscriptions.want(wanted);
    this.app.world.stage.invalidate();
  }

  private take(topic: string, revision: string, info: Message): void {
    if (!this.frusta.has(topic)) {
      const lens = lensOf(info);
      const geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.Float32BufferAttribute(lens ? frustumLines(lens) : [], 3));
      const lines = new THREE.LineSegments(geometry, this.material);
      lines.frustumCulled = false;
      lines.visible = false;
      this.frusta.set(topic, { lines, frame: (info['header'] as { frame_id: string }).frame_id, revision });
      this.app.world.stage.scene.add(lines);
    }
    queueMicrotask(() => this.follow());
  }

  private place(): void {
    for (const [topic, { lines, frame }] of this.frusta) {
      const pose = this.frames.pose(frame, topic);
      lines.visible = pose !== null;
      if (!pose) continue;
      lines.position.set(pose[0]!, pose[1]!, pose[2]!);
      lines.quaternion.set(pose[3]!, pose[4]!, pose[5]!, pose[6]!);
      lines.scale.setScalar(this.app.world.size * LENGTH);
    }
  }
}
