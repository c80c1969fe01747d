// node test/page/run.mjs: the tests of the page in a browser. DOPPEL: the program; CHROMIUM: the browser.
import { spawnSync } from 'node:child_process';
import { existsSync } from 'node:fs';
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
const test = join(dirname(fileURLToPath(import.meta.url)), 'page.test.mjs');
process.exit(spawnSync(process.execPath, ['--test', '--test-timeout=400000', test], { stdio: 'inherit' }).status ?? 1);
