// The tool in Chromium with a running twin: the program's inverse kinematics, its reasons, its solutions and the reach.
import assert from 'node:assert/strict';
import { after, before } from 'node:test';
import { Lab, sleep, waitFor } from './lab.mjs';

const lab = new Lab();

before(() => lab.start(), { timeout: 300000 });
after(() => lab.stop());

const TIP_ERROR = 0.001; // m

// Drags the handle's proxy there in steps, as its arrows do; releases it unless it is held.
const drag = (page, by, held = false) => page.evaluate(async ([[x, y, z], hold]) => {
  const { driver } = doppel;
  driver.begin();
  const from = driver.commanded();
  for (let i = 1; i <= 20; i += 1) {
    driver.setGoal([from[0] + (x * i) / 20, from[1] + (y * i) / 20, from[2] + (z * i) / 20, ...from.slice(3)]);
    await new Promise(requestAnimationFrame);
  }
  if (!hold) driver.release();
  return [...driver.goal];
}, [by, held]);
const tool = (page) => page.evaluate(() => [...doppel.world.toolPosition()]);
const distance = (a, b) => Math.hypot(...[0, 1, 2].map((i) => a[i] - b[i]));
const openTool = (page) => page.evaluate(() => doppel.layout.open('tool'));
const state = (page) => page.locator('#panel-tool .row > .reach').textContent();

// Counts the calls of the services of inverse kinematics and reach from now on.
const count = (page) => page.evaluate(() => {
  const { client } = doppel.twin;
  window.counted ??= { call: client.call.bind(client) };
  Object.assign(window.counted, { calls: 0, open: 0, most: 0 });
  client.call = (name, ...rest) => {
    if (!/\/doppel\/(ik|reach|arms)$/.test(name)) return window.counted.call(name, ...rest);
    window.counted.calls += 1;
    window.counted.open += 1;
    window.counted.most = Math.max(window.counted.most, window.counted.open);
    const answer = window.counted.call(name, ...rest);
    const ends = () => (window.counted.open -= 1);
    answer.then(ends, ends);
    return answer;
  };
});

lab.check('a drag moves the arm by the program: one request at a time, the tip within 1 mm, and nothing at rest', async (page) => {
  await openTool(page);
  await count(page);
  await sleep(500);
  assert.equal(await page.evaluate(() => window.counted.calls), 0, 'expected no request at rest');
  const sag = distance(await tool(page), await page.evaluate(() => [...doppel.driver.commanded()])); // the servos give way to the weight
  const goal = await drag(page, [0.03, 0.01, -0.03]);
  await waitFor(page, () => doppel.driver.goal === null);
  const { calls, most } = await page.evaluate(() => window.counted);
  assert.ok(calls >= 2 && most === 1, `${calls} calls, ${most} at a time`);
  assert.ok(distance(await page.evaluate(() => [...doppel.driver.commanded()]), goal) < 1e-4, 'the commanded pose');
  await waitFor(page, ([to, most]) => Math.hypot(...[...doppel.world.toolPosition()].map((v, i) => v - to[i])) < most, [goal.slice(0, 3), sag + TIP_ERROR]);
  await waitFor(page, () => document.querySelector('#panel-tool .row > .reach').textContent === '');
  await sleep(500);
  assert.equal(await page.evaluate(() => window.counted.calls), calls, 'expected no request at rest');
});

lab.check('the arm follows at the velocity limits: no joint jumps', async (page) => {
  const [worst, answer] = await page.evaluate(async () => {
    const { driver, twin } = doppel;
    driver.begin();
    const goal = driver.commanded().slice();
    goal[0] += 0.1;
    // Before the goal: a slow frame may have room for the whole motion.
    let most = 0, last = await new Promise(requestAnimationFrame), q = Float64Array.from(twin.target), before = 0;
    driver.setGoal(goal);
    const end = last + 20000; // the program's answer moves the arm, and may take a while on a busy machine
    for (let frames = 0; frames < 40 && last < end; frames += most > 0 ? 1 : 0) {
      const now = await new Promise(requestAnimationFrame), dt = (now - last) / 1000;
      const time = Math.max(1 / 60, dt, before); // the arm is moved before or after this callback
      for (const joint of twin.tree.moving) if (!joint.mimic) most = Math.max(most, Math.abs(twin.target[joint.index] - q[joint.index]) / (joint.velocity * time));
      q = Float64Array.from(twin.target);
      last = now;
      before = dt;
    }
    driver.release();
    return [most, driver.answer?.message ?? 'no answer'];
  });
  assert.ok(worst > 0.05 && worst < 1.05, `${worst} of the limit; the program says: ${answer}`);
});

lab.check('out of reach: the reason in the program\'s words, the hand at the goal, and the arm as near as it comes', async (page) => {
  await openTool(page);
  const before = await tool(page);
  const goal = await drag(page, [0.5, 0, 0], true);
  await waitFor(page, () => doppel.driver.answer?.obstacle === 'out_of_reach' && doppel.ghost.appearance !== null);
  await page.locator('#panel-tool .reach.warning', { hasText: /the position is out of reach by \d+ mm/ }).waitFor();
  await page.locator('.goal-sign', { hasText: 'out of reach' }).waitFor();
  const drawn = await page.evaluate(() => {
    const { view } = doppel.ghost, link = doppel.world.tool, base = doppel.twin.tree.root;
    return { on: view.root.visible && view.links[link].visible, base: view.links[base].visible, at: view.links[link].matrix.elements.slice(12, 15) };
  });
  assert.deepEqual([drawn.on, drawn.base], [true, false]);
  assert.ok(distance(drawn.at, goal) < 1e-6, 'the ghost is at the goal');
  await waitFor(page, (from) => Math.hypot(...[...doppel.world.toolPosition()].map((v, i) => v - from[i])) > 0.05, before);
  await page.evaluate(() => doppel.driver.release());
  await waitFor(page, () => doppel.driver.goal === null && doppel.ghost.appearance === null && !doppel.ghost.view.root.visible);
  assert.match(await state(page), /out of reach/, 'expected the reason to stay');
  await page.evaluate(() => doppel.driver.drop());
  await waitFor(page, () => document.querySelector('#panel-tool .row > .reach').textContent === '');
});

lab.check('in a collision the arm stays, and the two that touch are named', async (page) => {
  await openTool(page);
  await page.evaluate(() => doppel.settings.keepOrientation = false);
  try {
    const before = await page.evaluate(() => {
      const { driver, twin, world } = doppel, root = twin.tree.root * 7;
      driver.begin();
      const target = twin.target.join();
      driver.setGoal([...twin.poses.slice(root, root + 2), twin.poses[root + 2] + 0.02, ...driver.commanded().slice(3)]); // inside of the base
      return target;
    });
    await waitFor(page, () => doppel.driver.answer?.obstacle === 'collision');
    await page.locator('#panel-tool .reach.warning', { hasText: /'.+' and '.+' touch by/ }).waitFor();
    await page.locator('.goal-sign', { hasText: 'in collision' }).waitFor();
    assert.equal(await page.evaluate(() => doppel.twin.target.join()), before);
  } finally {
    await page.evaluate(() => {
      doppel.settings.keepOrientation = true;
      doppel.driver.drop();
    });
  }
});

lab.check('solutions are listed, shown while they have the focus, and a click moves the arm there', async (page) => {
  await openTool(page);
  await page.locator('#panel-tool .toggle', { hasText: 'Keep orientation' }).click();
  await page.click('#goal-solutions');
  await page.locator('button.solution').nth(1).waitFor();
  assert.equal(await page.getAttribute('#goal-solutions', 'aria-expanded'), 'true');
  assert.match(await page.locator('button.solution').first().textContent(), /^1 · here.* mm.* %/);
  const before = await page.evaluate(() => doppel.twin.target.join());
  await page.locator('button.solution').first().focus();
  await page.keyboard.press('ArrowDown');
  await waitFor(page, () => doppel.ghost.view?.root.visible && doppel.ghost.appearance?.text === 'solution 2');
  const drawn = await page.evaluate(() => [...doppel.ghost.view.links[doppel.world.tool].matrix.elements.slice(12, 15)]);
  assert.ok(distance(drawn, await page.evaluate(() => [...doppel.driver.commanded()])) < 1e-5, 'the same place of the tool');
  assert.equal(await page.evaluate(() => doppel.twin.target.join()), before, 'expected a look to move nothing');
  await page.keyboard.press('Enter');
  await waitFor(page, () => document.querySelectorAll('button.solution')[1].getAttribute('aria-current') === 'true');
  assert.notEqual(await page.evaluate(() => doppel.twin.target.join()), before);
  await waitFor(page, () => doppel.twin.tree.moving.every((j) => j.mimic || Math.abs(doppel.twin.q[j.index] - doppel.twin.target[j.index]) < 0.02));
  assert.ok(distance(await tool(page), drawn) < 0.01, 'expected the tool where it was');
  await page.click('#goal-solutions');
  assert.equal(await page.locator('button.solution:visible').count(), 0);
  await waitFor(page, () => doppel.ghost.appearance === null);
  await page.locator('#panel-tool .toggle', { hasText: 'Keep orientation' }).click();
});

lab.check('a goal is typed, and Go moves there', async (page) => {
  await openTool(page);
  const z = await page.evaluate(() => doppel.driver.commanded()[2] * 1000);
  await page.fill('#goal-z', String((z - 30).toFixed(1)));
  await sleep(400); // the fields are written ten times a second
  await page.click('#goal-go');
  await waitFor(page, (to) => Math.abs(doppel.driver.commanded()[2] * 1000 - to) < 0.1, z - 30);
  // The servos give way under the arm's weight, by more than a millimetre at the tool.
  await waitFor(page, (to) => Math.abs(doppel.world.toolPosition().z * 1000 - to) < 3, z - 30);
  await waitFor(page, () => doppel.driver.goal === null);
});

lab.check('the reach is drawn coarse, then fine, in all directions or pointing down, and goes away', async (page) => {
  await openTool(page);
  await page.check('#show-reach');
  await waitFor(page, () => doppel.reachPoints.points !== null);
  const points = () => page.evaluate(() => doppel.reachPoints.points.geometry.getAttribute('position').count);
  const coarse = await points();
  assert.ok(coarse > 200, `${coarse} points`);
  await page.locator('.stage-legend', { hasText: 'share of directions' }).waitFor();
  await waitFor(page, () => doppel.reach.map?.fine && !doppel.reach.busy, undefined, 120000);
  const fine = await points();
  assert.ok(fine > 4 * coarse, `${coarse} points, then ${fine}`);
  await page.locator('#panel-tool .reach', { hasText: /reaches \d+ mm from the first joint; [\d.]+ litres\.$/ }).waitFor();
  await page.selectOption('#reach-directions', 'down');
  await waitFor(page, () => doppel.reach.map?.fine && !doppel.reach.busy, undefined, 120000);
  assert.ok(await points() < fine, 'expected fewer where the tool has to point down');
  await page.locator('.stage-legend', { hasText: 'pointing down' }).waitFor();
  await page.uncheck('#show-reach');
  await waitFor(page, () => doppel.reachPoints.points === null);
  await page.locator('.stage-legend').waitFor({ state: 'hidden' });
});

lab.check('without the service the handle is grey, the reason says what to do, and joints move by their sliders', async (page) => {
  await openTool(page);
  await page.evaluate(() => {
    const { services } = doppel.twin.client;
    window.kept = services.get('/doppel/ik');
    services.delete('/doppel/ik');
    doppel.world.stage.invalidate();
  });
  try {
    await page.locator('#panel-tool .reach', { hasText: /nothing here offers \/doppel\/ik.*doppel up/ }).waitFor();
    await waitFor(page, () => doppel.handle.refusal !== '' && !doppel.handle.controls.enabled);
    for (const id of ['#goal-go', '#goal-solutions', '#show-reach']) assert.ok(await page.locator(id).isDisabled(), id);
    await page.evaluate(() => doppel.commander.set(doppel.twin.tree.moving[0], 1.3));
    await waitFor(page, () => Math.abs(doppel.twin.q[0] - 1.3) < 0.02);
  } finally {
    await page.evaluate(() => {
      doppel.twin.client.services.set('/doppel/ik', window.kept);
      doppel.world.stage.invalidate();
    });
  }
  await waitFor(page, () => doppel.handle.controls.enabled && document.querySelector('#goal-go').disabled === false);
});
