// Questions of which only the newest counts: at most one is in flight, and of those that come meanwhile the last is asked.
export class Newest<Question, Answer> {
  private waiting: { question: Question } | null = null;
  private isAsking = false;
  private round = 0;
  private roundInFlight = 0;

  constructor(private readonly ask: (question: Question) => Promise<Answer>, private readonly take: (answer: Answer, question: Question) => void,
    private readonly fail: (problem: Error, question: Question) => void) {}

  // An answer is still to come.
  get busy(): boolean {
    return this.waiting !== null || (this.isAsking && this.roundInFlight === this.round);
  }

  put(question: Question): void {
    this.waiting = { question };
    if (!this.isAsking) void this.run();
  }

  // The answer in flight is not taken any more; a later question waits until it is there.
  clear(): void {
    this.waiting = null;
    this.round += 1;
  }

  private async run(): Promise<void> {
    this.isAsking = true;
    while (this.waiting) {
      const { question } = this.waiting;
      const { round } = this;
      this.waiting = null;
      this.roundInFlight = round;
      try {
        const answer = await this.ask(question);
        if (round === this.round) this.take(answer, question);
      } catch (problem) {
        if (round === this.round) this.fail(problem as Error, question);
      }
    }
    this.isAsking = false;
  }
}
