// node test/page/run.mjs [NAME...]: runs the tests of the page in a browser, file after file. DOPPEL: the program;
// CHROMIUM: the browser; SHOTS: a folder for pictures of failures; TIMEOUT: ms to wait for the slowest operation.
import { spawnSync } from 'node:child_process';
import { existsSync, readdirSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { program } from './lab.mjs';

const here = dirname(fileURLToPath(import.meta.url));
const browser = process.env.CHROMIUM ?? '/usr/bin/chromium';
for (const needed of [browser, program, join(here, '../../dist/index.html')]) {
  if (!existsSync(needed)) {
    console.error(`${needed} is missing`);
    process.exit(2);
  }
}
const wanted = process.argv.slice(2);
const files = readdirSync(here).filter((name) => name.endsWith('.test.mjs') && (wanted.length === 0 || wanted.includes(name.replace('.test.mjs', ''))));
let status = 0;
for (const file of files) status = spawnSync(process.execPath, ['--test', join(here, file)], { stdio: 'inherit' }).status || status;
process.exit(status);
