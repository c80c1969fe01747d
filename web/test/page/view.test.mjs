// `doppel view` of recordings: the program serves the page and the files, and the page shows them.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { makeBag, shoulderAt } from '../make_bag.mjs';
import { freePort, Lab, program, waitFor } from './lab.mjs';

const lab = new Lab();
const folder = mkdtempSync(join(tmpdir(), 'doppel-view-'));
before(async () => {
  writeFileSync(join(folder, 'my run.mcap'), await makeBag());
  writeFileSync(join(folder, 'second.mcap'), await makeBag({ offset: 0.1, compression: 'lz4' }));
  writeFileSync(join(folder, 'bare.mcap'), await makeBag({ describe: false, mesh: false }));
  writeFileSync(join(folder, 'cut.mcap'), (await makeBag()).slice(0, 70_000));
  mkdirSync(join(folder, 'split'));
  for (const [i, part] of [{ to: 3 }, { from: 3, to: 6 }, { from: 6 }].entries()) writeFileSync(join(folder, 'split', `split ${i}.mcap`), await makeBag(part));
  await lab.startBrowser();
}, { timeout: 120000 });
after(async () => {
  await lab.stop();
  rmSync(folder, { recursive: true });
});

// The program with these arguments; `body` gets the page at the address that it prints.
const check = (name, words, body, pictured = true) => test(name, { timeout: 180000 }, async () => {
  const child = spawn(program, ['view', ...words, '--headless', '--port', String(await freePort())], {
    cwd: folder, stdio: ['ignore', 'ignore', 'pipe'], env: { DOPPEL_ROOT: join(dirname(fileURLToPath(import.meta.url)), '../../..'), ...process.env },
  });
  const ended = new Promise((done) => child.once('exit', done));
  let page = null;
  try {
    let text = '';
    const address = await new Promise((done, failed) => {
      child.stderr.on('data', (part) => {
        text += part;
        const found = /\n {2}page +(\S+)\n/.exec(text);
        if (found) done(found[1]);
      });
      child.once('exit', () => failed(new Error(text)));
    });
    page = await lab.page({}, address, undefined, pictured);
    await lab.watched(name, page, () => body(page, text));
    assert.deepEqual(page.problems, []);
  } finally {
    await page?.close();
    child.kill('SIGINT');
    assert.equal(await ended, 0);
  }
});
const shoulder = (page, which) => page.evaluate((from) => {
  const { twin } = from === 'first' ? doppel : doppel.session.comparison;
  return twin.q[twin.tree.jointByName.get('shoulder').index];
}, which ?? 'first');
const shown = (page, time) => waitFor(page, (moment) => doppel.playback && !doppel.playback.isReading && Math.abs(doppel.playback.source.time - moment) < 0.011, time);
const near = (value, expected) => assert.ok(Math.abs(value - expected) < 1e-6, `${value} instead of ${expected}`);

check('a file is shown with its arm, meshes, curves and the time line', ['my run.mcap', '--at', '7.5'], async (page) => {
  await shown(page, 7.5);
  near(await shoulder(page), shoulderAt(7.5));
  assert.equal(await page.locator('.link').textContent(), 'recording my run.mcap');
  assert.equal(await page.locator('.bag-track').isVisible(), true);
  assert.equal(await page.locator('#stop').isVisible(), false);
  await waitFor(page, () => doppel.world.view?.loading === 0 && doppel.session.survey.isComplete);
  assert.deepEqual(await page.evaluate(() => doppel.world.view.failed), []);
  assert.equal(await page.evaluate(() => doppel.recorder.count), 501);
  const box = await page.locator('.bag-track').boundingBox();
  await page.mouse.click(box.x + box.width * 0.25, box.y + box.height / 2);
  await shown(page, 0.25 * 10.01);
  near(await shoulder(page), shoulderAt(2.5));
  await page.evaluate(() => {
    navigator.clipboard.writeText = (text) => ((window.copied = text), Promise.resolve());
  });
  await page.locator('#bag-link').click();
  await waitFor(page, () => window.copied);
  const copied = await page.evaluate(() => window.copied);
  const again = await lab.page({}, copied);
  await shown(again, 0.25 * 10.01);
  assert.deepEqual(again.problems, []);
  await again.close();
  if (process.env.SHOTS) await page.screenshot({ path: join(process.env.SHOTS, 'view_of_a_file.png') });
});

check('two recordings are compared', ['my run.mcap', 'second.mcap', '--at', '6'], async (page) => {
  await page.locator('.residuals tbody tr').first().waitFor();
  await shown(page, 6);
  await waitFor(page, () => doppel.session.comparison.twin.q[0] !== doppel.session.comparison.twin.q[1]);
  near((await shoulder(page, 'second')) - (await shoulder(page)), 0.1);
});

check('the files of a folder are on one time line', ['split', '--at', '7'], async (page, text) => {
  assert.match(text, /recording split, 3 files/);
  await shown(page, 7);
  near(await shoulder(page), shoulderAt(7));
  near(await page.evaluate(() => doppel.playback.length), 10.01);
  await page.evaluate(() => doppel.playback.seek(1));
  await shown(page, 1);
  near(await shoulder(page), shoulderAt(1));
});

check('without a description program and page say what is missing', ['bare.mcap'], async (page, text) => {
  assert.match(text, /bare\.mcap: it has no \/robot_description/);
  await page.locator('#bag-note').waitFor();
  assert.match(await page.locator('#bag-note').textContent(), /bare\.mcap has no \/robot_description/);
  assert.equal(await page.locator('.bag-track').isVisible(), true);
}, false);

check('a file that is cut off is shown up to there, with what to do', ['cut.mcap'], async (page, text) => {
  assert.match(text, /cut\.mcap: it was not closed or is cut off.*doppel bag recover/);
  await page.locator('#bag-note').waitFor();
  near(await shoulder(page), shoulderAt(0));
});
