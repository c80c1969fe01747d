// Two twins with the same names in one domain of ROS 2, as those of two users of a machine: the page of each shows its own
// robot and its own time, beside the other one and after its end.
import assert from 'node:assert/strict';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { execFile } from 'node:child_process';
import { promisify } from 'node:util';
import { freePort, Lab, program, robot, sleep, until, waitFor } from './lab.mjs';

const folder = mkdtempSync(join(tmpdir(), 'doppel-twins-'));
process.env.ROS_AUTOMATIC_DISCOVERY_RANGE = 'LOCALHOST';
process.env.ROS_DOMAIN_ID = String(40 + (process.pid % 30));
const kate = new Lab(undefined, ['kate']);
const arm = new Lab(undefined, [robot]);
// A twin finds those of its user by this folder, and refuses their names.
const startAs = async (user, lab) => {
  process.env.XDG_RUNTIME_DIR = mkdtempSync(join(folder, user));
  lab.twinPort = await freePort();
  await lab.startTwin();
  lab.url = `http://127.0.0.1:${lab.twinPort}/`;
};
before(async () => {
  await startAs('one', kate);
  await startAs('two', arm);
  await kate.startBrowser();
  arm.browser = kate.browser;
  const publishers = async () => (await promisify(execFile)(program, ['--remote', 'topic', 'info', '/robot_description'])).stdout;
  await until('both twins on the network', async () => /Publisher count: 2/.test(await publishers()), 60000);
  await sleep(2000); // they have found each other, as the third program has
}, { timeout: 300000 });
after(async () => {
  arm.browser = null; // it is that of `kate`
  await arm.stop();
  await kate.stop();
  rmSync(folder, { recursive: true, force: true });
});

const facts = (page) => page.evaluate(() => ({ title: document.title, joints: doppel.twin.tree.moving.map((joint) => joint.name) }));
// Times that the page shows during two seconds.
const times = (page) => page.evaluate(async () => {
  const out = [];
  for (let i = 0; i < 40; ++i) {
    out.push(doppel.twin.simTime);
    await new Promise((done) => setTimeout(done, 50));
  }
  return out;
});
async function showsOwn(lab, title, joint, other) {
  const page = await lab.page();
  try {
    await waitFor(page, (name) => doppel.twin.tree.moving.some((one) => one.name === name), joint);
    const shown = await times(page);
    assert.ok(shown.every((time, i) => i === 0 || time >= shown[i - 1]), `expected no other clock: ${shown}`);
    const { title: found, joints } = await facts(page);
    assert.match(found, title);
    assert.ok(!joints.includes(other), `${joints}`);
    assert.deepEqual(page.problems, []);
  } finally {
    await page.close();
  }
}

test('the page of each shows its own robot', { timeout: 180000 }, async () => {
  await showsOwn(kate, /kate/, 'left_wheel_joint', 'Revolute 1');
  await showsOwn(arm, /omarm/, 'Revolute 1', 'left_wheel_joint');
});

test('after the end of the other one as well', { timeout: 180000 }, async () => {
  await arm.killTwin();
  await showsOwn(kate, /kate/, 'left_wheel_joint', 'Revolute 1');
});

// The page of `doppel emulate` with these arguments, as a new visitor sees it.
async function ofEmulation(args, body) {
  const { url, end } = await kate.run('emulate', ['desk_arm', ...args]);
  const page = await kate.page({}, url, (one) => one.addInitScript(() => localStorage.clear()));
  try {
    await waitFor(page, () => document.title === 'desk_arm, emulated');
    await body(page);
    assert.deepEqual(page.problems, []);
  } finally {
    await page.close();
    await end();
  }
}

test('an emulated arm is named so, and its page has no STOP of its own', { timeout: 180000 }, () => ofEmulation([], async (page) => {
  assert.equal(await page.locator('#stop').isVisible(), false);
  assert.equal(await page.locator('.hints').isVisible(), false);
  await page.keyboard.press('Escape');
  assert.equal(await page.evaluate(() => document.body.classList.contains('stopped')), false);
}));

test('the page that commands the hand of an emulated arm has a STOP for it', { timeout: 180000 }, () => ofEmulation(['--hand', 'guide'], async (page) => {
  await waitFor(page, () => doppel.twin.controllers.length > 0);
  await page.locator('#stop').waitFor();
  await page.locator('.hints').waitFor();
  await page.keyboard.press('Escape');
  await waitFor(page, () => document.body.classList.contains('stopped'));
}));
