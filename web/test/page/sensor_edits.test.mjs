// Views of cameras after edits of their lenses: of the selected robot, of another one and of a model of the world.
import assert from 'node:assert/strict';
import { mkdtempSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Lab, waitFor } from './lab.mjs';

const folder = mkdtempSync(join(tmpdir(), 'doppel-sensor-edits-'));
const camera = (name, hfov, near) => `<sensor name="${name}" type="camera"><topic>${name}/image</topic><update_rate>20</update_rate>
  <camera><horizontal_fov>${hfov}</horizontal_fov><image><width>64</width><height>48</height></image><clip><near>${near}</near><far>20</far></clip></camera></sensor>`;
const writers = {
  eye: (hfov, near) => writeFileSync(join(folder, 'seer.urdf'), `<robot name="seer"><link name="base_link"/><gazebo reference="base_link">${camera('eye', hfov, near)}</gazebo></robot>`),
  other_eye: (hfov, near) => writeFileSync(join(folder, 'other.urdf'), `<robot name="other"><link name="base_link"/><gazebo reference="base_link">${camera('other_eye', hfov, near)}</gazebo></robot>`),
  mast_eye: (hfov, near) => writeFileSync(join(folder, 'room.sdf'), `<sdf version="1.9"><world name="room"><model name="mast"><static>true</static><pose>0 2 1 0 0 0</pose>
    <link name="l">${camera('mast_eye', hfov, near)}</link></model></world></sdf>`),
};
for (const write of Object.values(writers)) write(1.2, 0.05);

const lab = new Lab(undefined, ['--robot', `${join(folder, 'seer.urdf')}:left`, '--robot', `${join(folder, 'other.urdf')}:right@2,0,0`, '--world', join(folder, 'room.sdf')]);
let page;
before(async () => {
  await lab.start();
  page = await lab.page();
  await waitFor(page, () => doppel.sensorPictures.cameras.frusta.size === 3);
}, { timeout: 120000 });
after(() => lab.stop());

// The tangent of half the view's angle by what is drawn.
const wide = ([name, tangent]) => {
  const view = [...doppel.sensorPictures.cameras.frusta].find(([topic]) => topic.endsWith(`/${name}/camera_info`));
  if (!view) return false;
  const corner = (i) => view[1].lines.geometry.attributes.position.array.slice(3 * (1 + 26 * i), 3 * (2 + 26 * i));
  const [left, right] = [corner(0), corner(1)];
  return Math.abs((right[0] - left[0]) / left[2] / 2 - tangent) < 1e-3;
};

for (const name of Object.keys(writers)) {
  test(`a view has the lens that an edit gave to ${name}, also while others read its camera_info`, async () => {
    await waitFor(page, wide, [name, Math.tan(0.6)]);
    writers[name](0.8, 0.05);
    await waitFor(page, wide, [name, Math.tan(0.4)]);
    await page.evaluate((one) => {
      const { list } = doppel.sensors;
      const topic = list.flatMap(({ topics }) => topics).find((t) => t.endsWith(`/${one}/camera_info`));
      window.endReading = doppel.twin.client.subscribe(topic, () => { window.readAlready = true; });
      window.readAlready = false;
    }, name);
    await waitFor(page, () => window.readAlready);
    writers[name](1.2, 0.05);
    await waitFor(page, wide, [name, Math.tan(0.6)]);
    await page.evaluate(() => window.endReading());
  });
}

test('views that no edit changes stay, and are not read again', async () => {
  const lines = () => page.evaluate(() => [...doppel.sensorPictures.cameras.frusta].map(([topic, { lines: { uuid } }]) => `${topic} ${uuid}`).sort());
  const before = await lines();
  writers.eye(1.2, 0.07);
  await waitFor(page, (uuid) => [...doppel.sensorPictures.cameras.frusta.values()].every(({ lines: one }) => one.uuid !== uuid), before.find((one) => one.includes('/eye/')).split(' ')[1]);
  await waitFor(page, () => doppel.sensorPictures.cameras.frusta.size === 3);
  const now = await lines();
  assert.equal(now.filter((one) => before.includes(one)).length, 2);
  assert.deepEqual(page.problems, []);
});
