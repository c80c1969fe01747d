// What a visitor meets in Chromium: tabs that apply, grippers, robots without meshes, several robots, a phone, the first visit,
// and what goes over the wire.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { mkdtempSync, readFileSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { freePort, Lab, program, until, waitFor } from './lab.mjs';

const kate = new Lab(undefined, ['kate']);
const folder = mkdtempSync(join(tmpdir(), 'doppel-visit-'));
writeFileSync(join(folder, 'gone.urdf'), `<robot name="gone"><link name="base"><visual><geometry><mesh filename="package://nowhere/base_part.stl"/></geometry></visual></link>
  <link name="arm"><visual><geometry><mesh filename="package://nowhere/arm_part.stl"/></geometry></visual><collision><geometry><cylinder radius="0.04" length="0.3"/></geometry></collision></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="5" velocity="1"/></joint></robot>`);
const many = Array.from({ length: 14 }, (_, i) => `<link name="l${i}"/><joint name="${i < 3 ? 'wheel' : 'finger'}_${i}" type="revolute"><parent link="${i === 0 ? 'base' : `l${i - 1}`}"/><child link="l${i}"/><origin xyz="0 0 0.1"/><axis xyz="0 1 0"/><limit lower="-1" upper="${1 + i / 10}" effort="5" velocity="1"/></joint>`);
writeFileSync(join(folder, 'many.urdf'), `<robot name="many"><link name="base"/>${many.join('')}</robot>`);
const started = [];
// A twin or a view besides the lab's; its address.
async function run(...args) {
  const port = await freePort();
  started.push(spawn(program, [...args, '--no-open', '--no-ros', '--port', String(port)], { stdio: 'ignore', env: { DOPPEL_ROOT: join(import.meta.dirname ?? '.', '../../..'), ...process.env } }));
  await until('the twin', async () => (await fetch(`http://127.0.0.1:${port}/health`)).ok);
  return `http://127.0.0.1:${port}/`;
}
before(() => kate.start(), { timeout: 120000 });
after(async () => {
  for (const one of started) one.kill('SIGKILL');
  await kate.stop();
});

const titles = (page) => page.locator('.tab:visible > span:first-child').allTextContents();
const check = (name, open, body, options = {}) => test(name, { timeout: 180000 }, async () => {
  const page = await kate.page(options, await open(), options.prepare);
  try {
    await kate.watched(name, page, () => body(page));
    assert.deepEqual(page.problems, []);
  } finally {
    await page.close();
  }
});
const atKate = () => kate.url;

check('tabs that do not apply are hidden: a view has neither Control nor Drive, a base has Drive', () => run('view', 'omarm_one'), async (page) => {
  await waitFor(page, () => doppel.commander.viewing);
  await waitFor(page, () => document.getElementById('tab-control').hidden);
  const inView = await titles(page);
  assert.deepEqual(['Control', 'Drive', 'Sensors', 'Objects'].filter((title) => inView.includes(title)), []);
  assert.ok(inView.includes('Joints') && inView.includes('Health'));
  const driven = await kate.page({}, kate.url);
  await waitFor(driven, () => !document.getElementById('tab-drive').hidden);
  assert.ok((await titles(driven)).includes('Control'));
  await driven.close();
});

check('a gripper with an action controller is moved by its slider, and a wheel says what moves it', atKate, async (page) => {
  const gripper = await page.evaluate(() => {
    const controller = doppel.twin.controllers.find((c) => /Gripper/.test(c.type));
    return controller.joints[0];
  });
  const row = page.locator('.joint', { hasText: gripper }).first();
  await row.scrollIntoViewIfNeeded();
  assert.equal(await row.locator('.slider').isDisabled(), false);
  const [from, to] = await page.evaluate((name) => {
    const joint = doppel.twin.tree.jointByName.get(name);
    const q = doppel.twin.q[joint.index];
    return [q, q + 0.4 * ((joint.upper - q > q - joint.lower ? joint.upper : joint.lower) - q)];
  }, gripper);
  await row.locator('.slider').evaluate((slider, value) => {
    slider.value = String(value);
    slider.dispatchEvent(new Event('input', { bubbles: true }));
    slider.dispatchEvent(new Event('change', { bubbles: true }));
  }, to);
  await waitFor(page, ([name, a, b]) => Math.abs(doppel.twin.q[doppel.twin.tree.jointByName.get(name).index] - b) < 0.1 * Math.abs(b - a), [gripper, from, to]);
  const wheel = await page.evaluate(() => doppel.twin.tree.moving.find((joint) => /wheel/.test(joint.name) && !doppel.commander.canMove(joint)).name);
  const last = page.locator('.joint.fixed', { hasText: wheel });
  await last.scrollIntoViewIfNeeded();
  assert.match(await last.locator('.why').textContent(), /^moved by \S+/);
  const rows = await page.locator('.joint .slider').evaluateAll((sliders) => sliders.map((slider) => slider.disabled));
  assert.ok(rows.indexOf(true) > rows.lastIndexOf(false), 'movable joints come first');
});

check('a robot without its meshes is drawn as collision shape and as a marked box, and the note leads to Health', () => run('view', join(folder, 'gone.urdf')), async (page) => {
  await waitFor(page, () => doppel.world.view?.failed.length === 2);
  const drawn = await page.evaluate(() => {
    const seen = [];
    doppel.world.view.root.traverse((one) => one.isMesh && seen.push([one.geometry.type, one.userData.missing ?? '', one.children.length]));
    return seen;
  });
  assert.deepEqual(drawn, [['BoxGeometry', 'package://nowhere/base_part.stl', 1], ['CylinderGeometry', '', 0]]);
  await page.getByRole('button', { name: 'Show the findings about the description' }).click();
  assert.equal(await page.locator('#panel-health').isVisible(), true);
  await waitFor(page, () => /^[✕⚠] \d+$/.test(document.querySelector('#tab-health .badge').textContent));
  assert.match(await page.locator('#tab-health').getAttribute('title'), /\d+ (error|warning)s?/);
  page.problems = page.problems.filter((text) => !/404/.test(text)); // the browser reports files that are not there
});

test('a snapshot shows the marked box of a missing mesh', { timeout: 120000 }, async () => {
  const png = join(folder, 'gone.png');
  execFileSync(program, ['snapshot', join(folder, 'gone.urdf'), '-o', png, '--size', '160x120', '--samples', '1'], { stdio: 'ignore' });
  const page = await kate.browser.newPage();
  const red = await page.evaluate(async (data) => {
    const image = await createImageBitmap(await (await fetch(data)).blob());
    const canvas = new OffscreenCanvas(image.width, image.height);
    canvas.getContext('2d').drawImage(image, 0, 0);
    const { data: pixels } = canvas.getContext('2d').getImageData(0, 0, image.width, image.height);
    let count = 0;
    for (let i = 0; i < pixels.length; i += 4) if (pixels[i] > 90 && pixels[i] > 2 * pixels[i + 1] && pixels[i] > 2 * pixels[i + 2]) count += 1;
    return count;
  }, `data:image/png;base64,${readFileSync(png).toString('base64')}`);
  await page.close();
  assert.ok(red > 40, `${red} red pixels`);
});

check('all robots are in the first picture, and choosing one brings it to the middle with an outline', () => run('up', 'omarm_one', '--robot', 'omarm_one:right@2,1,0', '--robot', 'omarm_one:left@-2,-1,0', '--headless'), async (page) => {
  await waitFor(page, () => doppel.twin.robots.length === 3 && doppel.twin.robots.filter((space) => space !== doppel.twin.space).every((space) => doppel.world.others.get(space)?.placed));
  const where = () => page.evaluate(() => {
    const { camera } = doppel.world.stage;
    camera.updateMatrixWorld();
    const at = (matrix) => {
      const v = doppel.world.stage.sun.position.clone().setFromMatrixPosition(matrix).project(camera);
      return [v.x, v.y];
    };
    const roots = [doppel.world.view, ...doppel.twin.robots.map((space) => doppel.world.others.get(space)?.view).filter(Boolean)];
    return roots.map((view) => at(view.links[view.tree.root].matrixWorld));
  });
  await waitFor(page, () => doppel.world.framed.containsBox(doppel.world.others.bounds()));
  for (const [x, y] of await where()) assert.ok(Math.abs(x) < 0.95 && Math.abs(y) < 0.95, `a robot is at ${x}, ${y}`);
  const other = await page.evaluate(() => doppel.twin.robots.find((space) => space !== doppel.twin.space));
  await page.selectOption('#robot', other);
  await waitFor(page, (space) => doppel.twin.space === space && doppel.world.view?.loading === 0, other);
  await waitFor(page, () => {
    const { camera } = doppel.world.stage;
    const box = doppel.world.outline.box;
    const centre = box.min.clone().add(box.max).multiplyScalar(0.5).project(camera);
    return doppel.world.outline.visible && Math.abs(centre.x) < 0.15 && Math.abs(centre.y) < 0.25;
  });
});

check('the joints are searched and have their limits at the ends', () => run('view', join(folder, 'many.urdf')), async (page) => {
  const field = page.getByLabel('Search joints');
  await field.fill('wheel');
  const names = await page.locator('.joint .name').allTextContents();
  assert.ok(names.length > 0 && names.every((name) => /wheel/.test(name)), names.join());
  await field.fill('nothing of this name');
  assert.equal(await page.locator('.joints').textContent(), 'No match.');
  await field.fill('');
  const texts = await page.locator('.joint:not(.mimic)').first().locator('.limit').allTextContents();
  const limits = await page.evaluate(() => {
    const joint = doppel.twin.tree.moving.find((one) => doppel.commander.canMove(one));
    return joint.kind === 'prismatic' ? [joint.lower * 1000, joint.upper * 1000] : [joint.lower * 180 / Math.PI, joint.upper * 180 / Math.PI];
  });
  texts.forEach((text, i) => assert.ok(Math.abs(Number(text) - limits[i]) < 0.06, `${text} for ${limits[i]}`));
});

test('meshes come over HTTP, compressed, and a reload asks only whether they have changed', { timeout: 180000 }, async () => {
  const context = await kate.browser.newContext();
  const page = await context.newPage();
  const answers = [];
  page.on('response', async (response) => response.url().includes('/files?') && answers.push([response.status(), (await response.allHeaders())['content-encoding'] ?? '']));
  const sent = [];
  page.on('websocket', (socket) => socket.on('framesent', ({ payload }) => typeof payload === 'string' && sent.push(payload)));
  const loaded = () => waitFor(page, () => window.doppel?.ready && doppel.world.view?.loading === 0);
  await page.goto(kate.url);
  await loaded();
  const first = answers.splice(0);
  assert.ok(first.length > 3 && first.every(([status]) => status === 200), JSON.stringify(first));
  assert.ok(first.some(([, coding]) => coding === 'gzip'));
  const client = await context.newCDPSession(page);
  await client.send('Network.enable');
  const statuses = [];
  client.on('Network.responseReceivedExtraInfo', ({ statusCode, headers }) => (headers.ETag ?? headers.etag) && statuses.push(statusCode));
  await page.reload();
  await loaded();
  assert.ok(statuses.filter((status) => status === 304).length >= first.length, JSON.stringify(statuses));
  assert.deepEqual(sent.filter((text) => text.includes('fetchAsset')), []);
  await context.close();
});

test('at rest the messages of a frame arrive together', { timeout: 180000 }, async () => {
  const context = await kate.browser.newContext();
  const page = await context.newPage();
  let frames = 0;
  page.on('websocket', (socket) => socket.on('framereceived', () => (frames += 1)));
  await page.goto(kate.url);
  await waitFor(page, () => window.doppel?.ready && doppel.world.view?.loading === 0);
  const count = () => page.evaluate(() => [[...doppel.twin.client.received.values()].reduce((sum, one) => sum + one.count, 0), performance.now()]);
  await page.waitForTimeout(1000);
  const [before, at] = await count();
  const framesBefore = frames;
  await page.waitForTimeout(3000);
  const [now, then] = await count();
  const messages = now - before, received = frames - framesBefore;
  console.log(`# ${(messages / (then - at) * 1000).toFixed(0)} messages/s in ${(received / (then - at) * 1000).toFixed(0)} frames/s`);
  assert.ok(messages > 100 && received < 0.5 * messages, `${messages} messages in ${received} frames`);
  await context.close();
});

check('upright, the divider sets the height of the picture, and lists and details are two pages', atKate, async (page) => {
  const height = () => page.evaluate(() => document.querySelector('section.stage').clientHeight);
  const full = await height();
  const grip = await page.locator('.splitter.h').boundingBox();
  await page.mouse.move(grip.x + grip.width / 2, grip.y + grip.height / 2);
  await page.mouse.down();
  await page.mouse.move(grip.x + grip.width / 2, grip.y - 140, { steps: 5 });
  await page.mouse.up();
  assert.ok(full - (await height()) > 100, `${full} to ${await height()} px`);
  await page.evaluate(() => doppel.layout.open('topics'));
  assert.ok((await page.locator('.topic-list button:visible').count()) >= 8);
  await page.locator('.topic-list button', { hasText: '/joint_states' }).first().click();
  assert.equal(await page.locator('.topic-list').first().isVisible(), false);
  await page.getByRole('button', { name: 'Back to the list' }).first().click();
  assert.equal(await page.locator('.topic-list').first().isVisible(), true);
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 390);
}, { viewport: { width: 390, height: 844 } });

check('on its side, a phone has the picture beside one dock', atKate, async (page) => {
  const stage = await page.locator('section.stage').boundingBox(), dock = await page.locator('.dock.right').boundingBox();
  assert.ok(stage.height > 300 && stage.width > 320, JSON.stringify(stage));
  assert.ok(dock.x >= stage.x + stage.width && dock.height > 300, JSON.stringify(dock));
  assert.equal(await page.locator('.dock.bottom').isVisible(), false);
  assert.equal(await page.locator('#stop').isVisible(), true);
}, { viewport: { width: 844, height: 390 } });

const loopback = join(folder, 'real.urdf');
writeFileSync(loopback, `<robot name="real"><link name="base"/><link name="arm"><visual><geometry><box size="0.1 0.1 0.3"/></geometry></visual><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="5" velocity="1"/></joint>
  <ros2_control name="device" type="system"><hardware><plugin>doppel/Loopback</plugin></hardware><joint name="shoulder"><command_interface name="position"/><state_interface name="position"/></joint></ros2_control></robot>`);
check('on hardware, what moves or releases the whole robot is confirmed; STOP works beside the question', () => run('up', loopback, '--headless'), async (page) => {
  await waitFor(page, () => doppel.hardware.real && doppel.twin.controllers.some((c) => c.state === 'active' && c.interface === 'position'));
  const target = () => page.evaluate(() => doppel.twin.target[0]);
  await page.evaluate(() => doppel.commander.set(doppel.twin.tree.moving[0], 0.3));
  await page.getByRole('button', { name: 'All joints to zero' }).click();
  assert.ok(Math.abs((await target()) - 0.3) < 0.01, 'nothing is sent before the confirmation');
  assert.match(await page.locator('dialog.confirm').textContent(), /drives real hardware/);
  await page.click('#confirm');
  await waitFor(page, () => Math.abs(doppel.twin.target[0]) < 0.001);
  await page.evaluate(() => doppel.layout.open('control'));
  await page.locator('.controller', { hasText: 'position' }).last().getByRole('button', { name: /^Deactivate/ }).click();
  assert.match(await page.locator('dialog.confirm').textContent(), /the arm will fall/);
  await page.click('#stop');
  await waitFor(page, () => doppel.commander.stopped);
  await page.getByRole('button', { name: 'Do nothing' }).click();
  await page.locator('dialog').waitFor({ state: 'detached' });
});

test('the first steps are shown once, and the title has the robot and its state', { timeout: 180000 }, async () => {
  const context = await kate.browser.newContext();
  const page = await context.newPage();
  await page.goto(kate.url);
  await page.locator('.hints').waitFor();
  assert.match(await page.locator('.hints').textContent(), /drag to turn.*Joints.*Escape/s);
  await page.locator('.hints').getByRole('button').click();
  assert.equal(await page.locator('.hints').count(), 0);
  await page.reload();
  await waitFor(page, () => window.doppel?.ready);
  assert.equal(await page.locator('.hints').count(), 0);
  await waitFor(page, () => document.title === doppel.twin.tree.robot.name);
  await page.click('#stop');
  await waitFor(page, () => document.title === `${doppel.twin.tree.robot.name} – stopped`);
  await page.click('#stop');
  await waitFor(page, () => document.title === doppel.twin.tree.robot.name);
  await page.click('#settings');
  assert.match(await page.locator('dialog').textContent(), /doppel \d+\.\d+\.\d+\..*doppel man/s);
  await context.close();
});
