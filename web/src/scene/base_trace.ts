// The path of the base: the true one, and that of its odometry, laid over it where both begin.
import * as THREE from 'three';
import type { App } from '../app/app';
import { settings, settingsChanged } from '../app/settings';
import { poseOf } from '../app/transforms';
import { compose } from '../robot/tree';
import { Trace } from './trace';

const ODOMETRY = 'nav_msgs/msg/Odometry';
const TRUTH = '/ground_truth/odom';

function inverse(pose: Float64Array): Float64Array {
  const turned = new Float64Array(7);
  compose([0, 0, 0, -pose[3]!, -pose[4]!, -pose[5]!, pose[6]!], 0, [-pose[0]!, -pose[1]!, -pose[2]!, 0, 0, 0, 1], 0, turned, 0);
  return turned;
}

export class BaseTrace {
  readonly truth = new Trace(0xe69f00);
  readonly odometry = new Trace(0x0072b2);
  private readonly group = new THREE.Group();
  private start: Float64Array | null = null; // the frame of the odometry in the world
  private end: (() => void) | null = null;

  constructor(private readonly app: App) {
    this.group.add(this.truth.line, this.odometry.line);
    app.world.stage.scene.add(this.group);
    settingsChanged.on((key) => key === 'layers' && this.follow());
    app.twin.graphChanged.on(() => this.follow());
    app.twin.robotChanged.on(() => this.clear());
    this.follow();
  }

  clear(): void {
    this.start = null;
    this.truth.clear();
    this.odometry.clear();
  }

  private topic(): string | null {
    for (const channel of this.app.twin.client.channels.values()) {
      if (channel.schemaName === ODOMETRY && !channel.topic.endsWith(TRUTH)) return channel.topic;
    }
    return null;
  }

  private follow(): void {
    const on = settings.layers['base'] ?? false;
    this.group.visible = on;
    const topic = this.topic();
    if (on === (this.end !== null) || (on && !topic)) return;
    this.end?.();
    this.end = null;
    this.clear();
    if (on && topic) this.end = this.app.twin.client.subscribe(topic, (m) => this.take(poseOf(m)));
  }

  private take(odometry: Float64Array): void {
    const { truth } = this.app.twin;
    if (!truth) return;
    if (!this.start) {
      this.start = new Float64Array(7);
      compose(truth, 0, inverse(odometry), 0, this.start, 0);
    }
    const shown = new Float64Array(7);
    compose(this.start, 0, odometry, 0, shown, 0);
    this.truth.add(truth[0]!, truth[1]!, truth[2]! + 0.002);
    this.odometry.add(shown[0]!, shown[1]!, shown[2]! + 0.004);
    this.app.world.stage.invalidate();
  }
}
