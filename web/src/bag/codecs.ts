// Decompression of chunks, by names of the MCAP format. Own WebAssembly would need a wider content security policy.
import { decompress as unzstd } from 'fzstd';
import { unlz4 } from './lz4';

type Codec = (bytes: Uint8Array, size: bigint) => Uint8Array;

export const CODECS: Record<string, Codec> = {
  zstd: (bytes, size) => unzstd(bytes, new Uint8Array(Number(size))),
  lz4: (bytes, size) => unlz4(bytes, Number(size)),
};
