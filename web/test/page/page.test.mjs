// The page in real Chromium against a running twin.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { Lab, sleep } from './lab.mjs';

const lab = new Lab();
let page;

before(async () => {
  await lab.start();
  page = await lab.page();
}, { timeout: 300000 });
after(() => lab.stop());

const q = (p, name) => p.evaluate((n) => doppel.twin.q[doppel.twin.tree.jointByName.get(n).index], name);
const waitFor = (p, text, arg, timeout = 30000) => p.waitForFunction(text, arg, { timeout });

// What of the picture belongs to the arm: pixels that the arm's visibility changes.
async function armPixels(p) {
  const shot = () => p.evaluate(() => {
    const { stage } = doppel.world;
    doppel.handle.show(false);
    stage.frame.emit(0);
    stage.renderer.render(stage.scene, stage.camera);
    const canvas = document.createElement('canvas');
    canvas.width = 200;
    canvas.height = 150;
    const context = canvas.getContext('2d');
    context.drawImage(stage.renderer.domElement, 0, 0, 200, 150);
    return [...context.getImageData(0, 0, 200, 150).data];
  });
  const withArm = await shot();
  await p.evaluate(() => (doppel.world.view.root.visible = false));
  const without = await shot();
  await p.evaluate(() => {
    doppel.world.view.root.visible = true;
    doppel.handle.show(true);
    doppel.world.stage.invalidate();
  });
  const out = new Set();
  for (let i = 0; i < withArm.length; i += 4) {
    if ([0, 1, 2].some((k) => Math.abs(withArm[i + k] - without[i + k]) > 24)) out.add(i / 4);
  }
  return out;
}

test('the arm is in the picture, and no error on the console', async () => {
  const arm = await armPixels(page);
  assert.ok(arm.size > 600, `${arm.size} pixels`);
  assert.deepEqual(page.problems, []);
  console.log(`first picture ${Math.round(await page.evaluate(() => doppel.world.firstPicture))} ms`);
});

test('a slider moves its joint, and the picture shows it', async () => {
  const before_ = await armPixels(page);
  const slider = page.locator('.joint', { hasText: 'Revolute 1' }).first().locator('.slider');
  await slider.focus();
  await slider.evaluate((element) => {
    element.value = '2.4';
    element.dispatchEvent(new Event('input', { bubbles: true }));
    element.dispatchEvent(new Event('change', { bubbles: true }));
  });
  await waitFor(page, () => Math.abs(doppel.twin.q[0] - 2.4) < 0.02);
  const now = await armPixels(page);
  const changed = [...now].filter((i) => !before_.has(i)).length;
  assert.ok(changed > 100, `${changed} pixels`);
});

test('a trajectory moves the arm, and the picture shows it', async () => {
  const before_ = await armPixels(page);
  await page.evaluate(() => {
    const { tree, q } = doppel.twin;
    const to = Float64Array.from(q);
    to[tree.jointByName.get('Revolute 2').index] = 0.9;
    doppel.commander.play([{ time: 1, positions: to }]);
  });
  await waitFor(page, () => Math.abs(doppel.twin.q[doppel.twin.tree.jointByName.get('Revolute 2').index] - 0.9) < 0.02);
  const now = await armPixels(page);
  const changed = [...now].filter((i) => !before_.has(i)).length + [...before_].filter((i) => !now.has(i)).length;
  assert.ok(changed > 100, `${changed} pixels`);
});

test('two pages agree', async () => {
  const other = await lab.page();
  await page.evaluate(() => doppel.commander.set(doppel.twin.tree.jointByName.get('Revolute 1'), 1.2));
  await waitFor(other, () => Math.abs(doppel.twin.q[0] - 1.2) < 0.02 && Math.abs(doppel.twin.target[0] - 1.2) < 0.01);
  await waitFor(page, () => Math.abs(doppel.twin.q[0] - 1.2) < 0.02);
  await sleep(800);
  assert.ok(Math.abs((await q(page, 'Revolute 1')) - (await q(other, 'Revolute 1'))) < 0.005);
  assert.deepEqual(other.problems, []);
  await other.close();
});

test('a goal of the tool is reached within 2 mm by the commanded pose; one too far is told', async () => {
  const reached = await page.evaluate(async () => {
    const { driver } = doppel;
    driver.begin();
    const goal = driver.commanded().slice();
    const frame = () => new Promise(requestAnimationFrame);
    for (let i = 0; i < 30; i += 1) {
      goal[0] += 0.001;
      goal[2] -= 0.0008;
      driver.setGoal(goal);
      await frame();
    }
    for (let i = 0; i < 20; i += 1) await frame();
    const at = driver.commanded();
    driver.release();
    return Math.hypot(at[0] - goal[0], at[1] - goal[1], at[2] - goal[2]);
  });
  assert.ok(reached < 0.002, `${reached} m`);
  await waitFor(page, () => doppel.driver.goal === null);
  const far = await page.evaluate(async () => {
    doppel.driver.begin();
    const goal = doppel.driver.commanded().slice();
    goal[0] += 2;
    doppel.driver.setGoal(goal);
    for (let i = 0; i < 4; i += 1) await new Promise(requestAnimationFrame);
    const { solution } = doppel.driver;
    doppel.driver.release();
    return { reached: solution.reached, distance: solution.distance };
  });
  assert.ok(!far.reached && far.distance > 0.5);
  await waitFor(page, () => doppel.driver.goal === null);
});

test('the handle is dragged with the mouse, without a jump', async () => {
  const start = await page.evaluate(() => [...doppel.driver.commanded().slice(0, 3)]);
  const at = await page.evaluate(() => {
    const { stage } = doppel.world;
    const p = doppel.world.toolPosition().project(stage.camera);
    const box = stage.renderer.domElement.getBoundingClientRect();
    return { x: box.left + ((p.x + 1) / 2) * box.width, y: box.top + ((1 - p.y) / 2) * box.height };
  });
  await waitFor(page, () => doppel.twin.tree.moving.every((j) => Math.abs(doppel.twin.velocity[j.index] || 0) < 0.01));
  await page.mouse.move(at.x, at.y);
  await waitFor(page, () => doppel.handle.controls.axis !== null);
  await page.mouse.down();
  const first = await page.evaluate(() => [...doppel.driver.commanded().slice(0, 3)]);
  assert.ok(Math.hypot(...first.map((v, i) => v - start[i])) < 0.002, 'no jump');
  for (let i = 1; i <= 10; i += 1) {
    await page.mouse.move(at.x, at.y + 3 * i);
    await page.waitForTimeout(60);
  }
  await waitFor(page, () => doppel.handle.controls.dragging);
  await page.mouse.up();
  await waitFor(page, () => doppel.driver.goal === null);
  const end = await page.evaluate(() => [...doppel.driver.commanded().slice(0, 3)]);
  assert.ok(Math.hypot(...end.map((v, i) => v - start[i])) > 0.003, 'it has moved');
});

test('pause, step and reset', async () => {
  await page.click('#play');
  await waitFor(page, () => doppel.twin.paused);
  const time = await page.evaluate(() => doppel.twin.simTime);
  await page.click('#step', { modifiers: ['Shift'] });
  await waitFor(page, (t) => doppel.twin.simTime > t + 0.09, time);
  assert.equal(await page.evaluate(() => doppel.twin.paused), true, 'a step does not look like running');
  await page.click('#play');
  await waitFor(page, () => !doppel.twin.paused);
  await page.click('#reset');
  await waitFor(page, (t) => doppel.twin.simTime < t, time);
  await waitFor(page, () => Math.abs(doppel.twin.q[0] - 1.5708) < 0.02);
});

test('the emergency stop holds and refuses; released, the arm obeys again', async () => {
  const shoulder = () => page.evaluate(() => doppel.twin.q[2]);
  const before = await shoulder();
  await page.keyboard.press('Escape');
  await waitFor(page, () => doppel.commander.stopped);
  assert.equal(await page.locator('.joint .slider').first().isDisabled(), true);
  await page.waitForTimeout(1500);
  assert.ok(Math.abs((await shoulder()) - before) < 0.02, 'the arm does not fall');
  await page.click('#stop');
  await waitFor(page, () => !doppel.commander.stopped && doppel.twin.controllers.every((c) => c.state === 'active'));
  await page.evaluate(() => doppel.commander.set(doppel.twin.tree.moving[0], 1.5));
  await waitFor(page, () => Math.abs(doppel.twin.q[0] - 1.5) < 0.03);
});

test('a gamepad moves the tool while its dead-man button is held, and not else', async () => {
  await page.evaluate(() => {
    window.pad = { id: 'stub', connected: true, axes: [0, 0, 0, 0], buttons: Array.from({ length: 17 }, () => ({ pressed: false, value: 0 })) };
    navigator.getGamepads = () => [window.pad];
    window.pad.axes[0] = -1;
  });
  const tool = () => page.evaluate(() => [...doppel.driver.commanded().slice(0, 3)]);
  const moved = (a, b) => Math.hypot(...a.map((v, i) => v - b[i]));
  await page.waitForTimeout(1500);
  const a = await tool();
  await page.waitForTimeout(500);
  assert.ok(moved(a, await tool()) < 0.0005, 'nothing without the dead-man button');
  await page.evaluate(() => (window.pad.buttons[4].pressed = true));
  await waitFor(page, () => doppel.jog.pad?.live);
  await page.waitForTimeout(1800);
  const b = await tool();
  assert.ok(moved(a, b) > 0.004, `moved ${moved(a, b)}`);
  await page.evaluate(() => (window.pad.buttons[4].pressed = false));
  await waitFor(page, () => doppel.driver.goal === null);
  const c = await tool();
  await page.waitForTimeout(600);
  assert.ok(moved(c, await tool()) < 0.0005, 'stopped when released');
});

test('every panel opens, and none complains', async () => {
  for (const id of ['tool', 'poses', 'control', 'health', 'topics', 'tf', 'log', 'plots', 'joints']) {
    await page.evaluate((name) => doppel.layout.open(name), id);
    await page.waitForTimeout(250);
    assert.ok(await page.locator(`#panel-${id}`).isVisible(), id);
  }
  await page.evaluate(() => doppel.layout.open('topics'));
  await page.locator('.topic-list button', { hasText: '/joint_states' }).first().click();
  await waitFor(page, () => document.querySelectorAll('.message-tree .leaf').length > 10);
  for (const layer of ['collision', 'inertia', 'com', 'frames', 'axes', 'trace', 'contacts']) {
    await page.evaluate((name) => doppel.world.setLayer(name, true), layer);
  }
  await page.waitForTimeout(800);
  for (const layer of ['collision', 'inertia', 'com', 'frames', 'axes', 'trace', 'contacts']) {
    await page.evaluate((name) => doppel.world.setLayer(name, false), layer);
  }
  assert.deepEqual(page.problems, []);
});

test('a twin that was killed and started again is picked up', async () => {
  await lab.killTwin();
  await waitFor(page, () => doppel.twin.client.phase === 'lost');
  await waitFor(page, () => document.querySelector('.note:not([hidden])')?.textContent.includes('gone'));
  await sleep(500);
  await lab.startTwin();
  await waitFor(page, () => doppel.twin.client.phase === 'open' && doppel.twin.simTime < 60 && doppel.twin.controllers.length > 0);
  await page.evaluate(() => doppel.commander.set(doppel.twin.tree.moving[0], 1.0));
  await waitFor(page, () => Math.abs(doppel.twin.q[0] - 1.0) < 0.03);
});
