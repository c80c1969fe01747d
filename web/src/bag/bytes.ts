// The bytes of a recording: a file of the user's machine, read by slices, or an address, read by HTTP ranges. A
// server without ranges sends the file as a whole; it is kept as a blob, which the browser may put on disk.
import { BagProblem } from './problem';

export interface Bytes {
  name: string;
  size: number;
  isRemote: boolean; // each read is a request
  read(from: number, length: number): Promise<Uint8Array>;
}

export type Progress = (text: string) => void;

const BLOCK = 64 * 1024; // bytes of a request at least
const MOST_BLOCKS = 16; // that are kept: the beginning and the index of a file are read in small pieces

function within(name: string, size: number, from: number, length: number): void {
  if (from < 0 || length < 0 || from + length > size)
    throw new BagProblem(
      `${name} has ${size} bytes, and its records refer to byte ${from + length}: it is cut off or damaged.`,
    );
}

export class FileBytes implements Bytes {
  readonly isRemote = false;
  readonly size: number;

  constructor(
    readonly name: string,
    private readonly file: Blob,
  ) {
    this.size = file.size;
  }

  async read(from: number, length: number): Promise<Uint8Array> {
    within(this.name, this.size, from, length);
    try {
      return new Uint8Array(await this.file.slice(from, from + length).arrayBuffer());
    } catch {
      throw new BagProblem(
        `${this.name} cannot be read at byte ${from}: it was changed or removed since it was opened. Open it again.`,
      );
    }
  }
}

export class RangeBytes implements Bytes {
  readonly isRemote = true;
  private readonly blocks: { from: number; bytes: Uint8Array }[];

  constructor(
    readonly name: string,
    readonly size: number,
    private readonly address: string,
    first: Uint8Array,
  ) {
    this.blocks = [{ from: 0, bytes: first }];
  }

  async read(from: number, length: number): Promise<Uint8Array> {
    within(this.name, this.size, from, length);
    const kept = this.blocks.find((block) => block.from <= from && from + length <= block.from + block.bytes.length);
    if (kept) return kept.bytes.subarray(from - kept.from, from - kept.from + length);
    if (length >= BLOCK) return this.request(from, length);
    const start = Math.max(0, Math.min(from, this.size - BLOCK));
    const bytes = await this.request(start, Math.min(BLOCK, this.size - start));
    this.blocks.push({ from: start, bytes });
    if (this.blocks.length > MOST_BLOCKS) this.blocks.splice(1, 1);
    return bytes.subarray(from - start, from - start + length);
  }

  private async request(from: number, length: number): Promise<Uint8Array> {
    const answer = await ask(this.address, { Range: `bytes=${from}-${from + length - 1}` });
    if (answer.status !== 206)
      throw new BagProblem(
        `${this.name} cannot be read at byte ${from}: the server answers with status ${answer.status}.`,
      );
    const bytes = new Uint8Array(await answer.arrayBuffer());
    if (bytes.length !== length)
      throw new BagProblem(
        `${this.name} ended at byte ${from + bytes.length} of ${
          this.size
        }: it was changed since it was opened. Reload the page.`,
      );
    return bytes;
  }
}

async function ask(address: string, headers: Record<string, string> = {}): Promise<Response> {
  try {
    return await fetch(address, { headers });
  } catch {
    const other = new URL(address, location.href).origin !== location.origin;
    throw new BagProblem(
      `${address} cannot be requested: ${
        other
          ? 'the server does not answer, or it does not permit pages of other addresses (CORS)'
          : 'the server does not answer'
      }.`,
    );
  }
}

const nameOf = (address: string): string =>
  decodeURIComponent(new URL(address, location.href).pathname.split('/').filter(Boolean).pop() ?? address);
const megabytes = (count: number): string => `${(count / 1e6).toFixed(1)} MB`;

// The file at the address; by ranges where the server has them.
export async function bytesAt(address: string, progress: Progress): Promise<Bytes> {
  const name = nameOf(address);
  const answer = await ask(address, { Range: `bytes=0-${BLOCK - 1}` });
  if (answer.status === 416) return new FileBytes(name, new Blob()); // an empty file has no ranges
  if (!answer.ok)
    throw new BagProblem(
      `${address}: the server answers with status ${answer.status}${
        answer.status === 404 ? ', it has no such file' : ''
      }.`,
    );
  if (answer.status !== 206) return download(name, answer, progress);
  const size = Number(/\/(\d+)$/.exec(answer.headers.get('Content-Range') ?? '')?.[1]) || (await sizeOf(address));
  return size > 0
    ? new RangeBytes(name, size, address, new Uint8Array(await answer.arrayBuffer()))
    : download(name, await ask(address), progress);
}

// A server of another address may not let the page read Content-Range. 0: it does not say the size otherwise either.
async function sizeOf(address: string): Promise<number> {
  const answer = await fetch(address, { method: 'HEAD' }).catch(() => null);
  return answer?.ok && !answer.headers.get('Content-Encoding') ? Number(answer.headers.get('Content-Length')) || 0 : 0;
}

async function download(name: string, answer: Response, progress: Progress): Promise<Bytes> {
  const expected = Number(answer.headers.get('Content-Length')) || 0;
  const reader = answer.body!.getReader();
  let blob = new Blob();
  let waiting: Uint8Array[] = [],
    count = 0,
    joined = 0;
  for (;;) {
    const { done, value } = await reader.read();
    if (value) waiting.push(value);
    count += value?.length ?? 0;
    if (done || count - joined > 32e6) {
      // a blob leaves the memory of the page
      blob = new Blob([blob, ...(waiting as BlobPart[])]);
      waiting = [];
      joined = count;
    }
    if (done) return new FileBytes(name, blob);
    progress(
      `Downloading ${name}, because the server has no ranges: ${megabytes(count)}${
        expected > 0 ? ` of ${megabytes(expected)}` : ''
      }.`,
    );
  }
}

export async function textAt(address: string): Promise<string | null> {
  const answer = await ask(address);
  return answer.ok ? answer.text() : null;
}
