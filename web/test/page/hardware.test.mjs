// The Hardware and Calibrate panels in Chromium, on emulated arms: servos, the calibration of one whose horn has slipped,
// servos whose pose a person confirms, keep-out boxes, a phone.
import assert from 'node:assert/strict';
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before } from 'node:test';
import { armText, check, checkPhone, stateOf, textOf } from './desk_arm.mjs';
import { freePort, Lab, sleep, waitFor } from './lab.mjs';

const folder = mkdtempSync(join(tmpdir(), 'doppel-hardware-'));
process.env.XDG_STATE_HOME = join(folder, 'state');
const DEGREE = Math.PI / 180;

function write(name, text) {
  const file = join(folder, name);
  writeFileSync(file, text);
  return file;
}

const slipped = write('slipped.urdf', armText('doppel/FeetechSts'));
const faults = write('faults.yaml', 'faults: [{fault: slip, servo: 2, amount: 5 deg}]');
const world = write('desk.yaml', 'name: desk\nkeep_out:\n  - {name: monitor, box: [0.05, 0.5, 0.3], xyz: [0.45, 0, 0.2]}\n');
const emulated = new Lab(undefined, [slipped, '--emulate', '--hand', 'guide', '--faults', faults, '--world', world]);
const believed = new Lab(undefined, [write('believed.urdf', armText('doppel/ServoLine')), '--emulate']);
before(async () => {
  await emulated.start();
  believed.browser = emulated.browser;
  believed.twinPort = await freePort();
  await believed.startTwin();
  believed.url = `http://127.0.0.1:${believed.twinPort}/`;
}, { timeout: 300000 });
after(async () => {
  believed.browser = null; // it is that of `emulated`
  await believed.stop();
  await emulated.stop();
  rmSync(folder, { recursive: true, force: true });
});

const row = (name) => `.calibrate-joint[data-joint="${name}"]`;

async function agree(page) {
  await page.locator('dialog.confirm #confirm').click();
}
async function openJoint(page, name) {
  if (!await page.locator(row(name)).evaluate((one) => one.open)) await page.click(`${row(name)} > summary`);
}
async function release(page) {
  if (await stateOf(page) !== 'connected') {
    await page.click('#calibrate-release');
    await agree(page);
    await waitFor(page, () => doppel.devices.all[0].state === 'connected');
  }
}
// The hand of the emulation brings a joint there; the true joint, which the slipped horn shows wrongly.
async function guide(page, joint, degrees) {
  await page.evaluate(([name, q]) => doppel.calibration.guide(name, q), [joint, degrees * DEGREE]);
  await sleep(1500);
}

// -- the servos

check(emulated, 'hardware', 'the servos are listed with what they report, and the device in words', async (page) => {
  await waitFor(page, () => document.querySelectorAll('.devices tbody tr').length === 3);
  assert.deepEqual(await page.locator('.devices').first().locator('tbody th').allTextContents(), ['pan', 'lift', 'elbow']);
  assert.deepEqual(await page.locator('.devices').first().locator('thead th').allTextContents(), ['joint', 'id', 'position', 'goal', 'load', '°C', 'V', 'age', 'faults']);
  const panel = await textOf(page, '#panel-hardware');
  assert.doesNotMatch(panel, /active, active/);
  assert.match(panel, /holds|follows commands/);
  assert.match(panel, /[\d,]+ cycles · 0 answers lost/);
  const cells = await page.locator('.devices').first().locator('tbody tr').nth(1).locator('td').allTextContents();
  assert.equal(cells[0], '2');
  assert.match(cells[1], /^-?\d+\.\d °$/);
  assert.match(cells[5], /^\d+\.\d$/);
  assert.ok(await page.locator('.device-activate').first().isHidden());
});

check(emulated, 'hardware', 'keep-out boxes are in the picture, with their names and a layer', async (page) => {
  await waitFor(page, () => doppel.keepOut.names.length === 1);
  assert.deepEqual(await page.evaluate(() => [doppel.keepOut.names, doppel.keepOut.root.visible]), [['monitor'], true]);
  assert.ok(await page.evaluate(() => {
    const [box] = doppel.keepOut.root.children;
    return Math.abs(box.position.x - 0.45) < 1e-9 && box.children[0].material.transparent;
  }));
  await page.click('#layers');
  const layer = page.locator('.layer-list label', { hasText: 'Keep-out boxes' });
  assert.ok(await layer.locator('input').isChecked());
  await layer.click();
  assert.equal(await page.evaluate(() => doppel.keepOut.root.visible), false);
  await layer.click();
  assert.equal(await page.evaluate(() => doppel.keepOut.root.visible), true);
});

// -- calibration

check(emulated, 'calibrate', 'the guide shows the pose in the picture: the moving links, the axis and its direction', async (page) => {
  assert.match(await textOf(page, '.calibrate'), /0 of 3 joints are done. Left: pan, lift, elbow/);
  await openJoint(page, 'lift');
  await waitFor(page, () => doppel.calibrationGhost.target?.joint === 'lift');
  assert.deepEqual(await page.evaluate(() => doppel.calibrationGhost.moved), ['upper', 'fore']);
  assert.deepEqual(await page.evaluate(() => doppel.twin.tree.links.filter((_, i) => doppel.calibrationGhost.view.links[i].visible)), ['upper', 'fore']);
  assert.match(await textOf(page, '.stage-legend'), /lift.*at 0\.0 °.*positive direction/);
  await page.click(`${row('lift')} li:nth-child(2) button:has-text("Pose B")`);
  assert.match(await textOf(page, '.stage-legend'), /at 90\.0 °/);
  // The ghost turns about the axis of the joint, whose tip moves by a right angle.
  assert.ok(await page.evaluate(() => {
    const { view } = doppel.calibrationGhost;
    const m = view.links[doppel.twin.tree.linkIndex.get('upper')].matrix.elements;
    return Math.abs(m[10]) < 0.05; // its z axis lies
  }));
  await page.evaluate(() => doppel.layout.open('hardware'));
  assert.equal(await page.evaluate(() => doppel.calibrationGhost.view.root.visible), false);
});

check(emulated, 'calibrate', 'two poses of a joint by hand give its zero, which is written after a question and undone', async (page) => {
  await release(page);
  assert.match(await textOf(page, '.calibrate'), /torque off/);
  await openJoint(page, 'lift');
  await guide(page, 'lift', 0);
  assert.match(await textOf(page, `${row('lift')} .calibrate-live`), /the servo reads now: -?5\.\d °/);
  await page.click(`${row('lift')} #calibrate-measure-0`);
  await page.locator(`${row('lift')} li:nth-child(1) .calibrate-read`).waitFor();
  assert.match(await textOf(page, `${row('lift')} .tag`), /1 of 2 poses/);
  // Too close is refused with the reason, before anything is measured.
  const second = page.locator(`${row('lift')} li:nth-child(2) input`);
  await second.fill('30');
  await second.press('Enter');
  await page.click(`${row('lift')} #calibrate-measure-1`);
  await waitFor(page, () => doppel.calibration.problem !== '');
  assert.match(await textOf(page, '.calibrate > [role="alert"]'), /30 deg apart; with less than 60 deg/);
  await second.fill('90');
  await second.press('Enter');
  await guide(page, 'lift', 90);
  await page.click(`${row('lift')} #calibrate-measure-1`);
  await page.locator('.calibrate-result').waitFor();
  const result = await textOf(page, '.calibrate-result');
  assert.match(result, /at the zero-?[45]\.\d+\s°was wrong by [45]\.\d+\s°/);
  assert.match(result, /directionthe same/);
  assert.match(result, /scale(1\.0|0\.99)/);
  assert.match(await textOf(page, '#tab-calibrate .badge'), /1/);
  const overlay = join(folder, 'slipped.overlay.yaml');
  assert.ok(!existsSync(overlay), 'nothing is written unasked');
  await page.click('#calibrate-write');
  assert.match(await textOf(page, 'dialog.confirm'), /Write the correction of lift\?.*zero/);
  await agree(page);
  await waitFor(page, () => doppel.calibration.joints.find((one) => one.joint === 'lift').written);
  assert.match(readFileSync(overlay, 'utf8'), /bake_zero/);
  assert.match(await textOf(page, '.calibrate'), /1 of 3 joints are done. Left: pan, elbow/);
  assert.match(await textOf(page, '.calibrate-file'), /slipped\.overlay\.yaml/);
  await page.click('#calibrate-undo');
  await waitFor(page, () => !doppel.calibration.joints.find((one) => one.joint === 'lift').written);
  assert.ok(!existsSync(overlay), 'the file is as before');
  assert.ok(await page.locator('#calibrate-undo').isHidden());
});

check(emulated, 'calibrate', 'a joint that moves while it is measured is refused, and the arm holds again', async (page) => {
  await release(page);
  await openJoint(page, 'elbow');
  const moving = page.evaluate(async () => { // a busy machine begins the measurement late
    const end = Date.now() + 60000;
    for (let i = 0; i < 45 || (doppel.calibration.problem === '' && Date.now() < end); i += 1) {
      await doppel.calibration.guide('elbow', i % 2 === 0 ? 0.8 : -0.8);
      await new Promise((done) => setTimeout(done, 100));
    }
  });
  await page.click(`${row('elbow')} #calibrate-measure-0`);
  await waitFor(page, () => doppel.calibration.problem !== '', undefined, 60000);
  assert.match(await textOf(page, '.calibrate > [role="alert"]'), /'elbow' moves; .*hold it still/);
  await moving;
  await sleep(500);
  await page.click('#calibrate-hold');
  await waitFor(page, () => ['holding', 'active'].includes(doppel.devices.all[0].state));
  await waitFor(page, () => doppel.twin.controllers.some((one) => one.state === 'active' && one.joints.includes('elbow')));
});

check(emulated, 'calibrate', 'by keys: a joint is opened, and a pose is measured', async (page) => {
  await page.locator(`${row('pan')} > summary`).focus();
  if (!await page.locator(row('pan')).evaluate((one) => one.open)) await page.keyboard.press('Enter');
  await page.locator(`${row('pan')} #calibrate-measure-0`).focus();
  await page.keyboard.press('Enter');
  await page.locator(`${row('pan')} .calibrate-read`).waitFor();
  await page.click(`${row('pan')} #calibrate-forget`);
  await waitFor(page, () => doppel.calibration.joints.every((one) => one.measurements.length === 0));
});

// -- servos that report nothing

check(believed, 'hardware', 'a pose that nobody knows is entered, shown in the picture, confirmed and believed', async (page) => {
  await waitFor(page, () => document.querySelector('.device-pose')?.hidden === false);
  assert.match(await textOf(page, '#panel-hardware'), /pose not confirmed/);
  const lift = page.locator('.device-joints label', { hasText: 'lift' }).locator('input');
  await lift.fill('200');
  await page.click('.device-confirm');
  await agree(page);
  await page.locator('.device-pose [role="alert"]', { hasText: 'outside of the limits' }).waitFor();
  await lift.fill('30');
  assert.ok(await page.evaluate(() => doppel.evidence.plain.root.visible), 'the picture shows what is entered');
  assert.ok(await page.evaluate(() => Math.abs(doppel.evidence.shown.joints.lift - 0.5236) < 1e-3));
  for (const name of ['pan', 'elbow']) await page.locator('.device-joints label', { hasText: name }).locator('input').fill('0');
  await page.click('.device-confirm');
  assert.match(await textOf(page, 'dialog.confirm'), /Does the arm stand as the picture shows it/);
  await agree(page);
  await waitFor(page, () => ['holding', 'active'].includes(doppel.devices.all[0].state)); // the start has waited for it
  await page.locator('.devices tbody tr').nth(1).locator('td').nth(1).filter({ hasText: /^\(30\.\d °\)$/ }).waitFor();
  assert.match(await textOf(page, '.device-facts'), /believed, not measured/);
  await page.evaluate(() => doppel.layout.open('calibrate'));
  assert.match(await textOf(page, '.calibrate'), /report no position/);
  assert.ok(await page.locator('#calibrate-release').isHidden());
});

checkPhone(emulated, 'calibrate', 'the calibration');
checkPhone(emulated, 'hardware', 'servos');
checkPhone(believed, 'hardware', 'servos that report nothing');
