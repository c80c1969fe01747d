// The two-point calibration of the selected robot's joints: /doppel/calibration and its services, and what a person does
// with the devices meanwhile (/doppel/hardware/release, hold, guide).
import type { Message } from '../protocol/cdr';
import { Signal } from './signal';
import type { Twin } from './twin';

export interface Measurement {
  model: number; // rad or m
  machine: number;
}

export interface JointCalibration {
  joint: string;
  poses: number[]; // suggested, of the model; none: its range is too small
  measurements: Measurement[];
  fitted: boolean;
  direction: number;
  zero: number;
  scale: number;
  residual: number;
  corrections: string[];
  warnings: string[];
  problem: string; // why the measurements give no result
  written: boolean;
}

const MEASURE_TIME = 10_000; // ms
const WRITE_TIME = 60_000; // ms: the description is expanded

function readJoint(m: Message): JointCalibration {
  return {
    joint: String(m['joint']),
    poses: [...(m['poses'] as ArrayLike<number> & Iterable<number>)],
    measurements: (m['measurements'] as Message[]).map((one) => ({ model: Number(one['model']), machine: Number(one['machine']) })),
    fitted: m['fitted'] === true,
    direction: Number(m['direction']),
    zero: Number(m['zero']),
    scale: Number(m['scale']),
    residual: Number(m['residual']),
    corrections: m['corrections'] as string[],
    warnings: m['warnings'] as string[],
    problem: String(m['problem']),
    written: m['written'] === true,
  };
}

export class Calibration {
  readonly changed = new Signal();
  joints: JointCalibration[] = []; // of the selected robot
  measuring = ''; // the joint that is being measured
  file = ''; // the overlay that was written last
  undoJoints: string[] = [];
  problem = ''; // why the last request was refused
  private last: Message | null = null;
  private asking = 0;

  constructor(private readonly twin: Twin) {
    twin.client.subscribe('/doppel/calibration', (m) => {
      this.last = m;
      this.take();
    });
    twin.selectedRobot.on(() => {
      this.problem = '';
      this.take();
    });
  }

  get offered(): boolean {
    return this.joints.length > 0 && this.twin.client.services.has('/doppel/calibrate/measure');
  }

  // A request is on its way.
  get busy(): boolean {
    return this.asking > 0;
  }

  // There is a hand at emulated devices.
  get guided(): boolean {
    return this.twin.client.services.has(this.twin.own('/doppel/hardware/guide'));
  }

  measure(joint: string, model: number): Promise<boolean> {
    return this.call('/doppel/calibrate/measure', { robot: this.robot, joint, model }, MEASURE_TIME);
  }

  forget(joint: string): Promise<boolean> {
    return this.call('/doppel/calibrate/forget', { robot: this.robot, joint });
  }

  write(joints: string[]): Promise<boolean> {
    return this.call('/doppel/calibrate/write', { robot: this.robot, joints }, WRITE_TIME);
  }

  undo(): Promise<boolean> {
    return this.call('/doppel/calibrate/undo', {}, WRITE_TIME);
  }

  release(): Promise<boolean> {
    return this.call(this.twin.own('/doppel/hardware/release'), {});
  }

  hold(): Promise<boolean> {
    return this.call(this.twin.own('/doppel/hardware/hold'), {});
  }

  // Positions of a hand follow each other too fast to be reported.
  async guide(joint: string, position: number): Promise<void> {
    try {
      await this.twin.client.call(this.twin.own('/doppel/hardware/guide'), { joint, position });
    } catch (problem) {
      this.problem = (problem as Error).message;
      this.changed.emit();
    }
  }

  private get robot(): string {
    return this.twin.space.replace(/^\//, '');
  }

  private take(): void {
    const all = (this.last?.['joints'] ?? []) as Message[];
    this.joints = all.filter((one) => String(one['robot']) === this.robot).map(readJoint);
    this.measuring = String(this.last?.['measuring'] ?? '');
    this.file = String(this.last?.['file'] ?? '');
    this.undoJoints = (this.last?.['undo_joints'] ?? []) as string[];
    this.changed.emit();
  }

  private async call(service: string, request: Message, time?: number): Promise<boolean> {
    this.asking += 1;
    this.problem = '';
    this.changed.emit();
    try {
      const answer = await this.twin.client.call(service, request, time);
      if (answer['success'] !== true) this.problem = String(answer['message']);
    } catch (problem) {
      this.problem = (problem as Error).message;
    }
    this.asking -= 1;
    this.changed.emit();
    return this.problem === '';
  }
}
