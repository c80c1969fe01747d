// node test/run.mjs [FOLDER]: bundles each test of the folder with esbuild (so that no newer Node is needed) and runs
// them with node's own test runner.
import { build } from 'esbuild';
import { readdirSync, rmSync } from 'node:fs';
import { spawnSync } from 'node:child_process';
import { fileURLToPath } from 'node:url';
import { join } from 'node:path';

const here = join(fileURLToPath(new URL('.', import.meta.url)), process.argv[2] ?? '.');
const out = join(fileURLToPath(new URL('.', import.meta.url)), '..', '.test', process.argv[2] ?? 'units');
rmSync(out, { recursive: true, force: true });
const tests = readdirSync(here).filter((name) => name.endsWith('.test.ts'));
await build({
  entryPoints: tests.map((name) => join(here, name)),
  outdir: out,
  bundle: true,
  external: ['ws'],
  platform: 'node',
  format: 'esm',
  outExtension: { '.js': '.mjs' },
  logLevel: 'warning',
});
const files = tests.map((name) => join(out, name.replace(/\.ts$/, '.mjs')));
process.exit(spawnSync(process.execPath, ['--test', ...files], { stdio: 'inherit' }).status ?? 1);
