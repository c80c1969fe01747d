// The Validate panel in Chromium: a run beside a twin whose arm starts with its gripper in the base, its evidence in the
// picture, the report, a phone.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Lab, robot, waitFor } from './lab.mjs';

const folder = mkdtempSync(join(tmpdir(), 'doppel-validate-'));
execFileSync(join(import.meta.dirname ?? '.', '../../../tests/broken_robots/make'), [folder, 'start_in_collision']);
const lab = new Lab(undefined, [join(folder, 'start_in_collision')]);
before(() => lab.start(), { timeout: 300000 });
after(async () => {
  await lab.stop();
  rmSync(folder, { recursive: true });
});

const check = (name, body, options = {}) => test(name, { timeout: 300000 }, async () => {
  const page = await lab.page(options);
  try {
    await page.evaluate(() => doppel.layout.open('validate'));
    await waitFor(page, () => doppel.validation.checks.length > 0, undefined, 60000);
    await lab.watched(name, page, () => body(page));
    assert.deepEqual(page.problems, []);
  } finally {
    await page.close();
  }
});
const state = (page) => page.evaluate(() => doppel.validation.run.state);
const ended = (page) => waitFor(page, () => !doppel.validation.running && doppel.validation.run.state !== 'none' && !doppel.validation.busy, undefined, 200000);

async function choose(page, ids) {
  const isOpen = await page.locator('.validate-choice').evaluate((one) => one.open);
  if (!isOpen) await page.click('.validate-choice > summary');
  for (const id of ids) await page.check(`.validate-checks input[value="${id}"]`);
  await page.click('.validate-choice > summary');
}

// Runs them and waits for the end.
async function run(page, ids) {
  await page.click('#validate-quick');
  await choose(page, ids);
  const number = await page.evaluate(() => doppel.validation.run.number);
  await page.click('#validate-run');
  await waitFor(page, (last) => doppel.validation.run.number > last, number, 60000);
  await ended(page);
}

check('the checks are listed by their kind, and those that are chosen are named', async (page) => {
  assert.match(await page.locator('.validate-state').textContent(), /Nothing has been validated/);
  assert.ok(await page.locator('#validate-cancel').isDisabled() && await page.locator('#validate-save').isDisabled());
  assert.equal(await page.locator('.validate-choice > summary').textContent(), 'Checks: all');
  await choose(page, ['G06', 'T3']);
  assert.equal(await page.locator('.validate-choice > summary').textContent(), 'Checks: G06, T3');
  assert.equal(await page.locator('.validate-checks legend').first().textContent(), 'Gates');
  assert.match(await page.locator('.validate-checks label', { hasText: 'T4' }).textContent(), /Step response/);
  assert.ok((await page.locator('#validate-joint option').allTextContents()).length > 3);
});

check('a failed check opens with message and fix, and its configuration is a ghost while the robot stays', async (page) => {
  await run(page, ['G06', 'T3']);
  assert.equal(await state(page), 'finished');
  const row = page.locator('#validate-row-T3');
  assert.equal(await row.locator('.validate-verdict').textContent(), '✗ failed');
  assert.equal(await row.locator('.validate-verdict .tag').evaluate((tag) => getComputedStyle(tag, '::before').content), 'none', 'expected one sign');
  assert.equal(await page.locator('#validate-row-G06 .validate-verdict').textContent(), '✓ passed');
  assert.ok(await row.evaluate((one) => one.open) && !await page.locator('#validate-row-G06').evaluate((one) => one.open));
  const item = row.locator('.validate-item', { hasText: 'start pose' }).first();
  assert.match(await item.locator('.validate-fix').textContent(), /^Fix: \S/);
  assert.match(await page.locator('.validate-judged').textContent(), /start_in_collision.*as the files are now/);
  assert.match(await page.locator('#tab-validate .badge').textContent(), /^✗ 1$/);
  const before = await page.evaluate(() => [...doppel.twin.target]);
  const show = item.locator('.show-pose').first();
  await show.scrollIntoViewIfNeeded();
  await show.click();
  assert.equal(await show.getAttribute('aria-pressed'), 'true');
  const links = await page.evaluate(() => doppel.evidence.shown.links);
  assert.ok(links.length >= 1, 'expected links that touch');
  assert.deepEqual(await page.evaluate(() => {
    const { plain, named } = doppel.evidence;
    const names = (view) => doppel.twin.tree.links.filter((_, i) => view.links[i].visible);
    return [plain.root.visible && named.root.visible, names(named).sort(), names(plain).length];
  }), [true, [...links].sort(), await page.evaluate(() => doppel.twin.tree.links.length) - links.length]);
  assert.match(await page.locator('.stage-legend').textContent(), new RegExp(links[0]));
  // The ghost is in the pose of the evidence.
  assert.ok(await page.evaluate(() => {
    const { shown, plain, named } = doppel.evidence;
    const { tree } = doppel.twin;
    const poses = doppel.driver.posesAt(tree.moving.filter((joint) => joint.name in shown.joints).map((joint) => [joint, shown.joints[joint.name]]));
    return tree.links.every((_, i) => [0, 1, 2].every((k) => Math.abs((named.links[i].visible ? named : plain).links[i].matrix.elements[12 + k] - poses[i * 7 + k]) < 1e-6));
  }));
  await show.click();
  assert.equal(await page.evaluate(() => doppel.evidence.plain.root.visible), false);
  // The robot holds its pose by servos, which give way by some tenths of a millirad.
  const held = await page.evaluate(() => [...doppel.twin.target]);
  assert.ok(held.every((q, i) => Math.abs(q - before[i]) < 2e-3), `expected the running robot at rest: ${held} and ${before}`);
  assert.match(await item.locator('code').first().textContent(), /^doppel move '?\w/);
});

check('Move asks before the running robot moves', async (page) => {
  await page.locator('#validate-row-T3').evaluate((one) => { one.open = true; });
  const move = page.locator('#validate-row-T3 .validate-pose button', { hasText: 'Move' }).first();
  await move.click();
  await page.locator('dialog.linked-pose', { hasText: 'the configuration of the validation' }).waitFor();
  await page.locator('dialog.linked-pose button', { hasText: 'Cancel' }).click();
});

check('numbers have their limits, and curves the name of their axis', async (page) => {
  await run(page, ['T4']);
  await page.locator('#validate-row-T4').evaluate((one) => { one.open = true; });
  const row = page.locator('#validate-row-T4');
  await row.locator('.evidence-plot canvas').first().scrollIntoViewIfNeeded();
  const inked = await row.locator('.evidence-plot canvas').first().evaluate((canvas) => {
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let i = 3; i < data.length; i += 4) if (data[i] > 100) count += 1;
    return count;
  });
  assert.ok(inked > 300, `${inked} pixels`);
  assert.deepEqual(await row.locator('thead th').allTextContents(), ['of', 'number', 'value', 'limit', 'unit']);
  assert.ok((await row.locator('tbody td:nth-child(4)').allTextContents()).some((text) => Number(text) > 0));
  assert.match(await row.locator('.validate-body > p').first().textContent(), /Decided by: .*Limit: .*10 %/);
  const axes = await page.evaluate(() => doppel.validation.results.get('T4').items.flatMap((item) => item.curves.map((one) => one.x_axis)));
  assert.ok(axes.length > 0 && axes.every((name) => name === 's'));
});

check('a run has progress, refuses a second one, is seen by other pages and can be cancelled', async (page) => {
  await page.click('#validate-full');
  await page.click('#validate-run');
  await waitFor(page, () => doppel.validation.running && doppel.validation.run.done > 0 && doppel.validation.run.check !== '', undefined, 60000);
  assert.ok(await page.locator('.validate progress').isVisible() && await page.locator('#validate-run').isDisabled());
  assert.match(await page.locator('.validate-state').textContent(), /^\d+ %: [TG]\d+ \S.*\(full\)/);
  const second = await page.evaluate(() => doppel.twin.client.call('/doppel/validate', { only: ['G06'] }));
  assert.equal(second.success, false);
  assert.match(second.message, /a validation runs already/);
  const other = await lab.page();
  await waitFor(other, () => doppel.validation.running);
  await other.close();
  await page.click('#validate-cancel');
  await ended(page);
  assert.equal(await state(page), 'cancelled');
  assert.match(await page.locator('.validate-state').textContent(), /^Cancelled at \d+ %/);
  assert.equal(await page.locator('#validate-run').isDisabled(), false);
});

check('a check that does not exist is refused with the nearest', async (page) => {
  await page.evaluate(() => doppel.validation.start('quick', ['T33'], ''));
  await waitFor(page, () => doppel.validation.problem !== '');
  assert.match(await page.locator('.validate [role="alert"]').textContent(), /T33.*did you mean 'T3'/);
});

check('the saved report links to this page', async (page) => {
  await run(page, ['T3']);
  const waiting = page.waitForEvent('download');
  await page.click('#validate-save');
  const download = await waiting;
  assert.match(download.suggestedFilename(), /-validation\.html$/);
  const html = readFileSync(await download.path(), 'utf8');
  assert.ok(html.includes(`${lab.url}?q=`) && !html.includes('127.0.0.1:8700'));
  assert.match(html, /<h1>✗ /);
});

for (const theme of ['light', 'dark']) {
  check(`a phone of 360 pixels shows it without a horizontal scroll, by keys, ${theme}`, async (page) => {
    await page.evaluate((name) => { document.documentElement.dataset.theme = name; dispatchEvent(new Event('themechange')); }, theme);
    await page.evaluate(() => doppel.layout.open('validate'));
    await page.locator('#validate-row-T3').evaluate((one) => { one.open = false; });
    await page.locator('#validate-row-T3 > summary').focus();
    await page.keyboard.press('Enter');
    assert.ok(await page.locator('#validate-row-T3').evaluate((one) => one.open));
    await page.locator('#validate-row-T3 .show-pose').first().waitFor();
    await page.keyboard.press('Tab');
    await page.keyboard.press('Enter');
    assert.ok(await page.evaluate(() => doppel.evidence.shown !== null), 'expected the first configuration by keys');
    assert.ok(await page.evaluate(() => {
      const panel = document.getElementById('panel-validate');
      return panel.scrollWidth <= panel.clientWidth + 1 && document.documentElement.scrollWidth <= innerWidth;
    }));
  }, { viewport: { width: 360, height: 740 }, isMobile: true, hasTouch: true });
}

test('a view has no Validate tab', { timeout: 120000 }, async () => {
  const view = await lab.run('view', [robot]);
  const page = await lab.page({}, view.url);
  await waitFor(page, () => doppel.commander.viewing);
  assert.equal(await page.locator('#tab-validate').isVisible(), false);
  await page.close();
  await view.end();
});
