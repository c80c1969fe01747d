// The sensors of the twin (/doppel/sensors), with the topics of each by what they carry, and which of them are shown.
import type { Message } from '../protocol/cdr';
import { shortName } from '../protocol/schema';
import { set, settings } from './settings';
import { Signal } from './signal';
import type { Twin } from './twin';

export interface Sensor {
  name: string; // robot, link, sensor: "kate/laser/scan"
  type: string; // as described: "gpu_lidar"
  topics: string[];
  frame: string; // of its headers
  rate: number; // Hz that are asked for; 0: every step; NaN: unknown
  reached: number; // Hz of simulated time; 0: not read
  leftOut: number; // samples
  revision: string; // another one when an edit has changed a value of the sensor
  originFrame: string; // where the sensor is fixed
  origin: [number, number, number]; // m, x y z of the sensor in that frame
}

const LIST = '/doppel/sensors';

const pointOf = (raw: Message): [number, number, number] => [Number(raw['x']), Number(raw['y']), Number(raw['z'])];

export function readSensors(message: Message): Sensor[] {
  return (message['sensors'] as Message[]).map((raw) => ({
    name: String(raw['name']),
    type: String(raw['type']),
    topics: raw['topics'] as string[],
    frame: String(raw['frame']),
    rate: Number(raw['rate']),
    reached: Number(raw['reached']),
    leftOut: Number(raw['left_out']),
    revision: String(raw['revision']),
    originFrame: String(raw['origin_frame']),
    origin: pointOf(raw['origin'] as Message),
  }));
}

// The picture topics, of each family only the one that is smallest on the wire: not the raw one beside a compressed
// one, not the numbers of labels beside their colours.
export function pictureTopics(topics: string[], schemaOf: (topic: string) => string): string[] {
  return topics.filter((topic) => {
    const schema = schemaOf(topic);
    if (schema === 'sensor_msgs/CompressedImage') return true;
    if (schema !== 'sensor_msgs/Image') return false;
    const coloured = topic.replace(/labels_map$/, 'colored_map');
    return !topics.includes(`${topic}/compressed`) && (coloured === topic || !topics.includes(coloured));
  });
}

// The parts of names that distinguish topics of a sensor: "left" and "right" of "/stereo/left/image_raw/compressed".
export function shortTopics(topics: string[]): string[] {
  const parts = topics.map((topic) => topic.replace(/\/compressed$/, '').split('/'));
  const same = (at: (list: string[]) => string | undefined): boolean => parts.every((list) => list.length > 1 && at(list) === at(parts[0]!));
  while (parts.length > 1 && same((list) => list[0])) for (const list of parts) list.shift();
  while (parts.length > 1 && same((list) => list.at(-1))) for (const list of parts) list.pop();
  return parts.map((list) => list.join('/'));
}

// The types of messages that only sensors have.
const KINDS: Record<string, string> = {
  'sensor_msgs/Image': 'camera', 'sensor_msgs/CompressedImage': 'camera', 'sensor_msgs/CameraInfo': 'camera', 'sensor_msgs/LaserScan': 'lidar', 'sensor_msgs/PointCloud2': 'points',
  'sensor_msgs/Range': 'sonar', 'sensor_msgs/Imu': 'imu', 'geometry_msgs/WrenchStamped': 'force_torque', 'sensor_msgs/NavSatFix': 'navsat', 'sensor_msgs/MagneticField': 'magnetometer',
};

// The sensors of a recording without a list of them, by their topics; those of a camera are in one folder.
export function recordedSensors(channels: Iterable<{ topic: string; schemaName: string }>): Sensor[] {
  const found = new Map<string, Sensor>();
  for (const { topic, schemaName } of channels) {
    const type = KINDS[shortName(schemaName)];
    if (!type) continue;
    const whole = topic.replace(/\/compressed$/, '');
    const folder = type === 'camera' ? whole.slice(0, whole.lastIndexOf('/')) : '';
    const name = (folder || whole).slice(1);
    const known = found.get(name);
    if (known) known.topics.push(topic);
    else found.set(name, { name, type, topics: [topic], frame: '', rate: NaN, reached: 0, leftOut: 0, revision: '', originFrame: '', origin: [0, 0, 0] });
  }
  return [...found.values()];
}

export class Sensors {
  list: Sensor[] = [];
  readonly changed = new Signal(); // other sensors, values or topics, or another choice of what is shown
  readonly reported = new Signal(); // rates
  private known = '';

  constructor(private readonly twin: Twin) {
    twin.client.subscribe(LIST, (m) => this.take(readSensors(m)));
    twin.graphChanged.on(() => {
      if (!twin.client.channel(LIST)) this.take(twin.recording ? recordedSensors(twin.client.channels.values()) : []);
      else this.compare(); // topics may be advertised after the list
    });
  }

  // "sensor_msgs/LaserScan"; "": the topic is not advertised.
  schema = (topic: string): string => shortName(this.twin.client.channel(topic)?.schemaName ?? '');

  topicsOf(sensor: Sensor, ...schemas: string[]): string[] {
    return sensor.topics.filter((topic) => schemas.includes(this.schema(topic)));
  }

  shown(sensor: Sensor): boolean {
    return !settings.hiddenSensors.includes(sensor.name);
  }

  show(sensor: Sensor, on: boolean): void {
    const others = settings.hiddenSensors.filter((name) => name !== sensor.name);
    set('hiddenSensors', on ? others : [...others, sensor.name]);
    this.changed.emit();
  }

  private take(list: Sensor[]): void {
    this.list = list;
    this.compare();
    this.reported.emit();
  }

  private compare(): void {
    const now = this.list.map((one) => [one.name, one.type, one.rate, one.frame, one.revision, ...one.topics.map((topic) => topic + this.schema(topic))].join(' ')).join('\n');
    if (now === this.known) return;
    this.known = now;
    this.changed.emit();
  }
}
