// The devices of the selected robot (/doppel/hardware), and how far its joints are from the twin (/doppel/mirror).
import type { Message } from '../protocol/cdr';
import { Signal } from './signal';
import type { Twin } from './twin';

export interface DeviceJoint {
  name: string;
  id: number;
  position: number;
  goal: number;
  load: number;
  current: number;
  voltage: number;
  temperature: number;
  age: number;
  believed: boolean;
  faults: string;
}

export interface Device {
  name: string;
  plugin: string;
  component_state: string;
  state: string;
  port: string;
  fault: string;
  cycles: bigint;
  lost: bigint;
  damaged: bigint;
  joints: DeviceJoint[];
}

export interface MirrorJoint {
  name: string;
  measured: number;
  twin: number;
  believed: boolean;
  error: number;
  rms: number;
  delay: number;
  load: number;
  model_load: number;
  note: string;
  alarm: string;
}

export interface Mirror {
  mode: string;
  joints: MirrorJoint[];
}

const LATE = 2000; // ms without a message: the mirror has ended

export class Devices {
  readonly changed = new Signal();
  readonly mirrored = new Signal();
  all: Device[] = [];
  mirror: Mirror | null = null;
  private readonly watchers = new Set<string>();
  private heard = 0;
  private endDevices: (() => void) | null = null;

  constructor(private readonly twin: Twin) {
    twin.follow('/doppel/mirror', (message) => this.takeMirror(message));
    twin.selectedRobot.on(() => this.forget());
  }

  get offered(): boolean {
    return this.twin.client.channel(this.twin.own('/doppel/hardware')) !== null;
  }

  // While a panel is open that shows them.
  watch(panel: string, on: boolean): void {
    if (on) this.watchers.add(panel);
    else this.watchers.delete(panel);
    if (this.watchers.size > 0) {
      this.endDevices ??= this.twin.follow('/doppel/hardware', (message) => {
        this.all = message['devices'] as unknown as Device[];
        this.changed.emit();
      });
    } else {
      this.endDevices?.();
      this.endDevices = null;
    }
  }

  // The answer of both: why it is refused; '': it is done.
  hold(): Promise<string> {
    return this.call('hold', {});
  }

  confirmPose(component: string, joints: string[], positions: number[]): Promise<string> {
    return this.call('confirm_pose', { component, joints, positions });
  }

  private async call(name: string, request: Message): Promise<string> {
    try {
      const answer = await this.twin.client.call(this.twin.own(`/doppel/hardware/${name}`), request);
      return answer['success'] === true ? '' : String(answer['message']);
    } catch (problem) {
      return (problem as Error).message;
    }
  }

  // Called regularly: an ended mirror leaves no ghost.
  lookForEnd(): void {
    if (this.mirror && performance.now() - this.heard > LATE) this.forgetMirror();
  }

  get alarms(): MirrorJoint[] {
    return this.mirror?.joints.filter((one) => one.alarm !== '') ?? [];
  }

  private takeMirror(message: Message): void {
    this.heard = performance.now();
    this.mirror = { mode: String(message['mode']), joints: message['joints'] as unknown as MirrorJoint[] };
    this.mirrored.emit();
  }

  private forgetMirror(): void {
    this.mirror = null;
    this.mirrored.emit();
  }

  private forget(): void {
    this.all = [];
    this.changed.emit();
    this.forgetMirror();
  }
}
