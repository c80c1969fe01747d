// The twin beside an arm that another program emulates behind a port: the mirror, an alarm, the torque off, STOP, a phone.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before } from 'node:test';
import { armText, check, checkPhone, textOf } from './desk_arm.mjs';
import { freePort, Lab, program, sleep, until, waitFor } from './lab.mjs';

const folder = mkdtempSync(join(tmpdir(), 'doppel-mirror-'));
process.env.XDG_STATE_HOME = join(folder, 'state');
const faults = join(folder, 'faults.yaml');
const setFaults = (text) => writeFileSync(faults, `faults: ${text}\n`);
const beside = new Lab(undefined, [join(folder, 'real.urdf'), 'use_sim:=false']);
let arm = null;

before(async () => {
  setFaults('[]');
  writeFileSync(join(folder, 'arm.urdf'), armText('doppel/FeetechSts'));
  arm = spawn(program, ['emulate', join(folder, 'arm.urdf'), '--headless', '--no-reload', '--port', String(await freePort()), '--faults', faults], { stdio: ['ignore', 'pipe', 'pipe'] });
  let output = '';
  for (const stream of [arm.stdout, arm.stderr]) stream.on('data', (data) => (output += data));
  await until('the emulated port', async () => /\/dev\/pts\/\d+/.test(output) && /page +http/.test(output));
  const [port] = /\/dev\/pts\/\d+/.exec(output);
  // A machine that is busy with other work answers late.
  writeFileSync(join(folder, 'real.urdf'), armText('doppel/FeetechSts', `<param name="port">${port}</param><param name="max_lost_replies">500</param><param name="fault_after">10</param>`));
  await beside.start();
}, { timeout: 300000 });
after(async () => {
  await beside.stop();
  arm?.kill('SIGKILL');
  rmSync(folder, { recursive: true, force: true });
});

check(beside, 'hardware', 'the mirror shows its mode and each joint, an alarm is a badge, and STOP holds', async (page) => {
  await waitFor(page, () => doppel.devices.mirror !== null);
  assert.match(await textOf(page, '#panel-hardware'), /Mode shadow: the twin gets the commands/);
  await waitFor(page, () => document.querySelectorAll('.mirror tbody tr').length === 3);
  await waitFor(page, () => doppel.commander.canMove(doppel.twin.tree.jointByName.get('pan')));
  await page.evaluate(() => {
    const { twin, commander } = doppel;
    commander.setMany([[twin.tree.jointByName.get('pan'), 0.5]]);
  });
  await waitFor(page, () => Math.abs(doppel.twin.q[doppel.twin.tree.jointByName.get('pan').index] - 0.5) < 0.05);
  await sleep(2500);
  assert.match(await page.locator('.mirror tbody tr').first().locator('td').first().textContent(), /^-?\d\.\d\d °$/);
  assert.ok(await page.locator('#tab-hardware .badge').isHidden().catch(() => true));
  setFaults('[{fault: slip, servo: 1, amount: 12 deg}]');
  await waitFor(page, () => doppel.devices.alarms.length === 1, undefined, 20000);
  await waitFor(page, () => /✕ 1/.test(document.querySelector('#tab-hardware .badge')?.textContent ?? ''));
  await waitFor(page, () => /✕ [a-z ]+: /.test(document.querySelector('.mirror tbody').textContent)); // the cause in words
  assert.match(await textOf(page, '.stage-legend'), /twin/);
  await page.click('button.stop, #stop');
  await waitFor(page, () => doppel.commander.stopped);
  await waitFor(page, () => /stopped, holds/.test(document.getElementById('panel-hardware').textContent));
  const held = await page.evaluate(() => doppel.devices.all[0].joints[0].position);
  await sleep(1000);
  assert.ok(Math.abs(await page.evaluate(() => doppel.devices.all[0].joints[0].position) - held) < 0.01, 'expected the arm at rest');
  setFaults('[]');
});

checkPhone(beside, 'hardware', 'the mirror');
