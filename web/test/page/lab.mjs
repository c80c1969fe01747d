// A twin, the development server before it, and a browser, for the tests of the page.
import { chromium } from 'playwright-core';
import { spawn } from 'node:child_process';
import { createServer } from 'node:net';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const root = join(here, '../../..');
export const program = process.env.DOPPEL ?? join(root, 'build/bin/doppel');
export const robot = process.env.DOPPEL_ROBOT ?? join(root, 'robots/omarm_one');
export const robots = process.env.DOPPEL_ROBOTS ?? join(root, 'robots');

export const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

export function freePort() {
  return new Promise((done) => {
    const server = createServer().listen(0, '127.0.0.1', () => {
      const { port } = server.address();
      server.close(() => done(port));
    });
  });
}

async function until(what, check, ms = 20000) {
  const end = Date.now() + ms;
  while (Date.now() < end) {
    if (await check().catch(() => false)) return;
    await sleep(50);
  }
  throw new Error(`${what} did not come within ${ms / 1000} s`);
}

export class Lab {
  #children = new Set();

  async start() {
    this.twinPort = await freePort();
    await this.startTwin();
    this.url = `http://127.0.0.1:${this.twinPort}/`;
    // A program that serves the page itself needs no other server.
    const served = await fetch(this.url).then((r) => r.text()).catch(() => '');
    if (process.env.PAGE_BY_DEV === '1' || !served.includes('type="module"')) {
      const port = await freePort();
      this.#spawn(process.execPath, [join(here, '../../dev/serve.mjs'), '--port', port, '--twin', this.twinPort, '--robots', robots]);
      this.url = `http://127.0.0.1:${port}/`;
      await until('the development server', async () => (await fetch(this.url)).ok);
    }
    this.browser = await chromium.launch({
      executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
      args: ['--headless=new', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--no-sandbox'],
    });
  }

  async startTwin() {
    this.twin = this.#spawn(program, ['up', robot, '--headless', '--port', this.twinPort]);
    await until('the twin', async () => (await fetch(`http://127.0.0.1:${this.twinPort}/health`)).ok);
  }

  async killTwin() {
    const ended = new Promise((done) => this.twin.once('exit', done));
    this.twin.kill('SIGKILL');
    await ended;
  }

  #spawn(command, args) {
    const child = spawn(command, args.map(String), { stdio: process.env.VERBOSE ? 'inherit' : 'ignore' });
    this.#children.add(child);
    child.once('exit', () => this.#children.delete(child));
    return child;
  }

  async page(options = {}) {
    const page = await this.browser.newPage({ viewport: { width: 900, height: 600 }, ...options });
    page.problems = [];
    page.on('console', (m) => m.type() === 'error' && page.problems.push(m.text()));
    page.on('pageerror', (e) => page.problems.push(e.stack));
    if (options.before) await page.addInitScript(options.before);
    await page.goto(this.url, { timeout: Number(process.env.PATIENCE ?? 60000) });
    await page.waitForFunction(() => window.doppel?.world.firstPicture > 0 && doppel.twin.controllers.length > 0, null, { timeout: Number(process.env.PATIENCE ?? 60000) });
    return page;
  }

  async stop() {
    await this.browser?.close();
    for (const child of this.#children) child.kill('SIGKILL');
  }
}
