// Driving a base from the page: the pad, its dead-man, the gamepad, the stop, and where the robot is drawn.
import assert from 'node:assert/strict';
import { mkdtempSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Lab, waitFor } from './lab.mjs';

const inertial = (mass) => `<inertial><mass value="${mass}"/><inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>`;
const wheel = (name, y) => `<link name="${name}_wheel">${inertial(1)}<visual><origin rpy="1.5708 0 0"/><geometry><cylinder radius="0.1" length="0.04"/></geometry></visual>
  <collision><origin rpy="1.5708 0 0"/><geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
  <joint name="${name}" type="continuous"><parent link="base_link"/><child link="${name}_wheel"/><origin xyz="0 ${y} 0"/><axis xyz="0 1 0"/><limit effort="20" velocity="20"/></joint>`;
const slides = (x) => `<collision><origin xyz="${x} 0 -0.05"/><geometry><sphere radius="0.05"/></geometry></collision>`;
const driven = (name) => `<joint name="${name}"><command_interface name="velocity"/><state_interface name="position"/><state_interface name="velocity"/></joint>`;

const folder = mkdtempSync(join(tmpdir(), 'doppel-drive-'));
writeFileSync(join(folder, 'rover.urdf'), `<robot name="rover"><link name="base_link">${inertial(5)}<visual><geometry><box size="0.4 0.3 0.1"/></geometry></visual>${slides(0.15)}${slides(-0.15)}</link>
  ${wheel('left', 0.2)}${wheel('right', -0.2)}<gazebo reference="base_link"><mu1>0.01</mu1><mu2>0.01</mu2></gazebo>
  <ros2_control name="s" type="system"><hardware><plugin>gz_ros2_control/GazeboSimSystem</plugin></hardware>${driven('left')}${driven('right')}</ros2_control></robot>`);
writeFileSync(join(folder, 'controllers.yaml'), `controller_manager:
  ros__parameters:
    update_rate: 100
    jsb: {type: joint_state_broadcaster/JointStateBroadcaster}
    base: {type: diff_drive_controller/DiffDriveController}
base:
  ros__parameters: {left_wheel_names: [left], right_wheel_names: [right], wheel_separation: 0.4, wheel_radius: 0.1}
`);

const lab = new Lab(undefined, [join(folder, 'rover.urdf'), '--controllers', join(folder, 'controllers.yaml')]);
let page;
before(async () => {
  await lab.start();
  page = await lab.page();
  await waitFor(page, () => doppel.drive.topic() !== null);
  await page.evaluate(() => doppel.layout.open('drive'));
}, { timeout: 120000 });
after(() => lab.stop());

const truth = () => page.evaluate(() => [...doppel.twin.truth]);
const resting = () => waitFor(page, () => {
  const { velocity } = doppel.twin;
  return [...velocity].every((v) => Math.abs(v) < 0.05);
});
const point = async (right, up) => {
  const box = await page.locator('#drive-pad').boundingBox();
  return [box.x + box.width * (right + 1) / 2, box.y + box.height * (1 - up) / 2];
};

test('the pad drives while it is held, and the release stops the base', async () => {
  const before = await truth();
  await page.mouse.move(...await point(0, 0.8));
  await page.mouse.down();
  await waitFor(page, (x) => doppel.twin.truth[0] > x + 0.15, before[0]);
  await page.mouse.up();
  await resting();
  assert.equal(await page.evaluate(() => doppel.drive.live), false);
});

test('the robot is drawn where it truly is, although TF has the odometry as its parent', async () => {
  await waitFor(page, () => doppel.twin.transforms.frames.get('base_link')?.parent === 'odom');
  const [drawn, true_] = await page.evaluate(() => {
    const { twin } = doppel;
    return [[...twin.poses.subarray(twin.tree.root * 7, twin.tree.root * 7 + 3)], [...twin.truth].slice(0, 3)];
  });
  drawn.forEach((value, i) => assert.ok(Math.abs(value - true_[i]) < 1e-9));
  assert.ok(true_[0] > 0.1);
});

test('arrow keys drive while they are held', async () => {
  const yaw = () => page.evaluate(() => 2 * Math.atan2(doppel.twin.truth[5], doppel.twin.truth[6]));
  const before = await yaw();
  await page.focus('#drive-pad');
  await page.keyboard.down('ArrowLeft');
  await waitFor(page, (from) => 2 * Math.atan2(doppel.twin.truth[5], doppel.twin.truth[6]) > from + 0.3, before);
  await page.keyboard.up('ArrowLeft');
  await resting();
});

test('the gamepad drives only while its dead-man button is held', async () => {
  await page.evaluate(() => {
    const buttons = Array.from({ length: 17 }, () => ({ pressed: false, value: 0 }));
    window.pad = { id: 'Test pad', connected: true, axes: [0, 0, 0, 0], buttons };
    Object.defineProperty(navigator, 'getGamepads', { configurable: true, value: () => [window.pad] });
  });
  await page.getByText('The gamepad drives the base').click();
  await page.evaluate(() => (window.pad.axes[1] = 1)); // the stick backward
  await new Promise((done) => setTimeout(done, 400));
  assert.equal(await page.evaluate(() => doppel.drive.live), false);
  await page.evaluate(() => (window.pad.buttons[4].pressed = true));
  await waitFor(page, () => doppel.drive.velocity.x < -0.3);
  await waitFor(page, () => doppel.twin.velocity.some((v) => v < -2));
  await page.evaluate(() => (window.pad.buttons[4].pressed = false));
  await resting();
});

test('the traces of the true and the odometric path are drawn', async () => {
  await page.evaluate(() => doppel.world.setLayer('base', true));
  await page.mouse.move(...await point(0, 0.8));
  await page.mouse.down();
  await waitFor(page, () => doppel.baseTrace.truth.line.geometry.drawRange.count > 5 && doppel.baseTrace.odometry.line.geometry.drawRange.count > 5);
  await page.mouse.up();
  await resting();
});

test('the address with #drive opens the pad', async () => {
  const other = await lab.page({}, `${lab.url}#drive`);
  assert.equal(await other.locator('#drive-pad').isVisible(), true);
  await other.close();
});

test('STOP ends driving, and the pad does nothing until it is released', async () => {
  await page.mouse.move(...await point(0, 0.8));
  await page.mouse.down();
  await waitFor(page, () => doppel.drive.live);
  await page.evaluate(() => document.getElementById('stop').click());
  await waitFor(page, () => doppel.commander.stopped && !doppel.drive.live);
  await page.mouse.up();
  await resting();
  await page.mouse.down();
  assert.equal(await page.evaluate(() => doppel.drive.live), false);
  await page.mouse.up();
  await page.evaluate(() => doppel.commander.resetStop());
  assert.deepEqual(page.problems, []);
});
