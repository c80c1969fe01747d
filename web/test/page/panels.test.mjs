// The panels of the page in Chromium with a running twin: tree, parameters, plots, topics, services, objects.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { Lab, waitFor as wait } from './lab.mjs';

const lab = new Lab();
let page;

before(async () => {
  await lab.start();
  page = await lab.page();
}, { timeout: 300000 });
after(() => lab.stop());

const waitFor = (check, arg, timeout = 30000) => wait(page, check, arg, timeout);
const open = (id) => page.evaluate((name) => doppel.layout.open(name), id);

test('the tree: searched, walked by keys, one selection with rows, details and picture', async () => {
  await open('tree');
  await page.fill('#panel-tree input', 'revolute 3');
  assert.ok(await page.locator('.tree-row:visible').count() < await page.evaluate(() => doppel.twin.tree.links.length));
  await page.press('#panel-tree input', 'Enter');
  const child = (name) => page.evaluate((joint) => doppel.twin.tree.jointByName.get(joint).childLink, name);
  assert.equal(await page.evaluate(() => doppel.selection.link), await child('Revolute 3'));
  await page.fill('#panel-tree input', '');
  await page.focus('.tree');
  await page.keyboard.press('ArrowUp');
  assert.equal(await page.evaluate(() => doppel.selection.link), await child('Revolute 2'));
  const details = await page.textContent('.details');
  for (const word of ['mass', 'inertia', 'Revolute 2', 'axis', 'limits', 'dynamics', 'written in']) assert.ok(details.includes(word), word);
  await page.keyboard.press('ArrowLeft');
  assert.equal(await page.locator('.tree-row[aria-selected="true"]').getAttribute('aria-expanded'), 'false');
  await page.keyboard.press('ArrowRight');
  await open('joints');
  assert.match(await page.locator('.joint.selected').textContent(), /Revolute 2/);
});

test('parameters: set, reported by the row when the node refuses, and changed by somebody else', async () => {
  await open('parameters');
  await page.locator('.parameters-panel .topic-list button', { hasText: 'arm_controller' }).click();
  const input = (name) => page.locator('.parameter', { has: page.locator(`[title="/omarm_arm_controller.${name}"]`) }).locator('input');
  const row = (name) => page.locator('.parameter', { has: page.locator(`[title="/omarm_arm_controller.${name}"]`) });
  await input('constraints.goal_time').fill('1.5');
  await input('constraints.goal_time').press('Enter');
  await waitFor(() => doppel.parameters.number('/omarm_arm_controller.constraints.goal_time') === 1.5);
  await input('constraints.goal_time').fill('-3');
  await input('constraints.goal_time').press('Enter');
  await row('constraints.goal_time').locator('.parameter-error').waitFor();
  assert.equal(await input('constraints.goal_time').inputValue(), '-3', 'expected the typed text to stay for correction');
  await input('constraints.goal_time').fill('abc');
  await input('constraints.goal_time').press('Enter');
  await waitFor(() => document.querySelector('.parameter-error:not([hidden])')?.textContent.includes('not a number'));
  await page.evaluate(() => doppel.twin.client.setParameter({ name: '/omarm_arm_controller.constraints.Revolute 1.trajectory', value: 0.2, type: 'float64' }));
  await waitFor(() => [...document.querySelectorAll('.parameter')].some((one) => one.textContent.includes('constraints.Revolute 1.trajectory') && one.querySelector('input').value === '0.2'));
});

test('plots: the band of tolerance while a trajectory runs; scrubbing moves a ghost to where the arm was; CSV', async () => {
  await open('plots');
  await page.evaluate(() => doppel.commander.set(doppel.twin.tree.moving[0], 2.2));
  await waitFor(() => doppel.recorder.series.get('joint:Revolute 1:tolerance')?.ring.some((v) => v === 0.2));
  await waitFor(() => Math.abs(doppel.twin.q[0] - 2.2) < 0.02);
  const past = await page.evaluate(() => {
    const scrub = document.querySelector('.scrub');
    scrub.value = '0.02';
    scrub.dispatchEvent(new Event('input'));
    return doppel.recorder.positionsAt(doppel.recorder.oldest + (doppel.recorder.newest - doppel.recorder.oldest) * 0.02)[0];
  });
  assert.ok(Math.abs(past - 2.2) > 0.1, 'expected the past pose to differ');
  await waitFor(() => doppel.world.ghost.root.visible);
  await waitFor(() => {  // drawn separately, which on a busy machine is one picture later
    const link = doppel.twin.tree.moving[0].childLink;
    const [a, b] = [doppel.world.ghost.links[link], doppel.world.view.links[link]].map((group) => group.matrix.elements);
    return Math.hypot(...a.map((v, i) => v - b[i])) > 0.05;
  });
  const rows = await page.evaluate(() => doppel.recorder.csv(['joint:Revolute 1:position', 'joint:Revolute 1:effort']).split('\n'));
  assert.match(rows[0], /^time \[s\],Revolute 1 position \[rad\]/);
  assert.ok(rows.length > 20);
  await page.click('#plot-hold');
  await waitFor(() => !doppel.world.ghost.root.visible);
});

test('a service is called and a message published by form', async () => {
  await open('topics');
  await page.locator('.topics-panel .segments button', { hasText: 'Services' }).click();
  await page.locator('.topic-list button', { hasText: '/controller_manager/list_controllers' }).first().click();
  await page.click('#form-send');
  await waitFor(() => document.querySelector('.answer')?.textContent.includes('omarm_arm_controller'));
  await page.locator('.topics-panel .segments button', { hasText: 'Topics' }).click();
  await page.locator('.topic-list button', { hasText: '/omarm_arm_controller/joint_trajectory' }).first().click();
  await page.click('#publish');
  await page.locator('.form label', { hasText: 'joint_names' }).locator('input').fill('"Revolute 1", Revolute 2, Revolute 3, Revolute 4, Revolute 5, Revolute 6');
  await page.locator('.form-list button', { hasText: 'Add' }).click();
  const positions = page.locator('.form-items label', { hasText: 'positions' }).locator('input');
  await positions.fill('1, x');
  await page.click('#form-send');
  assert.equal(await positions.evaluate((input) => input.checkValidity()), false);
  await positions.fill('1.0, 1.4, 1.57, 1.57, 1.57, 1.57');
  await page.locator('.form-items label', { hasText: 'sec' }).first().locator('input').fill('1');
  await page.click('#form-send');
  await waitFor(() => Math.abs(doppel.twin.q[0] - 1.0) < 0.02 && Math.abs(doppel.twin.q[1] - 1.4) < 0.02);
});

test('objects are added, moved and removed; where that cannot be, a sentence says so', async (t) => {
  await open('objects');
  if (await page.evaluate(() => doppel.objects.missing !== '')) {
    assert.match(await page.textContent('#panel-objects'), /takes no objects: it does not offer \/spawn_entity/);
    t.skip('the program does not offer /spawn_entity');
    return;
  }
  await page.fill('#object-name', 'test_box');
  await page.check('#object-fixed');
  await page.click('#object-add');
  await waitFor(() => doppel.objects.objects.has('test_box'));
  await waitFor(() => Math.abs(doppel.objects.objects.get('test_box').holder.position.z - 0.025) < 0.002);
  await page.locator('.object-list .object', { hasText: 'test_box' }).click();
  await page.fill('#object-x', '300');
  await page.press('#object-x', 'Enter');
  await waitFor(() => Math.abs(doppel.objects.objects.get('test_box').holder.position.x - 0.3) < 0.001);
  await page.fill('#object-name', 'placed');
  await page.click('#object-place');
  const at = await page.evaluate(() => {
    const { stage, camera } = doppel.world;
    camera.jump('top');
    stage.camera.updateMatrixWorld();
    const p = doppel.world.toolPosition().set(0.1, 0.25, 0).project(stage.camera);
    const box = stage.renderer.domElement.getBoundingClientRect();
    return { x: box.left + ((p.x + 1) / 2) * box.width, y: box.top + ((1 - p.y) / 2) * box.height };
  });
  await page.mouse.click(at.x, at.y);
  await waitFor(() => Math.abs(doppel.objects.objects.get('placed')?.holder.position.y - 0.25) < 0.01);
  for (const name of ['test_box', 'placed']) {
    await page.locator('.object-list li', { hasText: name }).locator('button', { hasText: 'Remove' }).click();
    await waitFor((gone) => !doppel.objects.objects.has(gone), name);
  }
});

test('where meshes collide their convex hulls are drawn', async () => {
  await page.evaluate(() => doppel.world.setLayer('collision', true));
  await waitFor(() => doppel.world.view.loading === 0);
  const worst = await page.evaluate(() => {
    let out = 0, faces = 0;
    for (const link of doppel.world.view.links) {
      for (const layer of link.children.filter((one) => one.userData.layer === 'collision')) layer.traverse((one) => {
        if (!one.isMesh || one.geometry.type !== 'BufferGeometry') return; // neither a box nor a cylinder
        const p = one.geometry.getAttribute('position'), n = one.geometry.getAttribute('normal');
        const size = Math.max(...p.array) - Math.min(...p.array);
        for (let f = 0; f < p.count; f += 3) {
          faces += 1;
          const dot = (i) => n.getX(f) * p.getX(i) + n.getY(f) * p.getY(i) + n.getZ(f) * p.getZ(i);
          for (let i = 0; i < p.count; i += 7) out = Math.max(out, (dot(i) - dot(f)) / size);
        }
      });
    }
    doppel.world.setLayer('collision', false);
    return faces > 0 ? out : -1;
  });
  assert.ok(worst >= 0 && worst < 1e-3, `expected a convex hull; a vertex is outside of a face by ${worst} of the size`);
});

test('nothing of it complained', () => assert.deepEqual(page.problems, []));
