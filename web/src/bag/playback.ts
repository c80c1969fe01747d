// The time of a recording that is shown: it plays, jumps and repeats. A second recording follows the first one.
import { Signal } from '../app/signal';
import type { BagSource } from './source';

export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10];
const LONGEST_FRAME = 0.25; // s of wall-clock time that one frame counts at most
const AHEAD = 3; // s of wall-clock time that are read ahead

export class Playback {
  time = 0; // s since the start of the recording
  isPlaying = false;
  loops = false;
  speed = 1;
  readonly moved = new Signal(); // another time
  readonly changed = new Signal(); // it plays or not, or in another way
  private readonly followers = new Set<BagSource>();
  private isAdvancing = false;

  constructor(readonly source: BagSource) {
    source.moved.on(() => this.moved.emit());
  }

  get length(): number {
    return this.source.bag.length;
  }

  get isReading(): boolean {
    return this.source.isReading || this.source.isJumping;
  }

  follow(source: BagSource): () => void {
    this.followers.add(source);
    source.goTo(this.time);
    return () => this.followers.delete(source);
  }

  readonly seek = (time: number): void => {
    this.time = Math.min(this.length, Math.max(0, time));
    this.source.goTo(this.time);
    for (const one of this.followers) one.goTo(this.time);
    this.moved.emit();
  };

  play(on: boolean): void {
    if (on && this.time >= this.length) this.seek(0);
    this.isPlaying = on;
    this.changed.emit();
  }

  setSpeed(speed: number): void {
    this.speed = speed;
    this.changed.emit();
  }

  setLoop(on: boolean): void {
    this.loops = on;
    this.changed.emit();
  }

  // To the next message of the topics that are shown, or the one before.
  async step(direction: 1 | -1): Promise<void> {
    this.play(false);
    this.seek(await this.source.bag.step(this.source.topics, this.time, direction));
  }

  // Once for each frame of the picture.
  tick(dt: number): void {
    if (!this.isPlaying || this.isAdvancing || this.source.isJumping) return;
    if (this.time >= this.length) {
      if (this.loops) this.seek(0);
      else this.play(false);
      return;
    }
    void this.advance(Math.min(this.length, this.time + Math.min(dt, LONGEST_FRAME) * this.speed));
  }

  private async advance(to: number): Promise<void> {
    this.isAdvancing = true;
    const from = this.time;
    try {
      await Promise.all([this.source, ...this.followers].map((one) => one.advance(Math.min(to, one.bag.length))));
      if (this.time === from) this.time = to;
      this.moved.emit();
      for (const { bag, topics } of [this.source, ...this.followers]) bag.prefetch(topics, to, to + AHEAD * this.speed);
    } finally {
      this.isAdvancing = false;
    }
  }
}
