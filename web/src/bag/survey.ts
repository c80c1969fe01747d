// Leads a twin without a picture through the whole recording, between other work: for the curves, the log and the
// marks.
import type { Recorder } from '../app/recorder';
import { Signal } from '../app/signal';
import { Twin, type LogLine } from '../app/twin';
import type { Bag, Topic } from './bag';
import { BagSource } from './source';

const SLICE = 10; // ms without a pause
const STEP_BYTES = 256 * 1024; // of decompressed pieces that are read in one step
const MOST_LINES = 50_000;
const MOST_SAMPLES = 200_000;
// The twin would read these all the time, and no curve of a joint needs them. The status stays: it shows the namespace.
const UNUSED = /^(tf2_msgs\/(msg\/)?TFMessage|rosgraph_msgs\/(msg\/)?Clock)$|\/ground_truth\/odom$/;

const pause = (ms = 0): Promise<void> => new Promise((done) => setTimeout(done, ms));

export class Survey {
  readonly twin = Twin.forRecording();
  readonly changed = new Signal();
  readonly lines: { time: number; line: LogLine }[] = [];
  done = 0; // s that are read
  isComplete = false;
  private source: BagSource | null = null;
  private round = 0;
  private logIsComplete = false;
  private isWaiting = false; // a restart is due

  // `isBusy`: the page reads the same files for what is shown now.
  constructor(
    readonly bag: Bag,
    readonly recorder: Recorder,
    private readonly isBusy: () => boolean,
  ) {
    this.twin.logged.on((line) => {
      if (this.lines.length < MOST_LINES && !this.logIsComplete) this.lines.push({ time: this.time, line });
    });
    const samples = bag.topics
      .filter(({ type }) => /JointState$/.test(type))
      .reduce((sum, { count }) => sum + (count || MOST_SAMPLES), 0);
    recorder.follow(this.twin, () => this.time, bag.length, Math.max(2000, Math.min(MOST_SAMPLES, samples + 100)));
    this.end = recorder.added.on(({ key }) => {
      if (this.done > 0 || this.isComplete || key.startsWith('topic:')) this.restart();
    });
  }

  private readonly end: () => void;

  get time(): number {
    return this.source?.time ?? 0;
  }

  stop(): void {
    this.round += 1;
    this.end();
  }

  // Reads everything again: a curve was added.
  restart(): void {
    if (this.isWaiting || this.round === 0) return;
    this.isWaiting = true;
    setTimeout(() => {
      this.isWaiting = false;
      this.begin();
    });
  }

  begin(): void {
    this.round += 1;
    void this.run(this.round).catch((problem: Error) => this.bag.onproblem(problem.message));
  }

  // The log of the recording until that time.
  logUntil(time: number): LogLine[] {
    return this.lines.filter((one) => one.time <= time).map(({ line }) => line);
  }

  covers(time: number): boolean {
    return this.logIsComplete || this.done >= time;
  }

  private plotted(topic: Topic): boolean {
    const begin = `topic:${topic.name}`;
    for (const key of this.recorder.series.keys())
      if (key.startsWith(`${begin}.`) || key.startsWith(`${begin}[`)) return true;
    return false;
  }

  private async run(round: number): Promise<void> {
    const hasJoints = this.bag.topics.some(({ type }) => /JointState$/.test(type));
    const offers = (topic: Topic): boolean =>
      this.plotted(topic) ||
      (/TFMessage$/.test(topic.type) && !hasJoints) ||
      !(UNUSED.test(topic.type) || UNUSED.test(topic.name) || (this.logIsComplete && /(^|\/)Log$/.test(topic.type)));
    const source = new BagSource(this.bag, offers);
    this.source = source;
    this.isComplete = false;
    this.done = 0;
    if (!this.logIsComplete) this.lines.length = 0;
    this.recorder.clear();
    this.twin.read(source);
    source.sent = ({ topic }) => {
      if (/JointState$/.test(topic.type) || (!hasJoints && /TFMessage$/.test(topic.type)) || this.plotted(topic))
        this.recorder.take();
    };
    source.start();
    await source.begin();
    await this.pour(source, round);
    if (round !== this.round) return;
    this.logIsComplete = this.isComplete = true;
    this.changed.emit();
  }

  private async pour(source: BagSource, round: number): Promise<void> {
    let began = performance.now();
    for (const { piece, end } of [...this.bag.spans].sort((a, b) => a.end - b.end)) {
      const from = source.time;
      const steps = Math.max(1, Math.ceil(piece.size / STEP_BYTES));
      for (let step = 1; step <= steps; step += 1) {
        if (round !== this.round) return;
        if (performance.now() - began > SLICE) {
          this.changed.emit();
          await pause();
          while (this.isBusy()) await pause(20);
          began = performance.now();
        }
        await source.advance(step === steps ? end : from + ((end - from) * step) / steps);
      }
      this.done = end;
    }
  }
}
