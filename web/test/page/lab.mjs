// A twin that serves the page, and a browser, for the tests of the page. SHOTS=FOLDER: a picture of each failure.
import { chromium } from 'playwright-core';
import { spawn } from 'node:child_process';
import { mkdirSync } from 'node:fs';
import { createServer } from 'node:net';
import { dirname, join, resolve } from 'node:path';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const root = join(here, '../../..');
export const program = process.env.DOPPEL ?? join(root, 'build/bin/doppel');
export const robot = process.env.DOPPEL_ROBOT ?? join(root, 'robots/omarm_one');

const timeLimit = Number(process.env.TIMEOUT ?? 60000); // ms

export const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

export function freePort() {
  return new Promise((done) => {
    const server = createServer().listen(0, '127.0.0.1', () => {
      const { port } = server.address();
      server.close(() => done(port));
    });
  });
}

export async function until(what, check, ms = 20000) {
  const end = Date.now() + ms;
  while (Date.now() < end) {
    if (await check().catch(() => false)) return;
    await sleep(50);
  }
  throw new Error(`${what} did not happen within ${ms / 1000} s`);
}

// playwright's own waitForFunction evaluates text in the page, which the page's policy rejects.
export async function waitFor(page, condition, arg, ms = timeLimit / 2) {
  const end = Date.now() + ms;
  while (!(await page.evaluate(condition, arg))) {
    if (Date.now() > end) throw new Error(`expected within ${ms / 1000} s: ${condition}${arg === undefined ? '' : ` with ${JSON.stringify(arg)}`}`);
    await sleep(30);
  }
}

export class Lab {
  #children = new Set();
  #page = null;
  #root;

  #up;

  // `other`: a checkout whose page is served instead of this one's. `up`: the arguments of `doppel up`.
  constructor(other, up = [robot]) {
    this.#up = up;
    this.#root = other ? { DOPPEL_ROOT: resolve(other) } : {};
  }

  async start() {
    this.twinPort = await freePort();
    await this.startTwin();
    this.url = `http://127.0.0.1:${this.twinPort}/`;
    await this.startBrowser();
  }

  async startBrowser(more = []) {
    this.browser = await chromium.launch({
      executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
      args: ['--headless=new', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--no-sandbox', ...more],
    });
  }

  async startTwin() {
    this.twin = this.#spawn(program, ['up', ...this.#up, '--headless', '--port', this.twinPort]);
    await until('the twin', async () => (await fetch(`http://127.0.0.1:${this.twinPort}/health`)).ok);
  }

  // Another program with a page, besides the twin: `doppel VERB` with these arguments.
  async run(verb, args) {
    const port = await freePort();
    const child = this.#spawn(program, [verb, ...args, '--no-open', '--port', port]);
    const url = `http://127.0.0.1:${port}/`;
    await until(`doppel ${verb}`, async () => (await fetch(`${url}health`)).ok);
    return { url, end: () => new Promise((ended) => {
      child.once('exit', ended);
      child.kill('SIGINT');
    }) };
  }

  async killTwin() {
    const ended = new Promise((done) => this.twin.once('exit', done));
    this.twin.kill('SIGKILL');
    await ended;
  }

  #spawn(command, args) {
    const child = spawn(command, args.map(String), {
      stdio: process.env.VERBOSE ? 'inherit' : 'ignore',
      env: { DOPPEL_ROOT: root, ...process.env, ...this.#root }, // this page, not that of the folder where the program was built
    });
    if (this.#children.size === 0) process.once('exit', () => this.#end()); // also if starting has failed
    this.#children.add(child);
    child.once('exit', () => this.#children.delete(child));
    return child;
  }

  // A page whose picture, panels and tools are complete; messages of its console are in `problems`. `prepare` gets the
  // empty page. Without `pictured` there may be no robot.
  async page(options = {}, url = this.url, prepare = async () => {}, pictured = true) {
    const page = await this.browser.newPage({ viewport: { width: 900, height: 600 }, ...options });
    page.problems = [];
    page.on('console', (m) => m.type() === 'error' && page.problems.push(m.text()));
    page.on('pageerror', (e) => page.problems.push(e.stack));
    await page.addInitScript(() => addEventListener('securitypolicyviolation', (e) => console.error(`refused by the policy: ${e.violatedDirective} ${e.blockedURI}`)));
    await page.addInitScript(() => { // the card of the first visit would cover the picture
      const kept = JSON.parse(localStorage.getItem('doppel.settings') ?? '{}');
      localStorage.setItem('doppel.settings', JSON.stringify({ ...kept, hintsSeen: true }));
    });
    await prepare(page);
    await page.goto(url, { timeout: timeLimit });
    await waitFor(page, (drawn) => window.doppel?.ready && (!drawn || doppel.world.firstPicture > 0), pictured, timeLimit);
    return page;
  }

  // The page that tests share, with the twin as after its start: running, controllers active, the arm at its initial
  // pose.
  async fresh() {
    if (!this.#page || this.#page.isClosed()) this.#page = await this.page();
    const page = this.#page;
    page.problems.length = 0;
    await waitFor(page, () => doppel.twin.client.phase === 'open' && doppel.twin.controllers.length > 0);
    await page.evaluate(async () => {
      const { twin, commander, driver, layout } = doppel;
      driver.drop();
      if (commander.stopped) await commander.resetStop();
      const idle = twin.controllers.filter((c) => c.state === 'inactive').map((c) => c.name);
      if (idle.length > 0) await commander.switchControllers(idle, []);
      for (const [name, request] of [['set_speed', { factor: 1 }], ['unpause_physics', {}], ['reset_simulation', {}]]) await twin.client.call(`/gazebo/${name}`, request);
      twin.commandedAt.fill(0);
      layout.open('joints');
      await twin.listControllers();
    });
    await waitFor(page, () => doppel.twin.tree.moving.every((j) => j.mimic || (Math.abs(doppel.twin.velocity[j.index] || 0) < 0.01
      && Math.abs(doppel.twin.q[j.index] - doppel.twin.target[j.index]) < 0.02)));
    return page;
  }

  // A test with a fresh page.
  check(name, body) {
    test(name, { timeout: 3 * timeLimit }, async () => {
      const page = await this.fresh();
      await this.watched(name, page, () => body(page));
    });
  }

  async watched(name, page, body) {
    try {
      await body();
    } catch (problem) {
      if (process.env.SHOTS) {
        mkdirSync(process.env.SHOTS, { recursive: true });
        await page.screenshot({ path: join(process.env.SHOTS, `${name.replace(/\W+/g, '-').slice(0, 60)}.png`), timeout: timeLimit }).catch(() => {});
      }
      if (page.problems.length > 0) console.log(`the console of '${name}':\n${page.problems.join('\n')}`);
      const state = () => ({ stopped: doppel.commander.stopped, devices: doppel.devices.all.map((one) => one.state), alarms: doppel.devices.alarms.map((one) => one.alarm) });
      console.log(`the twin of '${name}':`, await page.evaluate(state).catch(() => 'no page'));
      throw problem;
    }
  }

  async stop() {
    await this.browser?.close();
    this.#end();
  }

  #end() {
    for (const child of this.#children) child.kill('SIGKILL');
  }
}
