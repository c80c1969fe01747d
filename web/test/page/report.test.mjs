// The HTML report of `doppel validate`, as a file without a network, and its links into the page. VALIDATION_TEST: the program
// that writes the example.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync, statSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { Lab, program, robot, sleep, waitFor } from './lab.mjs';

const lab = new Lab(undefined, [robot]);
const folder = mkdtempSync(join(tmpdir(), 'doppel-report-'));
const file = join(folder, 'index.html');
const writer = process.env.VALIDATION_TEST ?? join(dirname(program), 'validation_test');
before(async () => {
  execFileSync(writer, ['--gtest_filter=WrittenExample.*'], { env: { ...process.env, DOPPEL_EXAMPLE_REPORT: folder }, stdio: 'ignore' });
  await lab.start();
}, { timeout: 120000 });
after(async () => {
  await lab.stop();
  rmSync(folder, { recursive: true });
});

// The report in a context without a network; every request but that of the file is a failure, as is any message of the console.
const read = (name, options, body, prepare = async () => {}) => test(name, { timeout: 120000 }, async () => {
  const context = await lab.browser.newContext({ viewport: { width: 1100, height: 900 }, offline: true, ...options });
  const page = await context.newPage();
  const problems = page.problems = [];
  page.on('console', (message) => problems.push(message.text()));
  page.on('pageerror', (problem) => problems.push(problem.stack));
  page.on('request', (request) => request.url() === pathToFileURL(file).href || problems.push(request.url()));
  await prepare(page);
  await page.goto(pathToFileURL(file).href);
  try {
    await lab.watched(name, page, () => body(page));
    assert.deepEqual(problems, []);
  } finally {
    await context.close();
  }
});
const noScroll = (page) => page.evaluate(() => document.documentElement.scrollWidth <= innerWidth);
// The numbers of reddish and bluish pixels: the named links.
const coloured = (page, n = 0) => page.locator('.arm canvas').nth(n).evaluate((canvas) => {
  const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  let red = 0, blue = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (data[i] > data[i + 1] + 50 && data[i] > data[i + 2] + 50) red += 1;
    if (data[i + 2] > data[i] + 50) blue += 1;
  }
  return [red, blue];
});
const openAll = (page) => page.evaluate(() => document.querySelectorAll('details').forEach((one) => { one.open = true; }));

test('the report has less than 3 MB', () => assert.ok(statSync(file).size < 3e6, `${statSync(file).size} bytes`));

read('the report says the verdict first, then failures with their fix, gates, tests, environment', {}, async (page) => {
  assert.match(await page.locator('h1').textContent(), /failed/);
  assert.deepEqual(await page.locator('h2').allTextContents(), ['What failed', 'What a person should read', 'Gates', 'Tests', 'Environment']);
  assert.match(await page.locator('#T4-why .fix').first().textContent(), /lower the gain p/);
  assert.equal(await page.locator('.badge.failed').first().textContent(), '✗ failed');
  await page.locator('#T4 summary').click();
  assert.ok(await page.locator('#T4 table').isVisible());
  assert.ok(await noScroll(page));
});

read('the arm is drawn with its two named links, and a drag turns it', {}, async (page) => {
  await page.locator('.arm').first().scrollIntoViewIfNeeded();
  await waitFor(page, () => document.querySelector('.arm.live canvas'));
  const [red, blue] = await coloured(page);
  assert.ok(red > 1500 && blue > 1500, `${red} red, ${blue} blue pixels`);
  assert.equal(await page.locator('.arm svg').first().isVisible(), false);
  const picture = () => page.locator('.arm canvas').first().evaluate((canvas) => canvas.toDataURL());
  const first = await picture();
  const box = await page.locator('.arm canvas').first().boundingBox();
  await page.mouse.move(box.x + 300, box.y + 200);
  await page.mouse.down();
  await page.mouse.move(box.x + 380, box.y + 180, { steps: 4 });
  await page.mouse.up();
  assert.notEqual(await picture(), first);
  await page.locator('.arm canvas').first().dblclick();
  assert.equal(await picture(), first);
});

read('a phone of 360 pixels has no horizontal scroll, with everything open', { viewport: { width: 360, height: 740 }, isMobile: true, hasTouch: true }, async (page) => {
  assert.ok(await noScroll(page));
  await openAll(page);
  assert.ok(await noScroll(page));
});

read('without scripts the drawing is shown', { javaScriptEnabled: false }, async (page) => {
  assert.equal(await page.locator('.arm svg').count(), 2);
  assert.ok(await page.locator('.arm svg').first().isVisible());
  assert.ok(await page.locator('#G14-why code').last().isVisible());
});

read('without WebGL the drawing stays', {}, async (page) => {
  await page.locator('.arm').first().scrollIntoViewIfNeeded();
  await sleep(300);
  assert.equal(await page.locator('.arm canvas').count(), 0);
  assert.ok(await page.locator('.arm svg').first().isVisible());
  assert.ok(await page.locator('button.copy').first().isVisible());
}, (page) => page.addInitScript(() => { HTMLCanvasElement.prototype.getContext = () => null; }));

read('on paper the drawing replaces the canvas, and closed parts are open', {}, async (page) => {
  await page.locator('.arm').first().scrollIntoViewIfNeeded();
  await waitFor(page, () => document.querySelector('.arm.live canvas'));
  const pdf = await page.pdf({ preferCSSPageSize: true });
  assert.match(pdf.toString('latin1'), /\/MediaBox \[0 0 59[45][.\d]* 84[12]/); // A4, pt
  await page.emulateMedia({ media: 'print' });
  await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
  assert.ok(await page.locator('.arm svg').first().isVisible());
  assert.equal(await page.locator('.arm canvas').first().isVisible(), false);
  assert.ok(await page.locator('#T4 table').isVisible());
});

read('names of a description stay text', {}, async (page) => {
  assert.match(await page.locator('#G06-why').textContent(), /a <b> & "c" 'd' é€ \| `e` /);
  assert.equal(await page.locator('#G06-why .item b').count(), 1); // the bold subject, not the <b> in it
});

// The first link of the report, at another server.
async function linked(page, base) {
  const address = await page.locator('figcaption a').first().getAttribute('href');
  return base + new URL(address).search;
}
const joints = [['Revolute 1', 0.4], ['Revolute 2', 2.6], ['Revolute 3', 2.9], ['Revolute 4', 2.5]];
const isThere = (page) => waitFor(page, (pose) => pose.every(([name, value]) => Math.abs(doppel.twin.q[doppel.twin.tree.jointByName.get(name).index] - value) < 0.02), joints);

read('a link opens the configuration in the page of a view, at once', {}, async (report) => {
  const view = await lab.run('view', [robot]);
  try {
    const page = await lab.page({}, await linked(report, view.url));
    await isThere(page);
    assert.equal(await page.locator('dialog').count(), 0);
    assert.deepEqual(page.problems, []);
    await page.close();
  } finally {
    await view.end();
  }
});

read('a running twin is moved by a link only after a question', {}, async (report) => {
  const page = await lab.page({}, await linked(report, lab.url));
  await page.locator('dialog.linked-pose').waitFor();
  await page.locator('dialog.linked-pose button', { hasText: 'Cancel' }).click();
  await sleep(300);
  assert.ok(await page.evaluate((pose) => pose.every(([name, value]) => Math.abs(doppel.twin.target[doppel.twin.tree.jointByName.get(name).index] - value) > 0.5), joints));
  await page.reload();
  await page.locator('dialog.linked-pose button', { hasText: 'Move' }).click();
  await waitFor(page, (pose) => pose.every(([name, value]) => Math.abs(doppel.twin.target[doppel.twin.tree.jointByName.get(name).index] - value) < 1e-6), joints);
  assert.deepEqual(page.problems, []);
  await page.close();
});
