// The page in real Chromium against a running twin. Each test begins with the arm at rest where it started.
import assert from 'node:assert/strict';
import { after, before } from 'node:test';
import { Lab, until, waitFor } from './lab.mjs';

const lab = new Lab();
before(() => lab.start(), { timeout: 120000 });
after(() => lab.stop());

const set = (page, name, value) => page.evaluate(([n, v]) => doppel.commander.set(doppel.twin.tree.jointByName.get(n), v), [name, value]);
const near = (page, name, value, width = 0.02) => waitFor(page, ([n, v, w]) => Math.abs(doppel.twin.q[doppel.twin.tree.jointByName.get(n).index] - v) < w, [name, value, width]);
const at = (page, name) => page.evaluate((n) => doppel.twin.q[doppel.twin.tree.jointByName.get(n).index], name);
const frames = (page, count) => page.evaluate(async (n) => {
  for (let i = 0; i < n; i += 1) await new Promise(requestAnimationFrame);
}, count);
const ran = async (page, seconds) => {
  const from = await page.evaluate(() => doppel.twin.simTime);
  await waitFor(page, ([t, s]) => doppel.twin.simTime > t + s, [from, seconds]);
};

// What of the picture belongs to the arm: pixels that the arm's visibility changes.
async function armPixels(page) {
  return new Set(await page.evaluate(() => {
    const { stage, view } = doppel.world;
    const shot = () => {
      stage.renderer.render(stage.scene, stage.camera);
      const canvas = document.createElement('canvas');
      canvas.width = 200;
      canvas.height = 150;
      const context = canvas.getContext('2d', { willReadFrequently: true });
      context.drawImage(stage.renderer.domElement, 0, 0, 200, 150);
      return context.getImageData(0, 0, 200, 150).data;
    };
    doppel.handle.show(false);
    stage.frame.emit(0);
    const withArm = shot();
    view.root.visible = false;
    const without = shot();
    view.root.visible = true;
    doppel.handle.show(true);
    const out = [];
    for (let i = 0; i < withArm.length; i += 4) {
      if ([0, 1, 2].some((k) => Math.abs(withArm[i + k] - without[i + k]) > 24)) out.push(i / 4);
    }
    return out;
  }));
}

function changed(before, now) {
  return [...now].filter((i) => !before.has(i)).length + [...before].filter((i) => !now.has(i)).length;
}

lab.check('the arm is in the picture, and nothing is on the console', async () => {
  const page = await lab.page();
  const arm = await armPixels(page);
  assert.ok(arm.size > 600, `${arm.size} pixels`);
  assert.deepEqual(page.problems, []);
  const first = await page.evaluate(() => doppel.world.firstPicture);
  console.log(`first picture ${Math.round(first)} ms`);  // bench/page.mjs measures it
  await page.close();
});

lab.check('a slider moves its joint, and the picture shows it', async (page) => {
  const before = await armPixels(page);
  const slider = page.locator('.joint', { hasText: 'Revolute 1' }).first().locator('.slider');
  await slider.focus();
  await slider.evaluate((element) => {
    element.value = '2.4';
    element.dispatchEvent(new Event('input', { bubbles: true }));
    element.dispatchEvent(new Event('change', { bubbles: true }));
  });
  await near(page, 'Revolute 1', 2.4);
  const many = changed(before, await armPixels(page));
  assert.ok(many > 100, `${many} pixels`);
});

lab.check('a slider is moved by the keyboard', async (page) => {
  const before = await at(page, 'Revolute 1');
  await page.locator('.joint', { hasText: 'Revolute 1' }).first().locator('.slider').focus();
  for (let i = 0; i < 5; i += 1) await page.keyboard.press('ArrowLeft');
  await waitFor(page, (q) => doppel.twin.q[0] < q - 0.05, before);
});

lab.check('a trajectory moves the arm, and the picture shows it', async (page) => {
  const before = await armPixels(page);
  await page.evaluate(() => {
    const { tree, q } = doppel.twin;
    const to = Float64Array.from(q);
    to[tree.jointByName.get('Revolute 2').index] = 0.9;
    doppel.commander.play([{ time: 1, positions: to }]);
  });
  await near(page, 'Revolute 2', 0.9);
  const many = changed(before, await armPixels(page));
  assert.ok(many > 100, `${many} pixels`);
});

lab.check('two pages agree: pose, pause and speed', async (page) => {
  const other = await lab.page();
  try {
    await set(page, 'Revolute 1', 1.2);
    await near(other, 'Revolute 1', 1.2);
    await near(page, 'Revolute 1', 1.2);
    await waitFor(other, () => Math.abs(doppel.twin.target[doppel.twin.tree.jointByName.get('Revolute 1').index] - 1.2) < 0.01);
    await page.selectOption('#speed', '0.5');
    await waitFor(other, () => doppel.twin.status?.speed === 0.5 && document.getElementById('speed').value === '0.5');
    await page.click('#play');
    await waitFor(other, () => doppel.twin.paused && document.getElementById('play').title.startsWith('Play'));
    await waitFor(page, () => doppel.twin.paused);
    assert.ok(Math.abs((await at(page, 'Revolute 1')) - (await at(other, 'Revolute 1'))) < 0.005);
    assert.deepEqual(other.problems, []);
  } finally {
    await other.close();
  }
});

lab.check('the handle is dragged with the mouse, without a jump', async (page) => {
  const start = await page.evaluate(() => [...doppel.driver.commanded().slice(0, 3)]);
  let at;
  await until('the handle under the mouse', async () => {
    at = await page.evaluate(() => {
      const { stage } = doppel.world;
      const p = doppel.world.toolPosition().project(stage.camera);
      const box = stage.renderer.domElement.getBoundingClientRect();
      return { x: box.left + ((p.x + 1) / 2) * box.width, y: box.top + ((1 - p.y) / 2) * box.height };
    });
    await page.mouse.move(at.x + 1, at.y);
    await page.mouse.move(at.x, at.y);
    await frames(page, 2);
    return page.evaluate(() => doppel.handle.controls.axis !== null);
  });
  await page.mouse.down();
  const first = await page.evaluate(() => [...doppel.driver.commanded().slice(0, 3)]);
  assert.ok(Math.hypot(...first.map((v, i) => v - start[i])) < 0.002, 'no jump');
  for (let i = 1; i <= 10; i += 1) {
    await page.mouse.move(at.x, at.y + 3 * i);
    await frames(page, 2);
  }
  await waitFor(page, () => doppel.handle.controls.dragging);
  await page.mouse.up();
  await waitFor(page, () => doppel.driver.goal === null);
  const end = await page.evaluate(() => [...doppel.driver.commanded().slice(0, 3)]);
  assert.ok(Math.hypot(...end.map((v, i) => v - start[i])) > 0.003, 'it has moved');
});

lab.check('pause, step and reset', async (page) => {
  await set(page, 'Revolute 1', 1.2);
  await near(page, 'Revolute 1', 1.2);
  await page.click('#play');
  await waitFor(page, () => doppel.twin.paused);
  const time = await page.evaluate(() => doppel.twin.status.simTime);
  await page.click('#step');
  await waitFor(page, (t) => Math.abs(doppel.twin.status.simTime - t - 0.001) < 1e-6, time);
  await page.click('#step', { modifiers: ['Shift'] });
  await waitFor(page, (t) => Math.abs(doppel.twin.status.simTime - t - 0.101) < 1e-6, time);
  assert.equal(await page.evaluate(() => doppel.twin.paused), true, 'a step does not look like running');
  await page.click('#reset');
  await waitFor(page, () => doppel.twin.status.simTime < 0.05);
  await near(page, 'Revolute 1', 1.5708);
  assert.equal(await page.evaluate(() => doppel.twin.paused), true, 'a reset does not end a pause');
  await page.click('#play');
  await waitFor(page, () => !doppel.twin.paused && doppel.twin.simTime > 0.2);
});

lab.check('the emergency stop holds the arm and refuses; after its reset the arm obeys again', async (page) => {
  await page.evaluate(() => (doppel.settings.stopDoes = 'deactivate')); // a former setting, which a browser may still have
  const before = await at(page, 'Revolute 2');
  await page.keyboard.press('Escape');
  await waitFor(page, () => doppel.commander.stopped);
  assert.equal(await page.locator('.joint .slider').first().isDisabled(), true);
  await ran(page, 1);
  assert.ok(Math.abs((await at(page, 'Revolute 2')) - before) < 0.02, 'the arm does not fall');
  await set(page, 'Revolute 1', 1.2);
  await ran(page, 0.5);
  assert.ok(Math.abs((await at(page, 'Revolute 1')) - 1.2) > 0.1, 'a command is refused');
  await page.click('#stop');
  await waitFor(page, () => !doppel.commander.stopped && doppel.twin.controllers.every((c) => c.state === 'active'));
  await set(page, 'Revolute 1', 1.5);
  await near(page, 'Revolute 1', 1.5, 0.03);
});

lab.check('a gamepad moves the tool while its dead-man button is held, and not else', async (page) => {
  await page.evaluate(() => {
    window.pad = { id: 'stub', connected: true, axes: [-1, 0, 0, 0], buttons: Array.from({ length: 17 }, () => ({ pressed: false, value: 0 })) };
    navigator.getGamepads = () => [window.pad];
  });
  const tool = () => page.evaluate(() => [...doppel.driver.commanded().slice(0, 3)]);
  const moved = (a, b) => Math.hypot(...a.map((v, i) => v - b[i]));
  await waitFor(page, () => doppel.jog.pad?.name === 'stub');
  const a = await tool();
  await frames(page, 10);
  assert.ok(moved(a, await tool()) < 0.0005, 'nothing without the dead-man button');
  await page.evaluate(() => (window.pad.buttons[4].pressed = true));
  await waitFor(page, () => doppel.jog.pad?.live);
  await waitFor(page, (from) => Math.hypot(...from.map((v, i) => v - doppel.driver.commanded()[i])) > 0.004, a);
  await page.evaluate(() => (window.pad.buttons[4].pressed = false));
  await waitFor(page, () => doppel.driver.goal === null);
  const stood = await page.evaluate(() => Float64Array.from(doppel.twin.target).join());
  await ran(page, 0.5);
  const held = await page.evaluate((before) => Math.max(...before.split(',').map((v, i) => Math.abs(v - doppel.twin.target[i]))), stood);
  assert.ok(held < 0.01, `released, nothing is commanded any more: ${held} rad`);
  await page.evaluate(() => delete navigator.getGamepads);
});

lab.check('every panel opens, every layer is drawn, and none complains', async (page) => {
  const ids = await page.evaluate(() => [...document.querySelectorAll('[role=tab]')].map((tab) => tab.id.slice(4)));
  assert.ok(ids.length >= 9);
  for (const id of ids) {
    await page.evaluate((name) => doppel.layout.open(name), id);
    await frames(page, 2);
    assert.ok(await page.locator(`#panel-${id}`).isVisible(), id);
    assert.equal(await page.locator(`#tab-${id}`).getAttribute('aria-selected'), 'true');
  }
  await page.evaluate(() => doppel.layout.open('topics'));
  await page.locator('.topic-list button', { hasText: '/joint_states' }).first().click();
  await waitFor(page, () => document.querySelectorAll('.message-tree .leaf').length > 10);
  const layers = ['collision', 'inertia', 'com', 'frames', 'axes', 'trace', 'contacts'];
  for (const on of [true, false]) {
    for (const layer of layers) await page.evaluate(([name, value]) => doppel.world.setLayer(name, value), [layer, on]);
    await frames(page, 3);
  }
  assert.deepEqual(page.problems, []);
});

lab.check('the tabs are reached and changed by the keyboard, and every control has a name', async (page) => {
  await page.locator('.dock.right [role=tab][aria-selected=true]').focus();
  const before = await page.evaluate(() => document.activeElement.id);
  await page.keyboard.press('ArrowRight');
  const now = await page.evaluate(() => [document.activeElement.id, document.activeElement.getAttribute('aria-selected')]);
  assert.notEqual(now[0], before);
  assert.equal(now[1], 'true');
  const nameless = await page.evaluate(() => [...document.querySelectorAll('button, input, select, [role=tab], [role=separator]')].filter((e) =>
    !(e.getAttribute('aria-label') || e.title || e.textContent.trim() || e.closest('label')?.textContent.trim() || document.querySelector(`label[for="${e.id}"]`))).map((e) => e.outerHTML.slice(0, 120)));
  assert.deepEqual(nameless, []);
});

lab.check('a twin that was killed and started again is picked up, and the page says so', async (page) => {
  await lab.killTwin();
  await waitFor(page, () => doppel.twin.client.phase === 'lost');
  await waitFor(page, () => /^No connection to the twin for \d+ s\./.test(document.querySelector('.lost-note:not([hidden])')?.textContent));
  await waitFor(page, () => document.querySelector('.link').textContent.includes('lost'));
  await lab.startTwin();
  await waitFor(page, () => doppel.twin.client.phase === 'open' && doppel.twin.controllers.some((c) => c.state === 'active'));
  await waitFor(page, () => document.querySelector('.link').textContent === 'connected');
  await set(page, 'Revolute 1', 1.0);
  await near(page, 'Revolute 1', 1.0, 0.03);
});
