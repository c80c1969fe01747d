// Several robots in one world: all are drawn, and the panels, the sliders, the pad and STOP are for the right ones.
import assert from 'node:assert/strict';
import { mkdtempSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { Lab, waitFor } from './lab.mjs';

const robots = join(dirname(fileURLToPath(import.meta.url)), '../../../robots');
const folder = mkdtempSync(join(tmpdir(), 'doppel-robots-'));
const world = join(folder, 'world.yaml');
writeFileSync(world, `name: three robots
objects:
  - {name: box, box: [0.1, 0.1, 0.1], xyz: [2, 0, 0.05]}
robots:
  - {robot: ${join(robots, 'lab_arm')}, namespace: left}
  - {robot: ${join(robots, 'lab_arm')}, namespace: right, xyz: [1, 0, 0], tf: prefixed}
  - {robot: ${join(robots, 'rover_skid')}, namespace: rover, xyz: [0, 1.5, 0], tf: separate}
`);
const lab = new Lab(undefined, ['--world', world]);
let page;
before(async () => {
  await lab.start();
  page = await lab.page();
  await waitFor(page, () => doppel.twin.robots.length === 3 && doppel.twin.controllers.length > 0);
}, { timeout: 120000 });
after(() => lab.stop());

const select = async (space) => {
  await page.selectOption('#robot', space);
  await waitFor(page, (wanted) => doppel.twin.space === wanted && doppel.world.view?.tree === doppel.twin.tree && doppel.twin.description !== ''
    && doppel.twin.controllers.some((c) => c.state === 'active' && c.joints.length > 0), space);
};
const rootOf = (space) => page.evaluate((name) => {
  const { scene } = doppel.world.stage;
  const root = name === doppel.twin.space ? doppel.world.view.root : scene.children.find((one) => one.userData.robot === name);
  return [...root.children[0].matrix.elements].slice(12, 15);
}, space);
const turned = (space) => page.evaluate((name) => {
  const root = doppel.world.stage.scene.children.find((one) => one.userData.robot === name);
  return root.children.map((link) => [...link.matrix.elements]).flat().reduce((sum, x, i) => sum + x * (i % 17 + 1), 0);
}, space);

test('every robot is drawn where it stands, and the first one is selected', async () => {
  assert.deepEqual(await page.evaluate(() => doppel.twin.robots), ['/left', '/right', '/rover']);
  assert.equal(await page.evaluate(() => doppel.twin.space), '/left');
  await waitFor(page, () => doppel.world.stage.scene.children.filter((one) => one.userData.robot).length === 2);
  for (const [space, x, y] of [['/left', 0, 0], ['/right', 1, 0], ['/rover', 0, 1.5]]) {
    const at = await rootOf(space);
    assert.ok(Math.hypot(at[0] - x, at[1] - y) < 0.02, `${space} is at ${at}`);
  }
});

test('the sliders move the selected robot and no other', async () => {
  await select('/right');
  await waitFor(page, () => doppel.world.stage.scene.children.some((one) => one.userData.robot === '/left'));
  let before = NaN; // once all of its frames are received
  for (let i = 0; i < 50; i += 1) {
    const now = await turned('/left');
    if (Math.abs(now - before) < 1e-3) break;
    before = now;
    await new Promise((done) => setTimeout(done, 300));
  }
  await page.evaluate(() => doppel.commander.set(doppel.twin.tree.moving[0], 0.4));
  await waitFor(page, () => Math.abs(doppel.twin.q[0] - 0.4) < 0.05);
  assert.ok(Math.abs(await turned('/left') - before) < 0.05);
  await select('/left');
  await waitFor(page, () => Math.abs(doppel.twin.q[0]) < 0.05);
  await waitFor(page, () => doppel.world.stage.scene.children.some((one) => one.userData.robot === '/right'));
});

test('findings, loads and controllers are those of the selected robot', async () => {
  await select('/rover');
  await page.evaluate(() => doppel.layout.open('control'));
  assert.equal(await page.evaluate(() => doppel.twin.tree.robot.name), 'rover_skid');
  assert.ok(await page.evaluate(() => doppel.twin.client.subscriptions.has('/rover/joint_states') && !doppel.twin.client.subscriptions.has('/left/joint_states')));
  await waitFor(page, () => document.querySelector('.controllers').textContent.includes('diff_drive'));
});

test('the pad drives the selected base, and its traces are drawn', async () => {
  await select('/rover');
  await waitFor(page, () => doppel.drive.topic() !== null);
  assert.match(await page.evaluate(() => doppel.drive.topic().name), /^\/rover\//);
  await page.evaluate(() => doppel.world.setLayer('base', true));
  await waitFor(page, () => doppel.twin.truth !== null); // the first message of the selected base
  const start = await page.evaluate(() => doppel.twin.truth[0]);
  await page.evaluate(() => doppel.drive.hold(1, 0, 0));
  await waitFor(page, (x) => doppel.twin.truth[0] > x + 0.2, start);
  await waitFor(page, () => doppel.baseTrace.truth.line.geometry.drawRange.count > 5 && doppel.baseTrace.odometry.line.geometry.drawRange.count > 5);
  await page.evaluate(() => doppel.twin.selectRobot('/left')); // also the release of the pad
  await select('/rover');
  assert.equal(await page.evaluate(() => doppel.drive.live), false);
  // At rest for half a second of simulated time.
  await waitFor(page, () => {
    const { truth, simTime } = doppel.twin;
    if (!truth || !window.rest || truth.some((x, i) => Math.abs(x - window.rest.truth[i]) > 1e-4)) window.rest = { truth: truth ? [...truth] : [], since: simTime };
    return truth !== null && simTime - window.rest.since > 0.5;
  });
});

test('a robot that is not selected is drawn at its true pose, and a click selects it', async () => {
  await waitFor(page, () => doppel.twin.truth !== null);
  const there = await page.evaluate(() => [...doppel.twin.truth].slice(0, 3));
  await select('/left');
  await waitFor(page, ([x, y]) => {
    const root = doppel.world.stage.scene.children.find((one) => one.userData.robot === '/rover');
    const e = root?.children.find((link) => link.name === 'base_link')?.matrix.elements;
    return e && Math.hypot(e[12] - x, e[13] - y) < 0.02;
  }, there);
  // The view of a robot that has just been selected may still move to it: it is placed until it stays.
  const place = () => page.evaluate(async () => {
    const { world } = doppel;
    world.camera.controls.dispatchEvent({ type: 'start' }); // a drag, which ends the move of the view to the robot
    const root = world.stage.scene.children.find((one) => one.userData.robot === '/rover');
    world.camera.controls.target.setFromMatrixPosition(root.children[0].matrix);
    world.camera.controls.target.z += 0.17; // its body
    world.stage.camera.position.copy(world.camera.controls.target).add({ x: 0.5, y: 2, z: 1 }); // from a side without other robots
    world.camera.controls.update();
    const placed = world.stage.camera.position.clone();
    for (let i = 0; i < 5; i += 1) await new Promise((next) => requestAnimationFrame(next));
    const box = world.stage.renderer.domElement.getBoundingClientRect();
    return world.stage.camera.position.distanceTo(placed) < 1e-3 ? [box.left + box.width / 2, box.top + box.height / 2] : null;
  });
  let at = null;
  for (let i = 0; i < 20 && at === null; i += 1) at = await place();
  assert.ok(at, 'the view stays where it is placed');
  await page.mouse.click(...at);
  await waitFor(page, () => doppel.twin.space === '/rover');
  assert.equal(await page.evaluate(() => document.getElementById('robot').value), '/rover');
});

test('STOP holds every robot, and its release resets them', async () => {
  const active = (space) => page.evaluate(async (name) => (await doppel.twin.client.call(`${name}/controller_manager/list_controllers`)).controller
    .filter((c) => c.state === 'active' && c.claimed_interfaces.length > 0).length, space);
  await select('/left');
  const before = await active('/right');
  assert.ok(before > 0);
  await page.evaluate(() => document.getElementById('stop').click());
  await waitFor(page, () => doppel.commander.stopped);
  for (let i = 0; i < 100 && await active('/right') > 0; i += 1) await new Promise((done) => setTimeout(done, 50));
  assert.equal(await active('/right'), 0);
  await page.selectOption('#robot', '/rover'); // a second STOP, for another robot, changes nothing
  await waitFor(page, () => doppel.twin.space === '/rover');
  await page.evaluate(() => doppel.commander.stop());
  await page.selectOption('#robot', '/left');
  await waitFor(page, () => doppel.twin.space === '/left');
  await page.evaluate(() => doppel.commander.resetStop());
  for (let i = 0; i < 100 && await active('/right') < before; i += 1) await new Promise((done) => setTimeout(done, 50));
  assert.equal(await active('/right'), before);
});

test('the address chooses the robot', async () => {
  const other = await lab.page({}, `${lab.url}?robot=/right`);
  await waitFor(other, () => doppel.twin.space === '/right' && doppel.world.view !== null);
  await other.close();
  assert.deepEqual(page.problems, []);
});
