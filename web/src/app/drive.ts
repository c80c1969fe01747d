// Driving a mobile base: velocities to its controller while a pad, a key or a gamepad's dead-man button is held, zero on
// release.
import type { App } from './app';
import { duration } from './commander';
import { Signal } from './signal';

const PERIOD = 50; // ms between commands
const STOPS = 3; // zeros at release: one of them could be lost
const STAMPED = 'geometry_msgs/msg/TwistStamped';
const PLAIN = 'geometry_msgs/msg/Twist';
const BASES = /diff_drive|mecanum|omni_wheel|steering|tricycle/;

export interface BaseTopic {
  name: string;
  stamped: boolean;
}

export class Drive {
  readonly changed = new Signal();
  speed = 0.5; // m/s at the edge of the pad
  turn = 1; // rad/s
  // Shares of both, -1 to 1: ahead, to the left, turn to the left.
  private wanted: readonly [number, number, number] = [0, 0, 0];
  private held = false;
  private to: BaseTopic | null = null; // of the robot that is driven: the stop goes to it, too
  private stopsLeft = 0;
  private timer: ReturnType<typeof setInterval> | null = null;

  constructor(private readonly app: App) {
    addEventListener('blur', () => this.release());
    document.addEventListener('visibilitychange', () => this.release());
    app.commander.stopChanged.on(() => this.release());
    app.twin.selectedRobot.on(() => this.release());
  }

  // True if the robot has a base to drive, also while its controller is not active.
  get applies(): boolean {
    return this.app.twin.controllers.some((c) => BASES.test(c.type)) || this.topic() !== null;
  }

  // The topic that the robot's base reads; null: there is none.
  topic(): BaseTopic | null {
    const { client, controllers, recording } = this.app.twin;
    if (recording) return null;
    const names = controllers.filter((c) => c.state === 'active' && BASES.test(c.type)).flatMap((c) => [`/${c.name}/cmd_vel`, `/${c.name}/reference`]);
    for (const name of [...names, '/cmd_vel'].map((one) => this.app.twin.own(one))) {
      const type = client.channel(name)?.schemaName;
      if (type === STAMPED || type === PLAIN) return { name, stamped: type === STAMPED };
    }
    return null;
  }

  get velocity(): { x: number; y: number; yaw: number } {
    const [x, y, yaw] = this.held ? this.wanted : [0, 0, 0];
    return { x: x * this.speed, y: y * this.speed, yaw: yaw * this.turn };
  }

  get live(): boolean {
    return this.held;
  }

  hold(ahead: number, left: number, turn: number): void {
    if (this.app.commander.stopped) return;
    this.wanted = [ahead, left, turn];
    this.to = this.topic();
    this.held = true;
    this.stopsLeft = STOPS;
    this.timer ??= setInterval(() => this.tick(), PERIOD);
    this.changed.emit();
  }

  release(): void {
    if (!this.held) return;
    this.held = false;
    this.tick();
    this.changed.emit();
  }

  private tick(): void {
    this.send();
    if (this.held) return;
    this.stopsLeft -= 1;
    if (this.stopsLeft > 0 || this.timer === null) return;
    clearInterval(this.timer);
    this.timer = null;
  }

  private send(): void {
    const { twin } = this.app;
    const topic = this.to;
    if (!topic || twin.client.phase !== 'open') return;
    const { x, y, yaw } = this.velocity;
    const twist = { linear: { x, y, z: 0 }, angular: { x: 0, y: 0, z: yaw } };
    const stamp = duration(twin.client.channel('/clock') ? twin.simTime : Date.now() / 1000);
    twin.client.publish(topic.name, topic.stamped ? STAMPED : PLAIN, topic.stamped ? { header: { stamp, frame_id: '' }, twist } : twist);
  }
}
