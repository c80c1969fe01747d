// The map of where the tool can go: a coarse one first, then a finer one of the same arm.
import { rotate, STRIDE } from '../robot/tree';
import type { App } from './app';
import type { Arm, Kinematics, ReachAnswer, ReachQuestion } from './kinematics';
import { Newest } from './newest';
import { Signal } from './signal';

const COARSE = { cells: 16, directions: 6 }, FINE = { cells: 32, directions: 20 }; // cells across the reach's diameter

export interface ReachMap extends ReachAnswer {
  arm: Arm;
  question: ReachQuestion;
  fine: boolean;
}

interface Step {
  link: number;
  down: boolean;
  fine: boolean;
}

export class Reach {
  readonly changed = new Signal();
  on = false;
  down = false; // only what the tool reaches pointing down
  map: ReachMap | null = null;
  problem = '';
  private readonly steps = new Newest<Step, ReachMap>((step) => this.ask(step), (map, step) => this.take(map, step), (problem) => {
    this.problem = problem.message;
    this.changed.emit();
  });

  constructor(private readonly app: App, private readonly kinematics: Kinematics) {
    app.twin.robotChanged.on(() => this.show(false));
    app.twin.phaseChanged.on((phase) => phase !== 'open' && this.show(false));
    app.world.toolChanged.on((link) => this.on && link !== this.map?.arm.tip && this.start());
  }

  get busy(): boolean {
    return this.steps.busy;
  }

  show(on: boolean): void {
    if (on === this.on) return;
    this.on = on;
    if (on) this.start();
    else this.forget();
    this.changed.emit();
  }

  pointDown(down: boolean): void {
    this.down = down;
    if (this.on) this.start();
  }

  private forget(): void {
    this.steps.clear();
    this.map = null;
    this.problem = '';
  }

  private start(): void {
    this.forget();
    this.steps.put({ link: this.app.world.tool, down: this.down, fine: false });
    this.changed.emit();
  }

  private async ask({ link, down, fine }: Step): Promise<ReachMap> {
    const arm = await this.kinematics.armOf(link);
    if (!arm) throw new Error('This robot has no arm.');
    const { cells, directions } = fine ? FINE : COARSE;
    const question = { group: arm.group, cell: (2 * arm.length) / cells, directions, approach: down ? this.downwards() : null };
    return { ...await this.kinematics.reach(question), arm, question, fine };
  }

  private take(map: ReachMap, step: Step): void {
    this.map = map;
    if (!step.fine) this.steps.put({ ...step, fine: true });
    this.changed.emit();
  }

  // The world's -z in the root link.
  private downwards(): [number, number, number] {
    const { twin } = this.app;
    const [x, y, z, w] = twin.poses.subarray(twin.tree!.root * STRIDE + 3);
    const out: [number, number, number] = [0, 0, 0];
    rotate([-x!, -y!, -z!, w!], 0, 0, 0, -1, out, 0);
    return out;
  }
}
