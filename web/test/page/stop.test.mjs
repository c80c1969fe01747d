// The emergency stop of the page in Chromium: with every dialog and list open, by mouse, key and touch, without a
// connection and without WebGL.
import assert from 'node:assert/strict';
import { execFile } from 'node:child_process';
import { after, before, test } from 'node:test';
import { promisify } from 'node:util';
import { Lab, program, sleep, until, waitFor } from './lab.mjs';

const lab = new Lab(undefined, ['lab_arm']);
let page;
before(async () => {
  await lab.start();
  page = await lab.page({ viewport: { width: 1200, height: 800 } });
}, { timeout: 120000 });
after(() => lab.stop());

const shell = (...args) => promisify(execFile)(program, [...args, '--port', String(lab.twinPort)]).then(({ stdout }) => ({ code: 0, text: stdout }), (e) => ({ code: e.code, text: e.stderr + e.stdout }));
const stopped = (on, one = page) => waitFor(one, (wanted) => doppel.commander.stopped === wanted, on);
// The page shows a stop when it sends it, before the twin has it.
const twinStopped = (on) => until(`a twin whose stop is ${on}`, async () => (await shell('topic', 'echo', '/controller_manager/emergency_stop_active', '--once')).text.includes(`data: ${on}`));
const check = (name, body) => test(name, { timeout: 180000 }, async () => {
  await page.evaluate(() => doppel.commander.stopped && doppel.commander.resetStop());
  await stopped(false);
  page.problems.length = 0;
  await lab.watched(name, page, body);
  assert.deepEqual(page.problems, []);
});

const DIALOGS = {
  settings: () => page.click('#settings'),
  picture: async () => {
    await page.evaluate(() => doppel.layout.open('sensors'));
    await page.locator('.picture canvas').first().waitFor();
    await page.locator('.picture').first().click();
  },
  paste: async () => {
    await page.evaluate(() => Object.defineProperty(navigator, 'clipboard', { value: undefined, configurable: true }));
    await page.evaluate(() => doppel.layout.open('joints'));
    await page.getByRole('button', { name: 'Go to the pose on the clipboard' }).click();
  },
};
for (const [name, open] of Object.entries(DIALOGS)) {
  check(`with the dialog '${name}' open, a click on STOP stops the twin`, async () => {
    await open();
    await page.locator('dialog[open]').waitFor();
    await page.click('#stop', { timeout: 30000 });
    await stopped(true);
    await twinStopped(true);
    assert.equal(await page.locator('dialog[open]').count(), 1, 'the dialog stays');
    await page.keyboard.press('Escape');
    await page.locator('dialog').waitFor({ state: 'detached' });
  });
  check(`with the dialog '${name}' open, Escape stops the twin and closes the dialog`, async () => {
    await open();
    await page.locator('dialog[open]').waitFor();
    if (name === 'paste') await page.locator('dialog textarea').focus();
    await page.keyboard.press('Escape');
    await stopped(true);
    await page.locator('dialog').waitFor({ state: 'detached' });
    assert.equal(await page.evaluate(() => document.querySelector('.work').inert), false);
  });
}

check('Escape stops and closes the list of layers', async () => {
  await page.click('#layers');
  await page.keyboard.press('Escape');
  await stopped(true);
  assert.equal(await page.locator('.layer-list').isVisible(), false);
});

check('Escape stops and closes the list of panels', async () => {
  await page.setViewportSize({ width: 1000, height: 700 });
  await page.evaluate(() => doppel.settings.rightWidth = 280);
  await page.evaluate(() => document.querySelector('.work').style.setProperty('--right', '280px'));
  await page.locator('.dock.right .more-tabs').click();
  assert.equal(await page.locator('.dock.right .tab-list').isVisible(), true);
  await page.keyboard.press('Escape');
  await stopped(true);
  assert.equal(await page.locator('.dock.right .tab-list').isVisible(), false);
});

check('every panel is reached by the list of panels, also where its tab does not fit', async () => {
  for (const title of ['Control', 'Health']) {
    await page.locator('.dock.right .more-tabs').click();
    await page.getByRole('menuitem', { name: title }).click();
    assert.equal(await page.locator(`#panel-${title.toLowerCase()}`).isVisible(), true);
  }
  await page.evaluate(() => document.querySelector('.work').style.setProperty('--right', '400px'));
  await page.setViewportSize({ width: 1200, height: 800 });
});

check('Escape in a field stops and keeps the text', async () => {
  await page.evaluate(() => doppel.layout.open('topics'));
  const field = page.getByLabel('Search topics and services');
  await field.fill('joint');
  await field.press('Escape');
  await stopped(true);
  assert.equal(await field.inputValue(), 'joint');
  await field.fill('');
});

check('Escape in the open list of a select element stops', async () => {
  await page.locator('#speed').click();
  await sleep(300);
  await page.keyboard.press('Escape');
  await stopped(true);
});

// WCAG's contrast of the computed colours of text and ground.
const contrast = (one) => one.evaluate(() => {
  const luminance = (text) => {
    const [r, g, b] = /rgba?\(([^)]+)\)/.exec(text)[1].split(/[, /]+/).map((v) => {
      const c = Number(v) / 255;
      return c <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4;
    });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const style = getComputedStyle(document.getElementById('stop'));
  const [a, b] = [luminance(style.color), luminance(style.backgroundColor)];
  return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
});
for (const theme of ['light', 'dark']) {
  check(`the label of STOP is legible before, under and after the mouse (${theme})`, async () => {
    await page.evaluate((value) => {
      doppel.settings.theme = value;
      document.documentElement.dataset.theme = value;
    }, theme);
    const seen = { before: await contrast(page) };
    await page.hover('#stop');
    seen.hovered = await contrast(page);
    await page.mouse.down();
    seen.down = await contrast(page);
    await page.mouse.up();
    await stopped(true);
    seen.pressed = await contrast(page);
    await page.mouse.down();
    seen.downAgain = await contrast(page);
    await page.mouse.up();
    await stopped(false);
    for (const [state, value] of Object.entries(seen)) assert.ok(value >= 4.5, `${state}: ${value.toFixed(2)}`);
  });
}

check('the label of STOP is legible after a tap', async () => {
  const context = await lab.browser.newContext({ viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
  const phone = await context.newPage();
  await phone.goto(lab.url);
  await waitFor(phone, () => window.doppel?.ready);
  await phone.tap('#stop');
  await stopped(true, phone);
  assert.equal(await phone.locator('#stop').textContent(), 'Reset STOP');
  assert.ok((await contrast(phone)) >= 4.5);
  await phone.tap('#stop');
  await stopped(false, phone);
  await context.close();
});

check('STOP refuses the commands of other clients, and the page shows the stop of another client', async () => {
  await page.keyboard.press('Escape');
  await stopped(true);
  const joint = await page.evaluate(() => doppel.twin.tree.moving[0].name);
  assert.notEqual((await shell('move', `${joint}=0.1`)).code, 0);
  assert.equal((await shell('stop', '--reset')).code, 0);
  await stopped(false);
  assert.equal((await shell('stop')).code, 0);
  await stopped(true);
  assert.equal(await page.locator('#stop').textContent(), 'Reset STOP');
  await page.click('#stop');
  await stopped(false);
  await waitFor(page, () => doppel.twin.controllers.some((c) => c.state === 'active' && c.joints.length > 0));
});

test('a lost twin leaves its picture, says what to do, and is stopped when it is back', { timeout: 180000 }, async () => {
  const shown = () => page.evaluate(() => {
    const { stage } = doppel.world;
    const ratio = stage.renderer.getPixelRatio(); // follows the speed of the machine, and with it how wide a line is
    stage.renderer.setPixelRatio(1);
    stage.renderer.render(stage.scene, stage.camera);
    const canvas = document.createElement('canvas');
    canvas.width = 120;
    canvas.height = 90;
    const context = canvas.getContext('2d');
    context.drawImage(stage.renderer.domElement, 0, 0, 120, 90);
    stage.renderer.setPixelRatio(ratio);
    stage.invalidate();
    return [...context.getImageData(0, 0, 120, 90).data].filter((_, i) => i % 4 === 3).filter((alpha) => alpha > 0).length;
  });
  const before = await shown();
  assert.ok(before > 300, `${before} pixels`);
  const tabs = await page.locator('.tab:visible').count();
  await lab.killTwin();
  await waitFor(page, () => doppel.twin.client.phase === 'lost');
  await page.locator('.lost-note').waitFor();
  assert.match(await page.locator('.lost-note').textContent(), /No connection to the twin for \d+ s\..*Start the twin again: doppel up lab_arm/s);
  assert.ok(Math.abs((await shown()) - before) < 0.05 * before, 'the picture stays');
  assert.match(await page.evaluate(() => getComputedStyle(document.querySelector('.view3d')).filter), /grayscale/);
  await waitFor(page, () => / – lost$/.test(document.title));
  assert.equal(await page.locator('.tab:visible').count(), tabs);
  assert.equal(await page.locator('.robot-name').textContent(), await page.evaluate(() => doppel.twin.tree.robot.name));
  await page.click('#stop');
  await page.getByText('STOP is sent as soon as the connection is back.').waitFor();
  await lab.startTwin();
  await page.getByRole('button', { name: /^Connect now/ }).click({ timeout: 2000 }).catch(() => {}); // it may be connected by now
  await waitFor(page, () => doppel.twin.client.phase === 'open' && !doppel.commander.unsent);
  await twinStopped(true);
  await page.click('#stop');
  await stopped(false);
  await twinStopped(false);
});

test('without WebGL the panels and STOP work, and the page says why there is no picture', { timeout: 180000 }, async () => {
  await lab.browser.close();
  await lab.startBrowser(['--disable-3d-apis']);
  page = await lab.page({ viewport: { width: 1200, height: 800 } });
  assert.match(await page.locator('.undrawn').textContent(), /does not draw WebGL 2.*hardware acceleration/);
  const slider = page.locator('.joint .slider').first();
  const from = await page.evaluate(() => doppel.twin.q[doppel.twin.tree.moving[0].index]);
  await slider.focus();
  for (let i = 0; i < 5; i += 1) await page.keyboard.press('ArrowRight');
  await waitFor(page, (q) => Math.abs(doppel.twin.q[doppel.twin.tree.moving[0].index] - q) > 0.02, from);
  await page.click('#stop');
  await stopped(true);
  for (const id of await page.evaluate(() => [...document.querySelectorAll('[role=tab]:not([hidden])')].map((tab) => tab.id.slice(4)))) {
    await page.evaluate((name) => doppel.layout.open(name), id);
    assert.ok(await page.locator(`#panel-${id}`).isVisible(), id);
  }
  assert.deepEqual(page.problems.filter((text) => !/WebGL/.test(text)), []);
});
