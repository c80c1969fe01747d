// Files of the robot by URI. The twin's own server sends them over HTTP, compressed and kept by the browser; any other server
// by fetchAsset.
import type { Client } from '../protocol/client';

export class AssetStore {
  private readonly early = new Map<string, Promise<Uint8Array>>();

  // `own`: the page is served by the server of the twin.
  constructor(private readonly client: Client, private readonly own: boolean) {}

  // The files of another source.
  of(client: Client): AssetStore {
    return new AssetStore(client, false);
  }

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
    const { client } = this;
    if (!client.capabilities.has('assets')) throw new Error('the server has no files');
    const path = client.metadata['files'];
    return this.own && path ? overHttp(`${path}?uri=${encodeURIComponent(uri)}`) : client.fetchAsset(uri);
  }
}

async function overHttp(address: string): Promise<Uint8Array> {
  const answer = await fetch(address);
  if (!answer.ok) throw new Error((await answer.text()).trim() || `the server answers with status ${answer.status}`);
  return new Uint8Array(await answer.arrayBuffer());
}
