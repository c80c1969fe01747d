// Files of the robot by URI, through the twin (fetchAsset).
import type { Client } from '../protocol/client';

export class AssetStore {
  private readonly early = new Map<string, Promise<Uint8Array>>();

  constructor(private readonly client: Client) {}

  // Requests now what `get` will need soon.
  prefetch(uri: string): void {
    if (this.early.has(uri)) return;
    const coming = this.fetch(uri);
    coming.catch(() => {}); // reported to the caller of `get`
    this.early.set(uri, coming);
  }

  get(uri: string): Promise<Uint8Array> {
    const coming = this.early.get(uri) ?? this.fetch(uri);
    this.early.delete(uri);
    return coming;
  }

  forget(): void {
    this.early.clear();
  }

  private async fetch(uri: string): Promise<Uint8Array> {
    if (!this.client.capabilities.has('assets')) throw new Error('the server has no files');
    return this.client.fetchAsset(uri);
  }
}
