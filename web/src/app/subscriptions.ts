// Subscriptions of a part of the page that follow what it needs now. While the browser's tab is in the background there
// are none, so that the twin makes no data for it.
import type { Client, Handler } from '../protocol/client';

export interface Wanted {
  topic: string;
  handler: Handler;
  fresh?: boolean; // the last message, which other parts have read, is of no use
}

export class Subscriptions {
  private wanted = new Map<string, Wanted>();
  private readonly live = new Map<string, { topic: string; end: () => void }>();

  constructor(private readonly client: Client) {
    document.addEventListener('visibilitychange', () => this.apply());
  }

  // All that is needed, by names that stay; a handler stays as long as its name and topic.
  want(wanted: Map<string, Wanted>): void {
    this.wanted = wanted;
    this.apply();
  }

  private apply(): void {
    const wanted = document.hidden ? new Map<string, Wanted>() : this.wanted;
    for (const [name, one] of this.live) {
      if (wanted.get(name)?.topic === one.topic) continue;
      this.live.delete(name);
      one.end();
    }
    for (const [name, { topic, handler, fresh }] of wanted) {
      if (!this.live.has(name)) this.live.set(name, { topic, end: this.client.subscribe(topic, handler, fresh) });
    }
  }
}
