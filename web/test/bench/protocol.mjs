// The cost of reading the twin's messages in the page, and the size of the parts of src/protocol compared with the
// packages:
//   DOPPEL=build/bin/doppel npm run bench:protocol [-- OTHER]
// OTHER: another checkout, with its packages installed, whose src/protocol reads the same messages in turns with this
// one.
import { build } from 'esbuild';
import { spawnSync } from 'node:child_process';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';

const here = dirname(fileURLToPath(import.meta.url));
const web = join(here, '../..');
const other = process.argv[2];

const PARTS = [
  ['schemas, own', `export { parseSchema } from './src/protocol/schema'`],
  ['schemas, @foxglove/rosmsg', `export { parse } from '@foxglove/rosmsg'`],
  ['CDR, the library reads, own writer', `export { readCdr, writeCdr } from './src/protocol/cdr'`],
  ['CDR, the library reads and writes', `export { MessageReader, MessageWriter } from '@foxglove/rosmsg2-serialization'`],
  ['frames, @foxglove/ws-protocol by its file', `export { default } from '@foxglove/ws-protocol/dist/esm/src/FoxgloveClient'`],
  ['frames, @foxglove/ws-protocol by its index', `export { FoxgloveClient } from '@foxglove/ws-protocol'`],
  ['all of src/protocol', `export { Client } from './src/protocol/client'`],
];
console.log('bundled and minified, bytes; compressed');
for (const [name, contents] of PARTS) {
  const { outputFiles } = await build({ stdin: { contents, resolveDir: web, loader: 'ts' }, bundle: true, write: false, minify: true, format: 'esm', target: 'chrome100', legalComments: 'none' });
  const bytes = outputFiles[0].contents;
  console.log(`  ${name.padEnd(46)}${String(bytes.length).padStart(8)}${String(gzipSync(bytes, { level: 9 }).length).padStart(8)}`);
}
const outfile = join(web, '.test/bench/reading.mjs');
await build({
  entryPoints: [join(here, 'reading.ts')], outfile, bundle: true, platform: 'node', format: 'esm', external: ['ws'], logLevel: 'warning',
  alias: { other: other ? join(resolve(other), 'web/src/protocol') : join(web, 'src/protocol') },
});
process.exit(spawnSync(process.execPath, [outfile, ...(other ? [other] : [])], { stdio: 'inherit' }).status ?? 1);
