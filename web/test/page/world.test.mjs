// A world without a robot: its objects are the picture, and nothing waits for a description.
import assert from 'node:assert/strict';
import { mkdtempSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Lab, waitFor } from './lab.mjs';

const file = join(mkdtempSync(join(tmpdir(), 'doppel-world-')), 'room.sdf');
const shape = '<geometry><box><size>4 3 2</size></box></geometry>';
writeFileSync(file, `<sdf version="1.9"><world name="room"><model name="house"><static>true</static><pose>30 0 1 0 0 0</pose><link name="l">
  <collision name="c">${shape}</collision><visual name="v">${shape}</visual></link></model></world></sdf>`);
const lab = new Lab(undefined, ['--world', file]);
let page;
before(async () => {
  await lab.start();
  page = await lab.page();
}, { timeout: 120000 });
after(() => lab.stop());

test('the picture shows the objects', async () => {
  await waitFor(page, () => doppel.objects.objects.size === 1);
  await waitFor(page, () => Math.abs(doppel.world.camera.controls.target.x - 30) < 0.1);
  assert.ok(await page.evaluate(() => doppel.world.size) > 5);
});

test('the page does not wait for a robot, and the panels say that there is none', async () => {
  assert.equal(await page.locator('.stage-note').isHidden(), true);
  await page.evaluate(() => doppel.layout.open('joints'));
  await page.getByText('This world has no robot.').first().waitFor();
  assert.equal(await page.locator('.robot-name').textContent(), 'doppel');
  assert.equal(await page.locator('.link').textContent(), 'connected');
  assert.equal(await page.evaluate(() => doppel.objects.missing), '');
  assert.deepEqual(page.problems, []);
});
