// Sensors in the page: pictures, scans and numbers in the panel, frusta, points and forces in the picture, and that
// nothing is read that nobody sees.
import assert from 'node:assert/strict';
import { mkdtempSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Lab, waitFor } from './lab.mjs';

const WALL = 2; // m: x of the wall's face
const solid = (mass, size) => `<inertial><mass value="${mass}"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  <visual><geometry><box size="${size}"/></geometry></visual><collision name="${mass}_kg"><geometry><box size="${size}"/></geometry></collision>`;
const fixed = (name, parent, child, xyz, rpy = '0 0 0') => `<joint name="${name}" type="fixed"><parent link="${parent}"/><child link="${child}"/><origin xyz="${xyz}" rpy="${rpy}"/></joint>`;
const sensor = (on, name, type, rate, inside) => `<gazebo reference="${on}"><sensor name="${name}" type="${type}"><topic>${/^(camera|depth)$/.test(name) ? `${name}/image` : name}</topic><update_rate>${rate}</update_rate>${inside}</sensor></gazebo>`;
const camera = '<camera><horizontal_fov>1.2</horizontal_fov><image><width>64</width><height>48</height></image><clip><near>0.05</near><far>20</far></clip></camera>';
const rays = (vertical) => `<lidar><scan><horizontal><samples>41</samples><min_angle>-2.2</min_angle><max_angle>-0.9</max_angle></horizontal>${vertical}</scan><range><min>0.1</min><max>10</max></range></lidar>`;
const tilted = '<vertical><samples>3</samples><min_angle>-0.1</min_angle><max_angle>0.1</max_angle></vertical>';

const folder = mkdtempSync(join(tmpdir(), 'doppel-sensors-'));
// The lidars' mast is turned, so that points in the wrong axes are not on the wall.
writeFileSync(join(folder, 'probe.urdf'), `<robot name="probe"><link name="world"/><link name="base_link">${solid(5, '0.2 0.2 0.2')}</link>${fixed('foot', 'world', 'base_link', '0 0 0.1')}
  <link name="mast"/>${fixed('mast_joint', 'base_link', 'mast', '0.2 0.1 0.6', '0.05 0.02 1.5708')}<link name="eye"/>${fixed('eye_joint', 'base_link', 'eye', '0.2 -0.1 0.6')}
  <link name="weight">${solid(1, '0.1 0.1 0.1')}</link>${fixed('hook', 'base_link', 'weight', '-0.5 0 0.5')}
  <link name="plate">${solid(2, '0.4 0.4 0.02')}</link>${fixed('plate_joint', 'base_link', 'plate', '0 1 0.1')}
  ${sensor('mast', 'scan', 'gpu_lidar', 10, rays(''))}${sensor('mast', 'rings', 'gpu_lidar', 5, rays(tilted))}${sensor('eye', 'camera', 'camera', 10, camera)}
  ${sensor('eye', 'depth', 'depth_camera', 5, camera)}${sensor('eye', 'imu', 'imu', 50, '')}${sensor('eye', 'sonar', 'sonar', 10, '<sonar><min>0.1</min><max>5</max><radius>0.1</radius></sonar>')}
  ${sensor('plate', 'touch', 'contact', 20, '<contact><collision>2_kg</collision></contact>')}${sensor('hook', 'hook_wrench', 'force_torque', 50, '')}
  <link name="hand">${solid(0.5, '0.1 0.1 0.1')}</link>${fixed('grip', 'base_link', 'hand', '0.5 0.3 0.4', '0 0 1.5708')}
  ${sensor('grip', 'grip_wrench', 'force_torque', 50, '<pose>0.1 0 0.05 0 0 0.3</pose><force_torque><frame>parent</frame></force_torque>')}</robot>`);
const model = (name, still, pose, size, colour) => {
  const shape = `<geometry><box><size>${size}</size></box></geometry>`;
  return `<model name="${name}"><static>${still}</static><pose>${pose}</pose><link name="l"><inertial><mass>3</mass><inertia><ixx>0.02</ixx><iyy>0.02</iyy><izz>0.02</izz></inertia></inertial>
    <collision name="c">${shape}</collision><visual name="v">${shape}<material><ambient>${colour}</ambient><diffuse>${colour}</diffuse></material></visual></link></model>`;
};
writeFileSync(join(folder, 'room.sdf'), `<sdf version="1.9"><world name="room"><scene><background>0.2 0.4 1 1</background></scene>${model('wall', true, `${WALL + 0.05} 0 0.5 0 0 0`, '0.1 8 1', '1 0.1 0.1 1')}${model('box', false, '0 1 0.33 0 0 0', '0.2 0.2 0.2', '0.5 0.5 0.5 1')}
  <light name="sun" type="directional"><direction>1 0 -0.5</direction><diffuse>1 1 1 1</diffuse></light></world></sdf>`);

const lab = new Lab(undefined, [join(folder, 'probe.urdf'), '--world', join(folder, 'room.sdf')]);
let page;
before(async () => {
  await lab.start();
  page = await lab.page({ viewport: { width: 1280, height: 800 } });
  await waitFor(page, () => doppel.sensors.list.length === 9);
}, { timeout: 120000 });
after(() => lab.stop());

const open = (id) => page.evaluate((name) => doppel.layout.open(name), id);
const layer = (name, on) => page.evaluate(([id, value]) => doppel.world.setLayer(id, value), [name, on]);
const card = (name) => page.locator(`.sensor[aria-label$="/${name}"]`);
const into = (name) => card(name).scrollIntoViewIfNeeded();
const reached = (name) => (condition) => waitFor(page, ([one, more]) => {
  const { reached: rate } = doppel.sensors.list.find((s) => s.name.endsWith(`/${one}`));
  return more ? rate > 0 : rate === 0;
}, [name, condition]);
// The points of a layer's set in the world.
const worldPoints = (set, name) => page.evaluate(([id, sensorName]) => {
  const one = [...doppel.sensorPictures[id].sets].find(([key]) => key.endsWith(`/${sensorName}`))?.[1];
  if (!one || one.buffer.count === 0) return [];
  const { array } = one.points.geometry.attributes.position;
  const { elements: e } = one.points.matrix;
  return Array.from({ length: one.points.geometry.drawRange.count }, (_, i) => [0, 1, 2].map((row) => e[row] * array[3 * i] + e[row + 4] * array[3 * i + 1] + e[row + 8] * array[3 * i + 2] + e[row + 12]));
}, [set, name]);
const drawn = (set, name) => waitFor(page, ([id, sensorName]) => [...doppel.sensorPictures[id].sets].some(([key, one]) => key.endsWith(`/${sensorName}`) && one.points.visible), [set, name]);

test('only the views of the cameras are read before anything is shown, and only once', async () => {
  await waitFor(page, () => doppel.sensorPictures.cameras.frusta.size === 2);
  await waitFor(page, () => doppel.sensors.list.every((one) => one.reached === 0));
  const names = await page.evaluate(() => doppel.sensors.list.flatMap((one) => one.topics).filter((topic) => doppel.twin.client.subscriptions.has(topic)));
  assert.deepEqual(names, []);
});

test('a view begins at its camera, looks along it and has the picture’s width', async () => {
  await waitFor(page, () => [...doppel.sensorPictures.cameras.frusta.values()].every(({ lines }) => lines.visible));
  const [centre, corners] = await page.evaluate(() => {
    const { lines } = doppel.sensorPictures.cameras.frusta.values().next().value;
    lines.updateMatrixWorld();
    const at = (i) => lines.geometry.attributes.position.array.slice(3 * i, 3 * i + 3);
    const moved = (p) => [0, 1, 2].map((row) => lines.matrixWorld.elements[row] * p[0] + lines.matrixWorld.elements[row + 4] * p[1] + lines.matrixWorld.elements[row + 8] * p[2] + lines.matrixWorld.elements[row + 12]);
    return [moved(at(0)), [0, 1, 2, 3].map((i) => moved(at(1 + 26 * i)))];
  });
  centre.forEach((value, i) => assert.ok(Math.abs(value - [0.2, -0.1, 0.7][i]) < 1e-4, `the camera is at ${centre}`));
  const depth = corners[0][0] - centre[0];
  assert.ok(depth > 0);
  const wide = Math.abs(corners[0][1] - corners[1][1]), high = Math.abs(corners[0][2] - corners[3][2]);
  assert.ok(Math.abs(wide / depth - 2 * Math.tan(0.6)) < 1e-3 && Math.abs(high / wide - 48 / 64) < 1e-3, `${wide} x ${high} at ${depth}`);
  assert.ok(corners[0][1] > corners[1][1] && corners[0][2] > corners[3][2], 'the first corner is the upper left one');
});

test('the panel shows the rates, and a picture of the right size with what is before the camera', async () => {
  await open('sensors');
  await into('camera');
  await waitFor(page, () => document.querySelector('.sensor[aria-label$="/camera"] canvas')?.width === 64);
  await reached('camera')(true);
  assert.match(await card('camera').locator('.rates').textContent(), /target10 Hzmeasured\d+\.\d Hzdropped\d+/);
  const [height, wall, sky, shape] = await page.evaluate(() => {
    const canvas = document.querySelector('.sensor[aria-label$="/camera"] canvas');
    const pixel = (x, y) => [...canvas.getContext('2d').getImageData(x, y, 1, 1).data].slice(0, 3);
    return [canvas.height, pixel(32, 24), pixel(32, 2), canvas.clientWidth / canvas.clientHeight];
  });
  assert.equal(height, 48);
  assert.ok(wall[0] > 2 * wall[2], `the wall is ${wall}`);
  assert.ok(sky[2] > 1.5 * sky[0], `above it is ${sky}`);
  assert.ok(Math.abs(shape - 64 / 48) < 0.02);
});

test('a picture is enlarged and reduced by keys, and stays live; Escape stops as well', async () => {
  await page.focus('.sensor[aria-label$="/camera"] .picture');
  await page.keyboard.press('Enter');
  await page.locator('dialog.large-picture canvas').waitFor();
  assert.ok((await page.locator('dialog.large-picture canvas').boundingBox()).width > 600);
  const frames = () => page.evaluate(() => doppel.twin.client.received.get('/camera/image/compressed').count);
  const before = await frames();
  await waitFor(page, (count) => doppel.twin.client.received.get('/camera/image/compressed').count > count + 2, before);
  await page.keyboard.press('Escape');
  await page.locator('.sensor[aria-label$="/camera"] .picture canvas').waitFor();
  assert.equal(await page.evaluate(() => doppel.commander.stopped), true);
  await page.evaluate(() => doppel.commander.resetStop());
  await waitFor(page, () => !doppel.commander.stopped);
});

test('a depth image has its scale, numbers have their values', async () => {
  await into('depth');
  await waitFor(page, () => /32FC1, \d/.test(document.querySelector('.sensor[aria-label$="/depth"] figcaption')?.textContent ?? ''));
  const [, least] = /32FC1, ([\d.]+) …/.exec(await card('depth').locator('figcaption').textContent());
  assert.ok(Math.abs(Number(least) - 1.2) < 0.8, `the nearest depth is ${least} m`);
  await into('imu');
  await waitFor(page, () => Math.abs(Number(document.querySelector('.sensor[aria-label$="/imu"] tbody tr td:nth-child(4)')?.textContent) - 9.81) < 0.02);
  await into('sonar');
  await waitFor(page, () => Math.abs(parseFloat(document.querySelector('.sensor[aria-label$="/sonar"] output')?.textContent) - 1.8) < 0.2);
  await into('hook_wrench');
  await waitFor(page, () => Math.abs(Number(document.querySelector('.sensor[aria-label$="/hook_wrench"] tbody tr td:last-child')?.textContent) - 9.81) < 0.05);
  await into('touch');
  await waitFor(page, () => /touches.*box/.test(document.querySelector('.sensor[aria-label$="/touch"] .touches')?.textContent ?? ''));
  await into('scan');
  await waitFor(page, () => /41 of 41 rays hit/.test(document.querySelector('.sensor[aria-label$="/scan"] .scan')?.textContent ?? ''));
});

test('nothing is read any more when the panel is hidden', async () => {
  await into('camera');
  await reached('camera')(true);
  await open('joints');
  await reached('camera')(false);
  await waitFor(page, () => doppel.sensors.list.every((one) => one.reached === 0));
});

test('nothing is read while the tab is in the background', async () => {
  await open('sensors');
  await into('camera');
  await reached('camera')(true);
  const turn = (hidden) => page.evaluate((value) => {
    Object.defineProperty(document, 'hidden', { configurable: true, get: () => value });
    document.dispatchEvent(new Event('visibilitychange'));
  }, hidden);
  await turn(true);
  await reached('camera')(false);
  await turn(false);
  await reached('camera')(true);
  await open('joints');
});

test('points of a scan and of rings lie on the wall', async () => {
  await layer('lidar', true);
  for (const [name, count] of [['scan', 41], ['rings', 123]]) {
    await drawn('lidar', name);
    const points = await worldPoints('lidar', name);
    assert.equal(points.length, count);
    for (const [x] of points) assert.ok(Math.abs(x - WALL) < 1e-3, `${name}: a point at x = ${x}`);
    assert.ok(new Set(points.map(([, y]) => y.toFixed(3))).size > 30);
  }
  await waitFor(page, () => doppel.twin.client.subscriptions.has('/scan') && !doppel.twin.client.subscriptions.has('/scan/points'));
  assert.match(await page.locator('.stage-legend').textContent(), /Lidar, range0 … 5 m/);
});

test('a sensor that is not to be shown has no points and is not read', async () => {
  await open('sensors');
  await card('scan').getByLabel('Show').uncheck();
  await waitFor(page, () => ![...doppel.sensorPictures.lidar.sets.keys()].some((name) => name.endsWith('/scan')));
  await reached('scan')(false);
  await card('scan').getByLabel('Show').check();
  await drawn('lidar', 'scan');
  await open('joints');
  await layer('lidar', false);
  await waitFor(page, () => doppel.sensorPictures.lidar.sets.size === 0);
});

test('points of a depth camera lie on the wall or on the ground', async () => {
  await layer('clouds', true);
  await drawn('clouds', 'depth');
  const points = await worldPoints('clouds', 'depth');
  assert.ok(points.length > 500);
  const onWall = points.filter(([x]) => Math.abs(x - WALL) < 1e-3);
  assert.ok(onWall.length > 300);
  for (const [x, y, z] of points) assert.ok(Math.abs(x - WALL) < 1e-3 || Math.abs(z) < 1e-3 || Math.abs(z - 1) < 2e-3 || x > WALL, `a point at ${x}, ${y}, ${z}`);
  await layer('clouds', false);
});

test('forces are arrows where they act, with their scale in the legend', async () => {
  await layer('touches', true);
  await layer('wrenches', true);
  const arrow = (kind) => page.evaluate((name) => {
    const { arrows } = doppel.sensorPictures.forces.kinds[name];
    const shown = arrows.root.children.filter((one) => one.type !== 'Mesh' && one.visible);
    return shown.map((one) => {
      const { x, y, z, w } = one.quaternion; // which turns the y axis to the arrow's
      return { at: one.position.toArray(), along: [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)] };
    });
  }, kind);
  await waitFor(page, () => ['touch', 'force'].every((kind) => doppel.sensorPictures.forces.kinds[kind].scale.most > 0));
  // The grip's is in the axes of its parent, and where the sensor is.
  await waitFor(page, () => doppel.sensorPictures.forces.kinds.force.arrows.used === 2);
  const forces = await arrow('force');
  for (const place of [[-0.5, 0, 0.6], [0.5, 0.4, 0.55]]) {
    const here = forces.find(({ at }) => at.every((value, i) => Math.abs(value - place[i]) < 1e-3));
    assert.ok(here && Math.abs(here.along[2]) > 0.99, `no force along z at ${place}: ${JSON.stringify(forces)}`);
  }
  const touches = await arrow('touch');
  assert.ok(touches.length >= 3);
  for (const { at, along } of touches) {
    assert.ok(Math.abs(at[2] - 0.21) < 0.005 && Math.abs(at[0]) < 0.11 && Math.abs(at[1] - 1) < 0.11, `a contact at ${at}`);
    assert.ok(along[2] < -0.9, `the force on the plate is along ${along}`);
  }
  assert.match(await page.locator('.stage-legend').textContent(), /Contact force, longest arrow\d+ NForce, longest arrow10 N/);
  await layer('touches', false);
  await layer('wrenches', false);
  assert.equal(await page.locator('.stage-legend').isHidden(), true);
  assert.deepEqual(page.problems, []);
});

test('a lost connection closes an enlarged picture, and the sensors come back with the twin', async () => {
  await open('sensors');
  await into('camera');
  await waitFor(page, () => document.querySelector('.sensor[aria-label$="/camera"] canvas')?.width === 64);
  await page.focus('.sensor[aria-label$="/camera"] .picture');
  await page.keyboard.press('Enter');
  await page.locator('dialog.large-picture canvas').waitFor();
  await lab.killTwin();
  await page.getByText('No connection.').first().waitFor();
  await waitFor(page, () => document.querySelector('dialog.large-picture') === null);
  await lab.startTwin();
  await waitFor(page, () => doppel.sensors.list.length === 9);
  await into('camera');
  await reached('camera')(true);
  await waitFor(page, () => doppel.sensorPictures.cameras.frusta.size === 2);
});
