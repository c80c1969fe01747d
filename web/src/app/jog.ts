// Jogging with keys and with a gamepad: motion while held, stop on release. The gamepad moves only while its dead-man
// button (a shoulder button) is held.
import type { App } from './app';
import { toast } from './dom';
import { settings } from './settings';
import { Signal } from './signal';
import type { ToolDriver } from './tool';

const DEADZONE = 0.12;
const DEADMAN = [4, 5]; // either shoulder button
const STOP_BUTTON = 1; // B, circle

export interface PadState {
  name: string;
  live: boolean; // the dead-man button is held
}

type Six = [number, number, number, number, number, number];

const TOOL_KEYS: Record<string, [number, number]> = {
  KeyW: [0, 1], KeyS: [0, -1], KeyA: [1, 1], KeyD: [1, -1], KeyR: [2, 1], KeyF: [2, -1],
  KeyI: [4, 1], KeyK: [4, -1], KeyJ: [5, 1], KeyL: [5, -1], KeyU: [3, -1], KeyO: [3, 1],
};

export class Jog {
  readonly padChanged = new Signal<PadState | null>();
  pad: PadState | null = null;
  mode: 'tool' | 'joint' = 'tool';
  joint = 0; // index among the independent joints
  local = false;
  readonly jointChanged = new Signal();
  // Takes the gamepad for the base: the sticks while the dead-man button is held, else null.
  base: ((axes: readonly number[] | null) => void) | null = null;
  private readonly held = new Set<string>();
  private moving = false;
  private stopHeld = false;

  constructor(private readonly app: App, private readonly driver: ToolDriver) {
    app.world.stage.tick.on((dt) => this.tick(dt));
    addEventListener('blur', () => this.held.clear());
    document.addEventListener('visibilitychange', () => this.held.clear());
    app.commander.stopChanged.on(() => this.held.clear());
  }

  // True if the key jogs.
  press(code: string): boolean {
    if (!(code in TOOL_KEYS) && code !== 'BracketLeft' && code !== 'BracketRight') return false;
    this.held.add(code);
    return true;
  }

  lift(code: string): void {
    this.held.delete(code);
  }

  nextJoint(step: number): void {
    const count = this.joints().length;
    if (count > 0) this.joint = (this.joint + step + count) % count;
    this.jointChanged.emit();
  }

  joints(): NonNullable<App['twin']['tree']>['moving'] {
    return this.app.twin.tree?.moving.filter((joint) => !joint.mimic) ?? [];
  }

  private fromPad(): Six | null {
    const pad = [...(navigator.getGamepads?.() ?? [])].find((one) => one?.connected);
    const live = pad ? DEADMAN.some((i) => pad.buttons[i]?.pressed) : false;
    if ((pad?.id ?? '') !== (this.pad?.name ?? '') || live !== (this.pad?.live ?? false)) {
      this.pad = pad ? { name: pad.id, live } : null;
      this.padChanged.emit(this.pad);
    }
    if (!pad) return null;
    const stop = pad.buttons[STOP_BUTTON]?.pressed ?? false;
    if (stop && !this.stopHeld && !this.app.commander.stopped) void this.app.commander.stop();
    this.stopHeld = stop;
    const axis = (i: number): number => {
      const value = pad.axes[i] ?? 0;
      return Math.abs(value) < DEADZONE ? 0 : (value - Math.sign(value) * DEADZONE) / (1 - DEADZONE);
    };
    if (this.base) {
      this.base(live ? [axis(0), axis(1), axis(2), axis(3)] : null);
      return null;
    }
    if (!live) return null;
    const key = (i: number): number => pad.buttons[i]?.value ?? 0;
    return [-axis(1), -axis(0), key(7) - key(6), 0, -axis(3), -axis(2)];
  }

  private tick(dt: number): void {
    const speeds: Six = [0, 0, 0, 0, 0, 0];
    for (const code of this.held) {
      const found = TOOL_KEYS[code];
      if (found) speeds[found[0]]! += found[1];
    }
    this.fromPad()?.forEach((value, i) => (speeds[i]! += value));
    this.moveJoint(dt);
    const busy = speeds.some((s) => s !== 0);
    if (!busy) {
      if (this.moving && !this.driver.dragging) this.driver.drop(); // after release the motion is stopped, not completed
      this.moving = false;
      return;
    }
    if (!this.moving && this.driver.hasMover() && !this.driver.canMove()) toast(this.driver.refusal(), 'warning');
    this.moving = true;
    if (!this.driver.canMove() || this.driver.dragging) return;
    const linear = this.app.world.size * 0.35 * settings.speedShare * dt, angular = 1.2 * settings.speedShare * dt;
    this.driver.nudge([speeds[0] * linear, speeds[1] * linear, speeds[2] * linear], [speeds[3] * angular, speeds[4] * angular, speeds[5] * angular], this.local);
  }

  private moveJoint(dt: number): void {
    const direction = Number(this.held.has('BracketRight')) - Number(this.held.has('BracketLeft'));
    const joint = this.joints()[this.joint];
    if (direction === 0 || !joint) return;
    const speed = (joint.velocity > 0 ? joint.velocity : joint.kind === 'prismatic' ? 0.1 : 1) * settings.speedShare;
    this.app.commander.set(joint, this.app.twin.target[joint.index]! + direction * speed * dt);
  }
}
