// Pictures of a base that drives into a table, and the strip of them for the tutorial of Kate. Time is paused and taken
// step by step, so that the pictures do not depend on the speed of the machine.
//   node test/page/push.mjs URL FOLDER TABLE     FOLDER/TABLE-0.png ... at 0, 5 and 9 s
//   node test/page/push.mjs strip FOLDER FILE TABLE...
import { chromium } from 'playwright-core';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { waitFor } from './lab.mjs';

const TIMES = [0, 5, 9]; // s
const SPEED = 0.2; // m/s
const PERIOD = 0.1; // s between commands
const [WIDTH, HEIGHT] = [420, 280];
const timeout = 180_000; // rendered by the processor, which may be busy

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--headless=new', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--no-sandbox'],
});

async function driveInto(url, folder, table) {
  const page = await browser.newPage({ viewport: { width: 1024, height: 700 }, colorScheme: 'light' });
  await page.goto(url);
  await waitFor(page, () => window.doppel?.ready && doppel.world.firstPicture > 0 && doppel.drive.topic() !== null, undefined, timeout);
  await page.evaluate(async (chosen) => { // before her; the can on the light table then stands on this one
    const { client } = doppel.twin;
    await client.call('/gazebo/pause_physics', {});
    const put = (name, y) => client.call('/gazebo/set_entity_state', { state: { name, pose: { position: { x: 1.3, y, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } }, reference_frame: 'world' } });
    if (chosen === 'light_table') return;
    await put('light_table', 1.6);
    await put(chosen, 0);
  }, table);
  const place = () => page.evaluate(async (name) => {
    const answer = await doppel.twin.client.call('/gazebo/get_model_state', { model_name: name, relative_entity_name: '' });
    return answer.pose.position.x;
  }, table);
  await page.evaluate(async () => {
    const { world } = doppel;
    doppel.handle.show(false);
    world.camera.follow = null;
    world.stage.camera.position.set(-0.7, -2.9, 1.6);
    world.camera.controls.target.set(1.05, 0, 0.35);
    world.camera.controls.update();
  });
  const start = await place();
  const shown = [];
  let now = 0;
  for (const [at, time] of TIMES.entries()) {
    for (; now < time - PERIOD / 2; now += PERIOD) {
      await page.evaluate(async ([speed, steps]) => {
        const { twin, drive } = doppel;
        const zero = { x: 0, y: 0, z: 0 };
        const stamp = { sec: 0, nanosec: 0 }; // taken as now
        twin.client.publish(drive.topic().name, 'geometry_msgs/msg/TwistStamped', { header: { stamp, frame_id: '' }, twist: { linear: { ...zero, x: speed }, angular: zero } });
        await twin.client.call('/gazebo/step', { steps });
      }, [SPEED, Math.round(PERIOD * 1000)]);
    }
    await page.waitForTimeout(3000);
    const picture = join(folder, `${table}-${at}.png`);
    const canvas = await page.locator('canvas').first().boundingBox();
    const [x, y] = [canvas.x + (canvas.width - WIDTH) / 2, canvas.y + (canvas.height - HEIGHT) / 2];
    await page.screenshot({ path: picture, clip: { x, y, width: WIDTH, height: HEIGHT }, timeout });
    shown.push({ time, moved: await place() - start });
  }
  writeFileSync(join(folder, `${table}.json`), JSON.stringify(shown));
  console.log(table, JSON.stringify(shown));
}

async function compose(folder, file, tables) {
  const image = (name) => `data:image/png;base64,${readFileSync(join(folder, name)).toString('base64')}`;
  const rows = tables.map((table) => JSON.parse(readFileSync(join(folder, `${table}.json`), 'utf8')).map(({ time, moved }, at) =>
    `<figure><img src="${image(`${table}-${at}.png`)}"><figcaption>${table.replace('_', ' ')}, ${time} s: moved ${(Math.abs(moved) * 100).toFixed(0)} cm</figcaption></figure>`).join(''));
  const page = await browser.newPage({ viewport: { width: 960, height: 600 } });
  await page.setContent(`<style>body{margin:0;background:#fff;font:14px sans-serif}div{display:grid;grid-template-columns:repeat(3,1fr);gap:6px;width:960px}
    figure{margin:0}img{width:100%;display:block}figcaption{padding:4px;color:#222}</style><div>${rows.join('')}</div>`);
  await page.locator('div').screenshot({ path: file });
  console.log(file, readFileSync(file).length, 'bytes');
}

const [first, ...rest] = process.argv.slice(2);
if (first === 'strip') await compose(rest[0], rest[1], rest.slice(2));
else await driveInto(first, ...rest);
await browser.close();
