// node test/page/run.mjs: the tests of the page in a browser. DOPPEL: the program; CHROMIUM: the browser.
import { spawnSync } from 'node:child_process';
import { existsSync, readdirSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { program } from './lab.mjs';

const browser = process.env.CHROMIUM ?? '/usr/bin/chromium';
for (const needed of [browser, program]) {
  if (!existsSync(needed)) {
    console.error(`${needed} is missing`);
    process.exit(2);
  }
}
const here = dirname(fileURLToPath(import.meta.url));
let failed = false;
for (const name of readdirSync(here).filter((one) => one.endsWith('.test.mjs'))) { // one browser at a time
  failed = spawnSync(process.execPath, ['--test', '--test-timeout=400000', join(here, name)], { stdio: 'inherit' }).status !== 0 || failed;
}
process.exit(failed ? 1 : 0);
