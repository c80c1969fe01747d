// The path of the base: the true one, and that of its odometry, laid over it where both begin.
import * as THREE from 'three';
import type { App } from '../app/app';
import { settings, settingsChanged } from '../app/settings';
import { poseOf } from '../app/transforms';
import { compose, inversePose } from '../robot/tree';
import { cssColour, type Legend } from './legend';
import { Trace } from './trace';

const ODOMETRY = 'nav_msgs/msg/Odometry';
const TRUTH = '/ground_truth/odom';
const TRUE_PATH = 0xe69f00, ODOMETRIC_PATH = 0x0072b2;

export class BaseTrace {
  readonly truth = new Trace(TRUE_PATH);
  readonly odometry = new Trace(ODOMETRIC_PATH);
  private readonly group = new THREE.Group();
  private start: Float64Array | null = null; // the frame of the odometry in the world
  private followed: string | null = null; // the topic
  private end = (): void => {};

  constructor(private readonly app: App, private readonly legend: Legend) {
    this.group.add(this.truth.line, this.odometry.line);
    app.world.stage.scene.add(this.group);
    settingsChanged.on((key) => key === 'layers' && this.follow());
    app.twin.graphChanged.on(() => this.follow());
    app.twin.selectedRobot.on(() => this.follow());
    app.twin.robotChanged.on(() => this.clear());
    app.twin.rewound.on(() => this.clear());
    this.follow();
  }

  clear(): void {
    this.start = null;
    this.truth.clear();
    this.odometry.clear();
  }

  // The odometry of the selected robot.
  private topic(): string | null {
    const { client, space, robots } = this.app.twin;
    const others = robots.filter((one) => one !== space && one.startsWith(space)).map((one) => `${one}/`);
    for (const { topic, schemaName } of client.channels.values()) {
      if (schemaName !== ODOMETRY || topic.endsWith(TRUTH) || !topic.startsWith(`${space}/`)) continue;
      if (!others.some((one) => topic.startsWith(one))) return topic;
    }
    return null;
  }

  private follow(): void {
    const on = settings.layers['base'] ?? false;
    this.group.visible = on;
    const topic = on ? this.topic() : null;
    this.legend.show('truth', topic ? { key: 'line', colour: cssColour(TRUE_PATH), label: 'Base, true path', value: '' } : null);
    this.legend.show('odometry', topic ? { key: 'line', colour: cssColour(ODOMETRIC_PATH), label: 'Base, odometry', value: '' } : null);
    if (topic === this.followed) return;
    this.end();
    this.clear();
    this.followed = topic;
    this.end = topic ? this.app.twin.client.subscribe(topic, (m) => this.take(poseOf(m))) : (): void => {};
  }

  private take(odometry: Float64Array): void {
    const { truth } = this.app.twin;
    if (!truth) return;
    if (!this.start) {
      this.start = new Float64Array(7);
      compose(truth, 0, inversePose(odometry), 0, this.start, 0);
    }
    const shown = new Float64Array(7);
    compose(this.start, 0, odometry, 0, shown, 0);
    this.truth.add(truth[0]!, truth[1]!, truth[2]! + 0.002);
    this.odometry.add(shown[0]!, shown[1]!, shown[2]! + 0.004);
    this.app.world.stage.invalidate();
  }
}
