// The frames of the README's film: an arm is made, started, moved, dragged by its tool, and edited while it moves. Time is
// paused and taken step by step, so that the film does not depend on the speed of the machine.
//   node test/page/film.mjs URL FOLDER PROGRAM     FOLDER has my_arm_description, new.txt and up.log; writes FOLDER/frames.txt
import { chromium } from 'playwright-core';
import { execFileSync, spawn } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { until, waitFor } from './lab.mjs';

const [url, folder, program] = process.argv.slice(2);
const [WIDTH, HEIGHT] = [960, 600];
const FRAME = 100; // ms, of the film and of simulated time
const timeout = 180_000; // rendered by the processor, which may be busy
const port = new URL(url).port;

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--headless=new', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--no-sandbox'],
});
const page = await browser.newPage({ viewport: { width: WIDTH, height: HEIGHT }, colorScheme: 'light' });
const frames = []; // arguments of img2webp

async function shoot(milliseconds = FRAME) {
  const file = join(folder, `frame-${String(frames.length).padStart(4, '0')}.png`);
  await page.screenshot({ path: file, timeout });
  frames.push(`-d ${milliseconds} ${file}`);
}

// -- a terminal over the page, and a mouse pointer, which a screenshot does not contain
const terminal = { text: '' };
async function draw(full = false) {
  await page.evaluate(([text, whole]) => {
    let box = document.getElementById('film-terminal');
    if (!box) {
      box = document.createElement('pre');
      box.id = 'film-terminal';
      document.body.append(box);
      Object.assign(box.style, {
        position: 'fixed', zIndex: 1000, left: '10px', bottom: '10px', margin: 0, padding: '10px 14px', overflow: 'hidden',
        boxSizing: 'border-box', borderRadius: '6px', background: 'rgba(20, 24, 32, 0.93)', color: '#e8eaf0', font: '12px/1.45 monospace',
        display: 'flex', flexDirection: 'column', whiteSpace: 'pre',
      });
    }
    Object.assign(box.style, whole
      ? { right: '10px', top: '10px', width: 'auto', height: 'auto', fontSize: '14px', justifyContent: 'flex-start' }
      : { right: 'auto', top: 'auto', width: '540px', height: '96px', fontSize: '11px', justifyContent: 'flex-end' });
    box.textContent = text;
  }, [terminal.text, full]);
}
async function type(command, full = false) {
  const prompt = `${terminal.text}${terminal.text === '' ? '' : '\n'}$ `;
  for (let end = 0; end <= command.length; end += 4) {
    terminal.text = `${prompt}${command.slice(0, end)}_`;
    await draw(full);
    await shoot(80);
  }
  terminal.text = prompt + command;
  await draw(full);
  await shoot(300);
}
async function print(text, full = false, milliseconds = 900) {
  terminal.text += `\n${text.trimEnd()}`;
  await draw(full);
  await shoot(milliseconds);
}
const point = (at) => page.evaluate((place) => {
  let cursor = document.getElementById('film-cursor');
  if (!cursor) {
    cursor = document.createElement('div');
    cursor.id = 'film-cursor';
    document.body.append(cursor);
    Object.assign(cursor.style, {
      position: 'fixed', zIndex: 1001, width: '14px', height: '14px', borderRadius: '50%', border: '2px solid #fff', background: 'rgba(30, 90, 220, 0.8)',
      transform: 'translate(-50%, -50%)', pointerEvents: 'none',
    });
  }
  cursor.style.display = place ? 'block' : 'none';
  if (place) Object.assign(cursor.style, { left: `${place.x}px`, top: `${place.y}px` });
}, at);

const call = (service, request) => page.evaluate(([name, data]) => doppel.twin.client.call(name, data), [service, request]);
// Frames of the moving arm.
async function run(count, each = async () => {}) {
  for (let i = 0; i < count; i += 1) {
    await each(i);
    const time = await page.evaluate(() => doppel.twin.status.simTime);
    await call('/gazebo/step', { steps: FRAME });
    await waitFor(page, (before) => doppel.twin.status.simTime > before + 0.09, time, timeout);
    await page.evaluate(() => new Promise((done) => { requestAnimationFrame(() => requestAnimationFrame(done)); }));
    await shoot();
  }
}
async function ready() {
  await waitFor(page, () => window.doppel?.ready && doppel.world.firstPicture > 0, undefined, timeout);
  await page.waitForTimeout(4000); // the panels
}
// A command of the film's shell; the twin's time only moves with the frames.
function start(...words) {
  const child = spawn(program, [...words, '--port', port], { stdio: 'ignore' });
  return new Promise((done) => { child.on('exit', done); });
}

// 1. An arm is made and started.
await page.setContent('<body style="margin:0;background:#dfe3ea"></body>');
await type('doppel new my_arm --dof 4 --gripper', true);
await print(readFileSync(join(folder, 'new.txt'), 'utf8').split('\n\n')[0], true);
await type('doppel up my_arm_description', true);
await print(readFileSync(join(folder, 'up.log'), 'utf8').replace(/^.*(note|fix):.*\n/gm, ''), true, 1500);

// 2. It moves by command.
await page.goto(url);
await ready();
await call('/gazebo/pause_physics', {});
await page.evaluate(() => {
  document.querySelector('.hints button')?.click(); // the first steps, which cover the picture
  document.getElementById('fold').click(); // the picture has the height of the window
  doppel.handle.show(true);
});
terminal.text = '';
await draw();
await shoot(1000);
await type('doppel move joint_1=0.9 joint_2=0.9 joint_3=0.5 --in 2');
const moved = start('move', 'joint_1=0.9', 'joint_2=0.9', 'joint_3=0.5', '--in', '2');
await page.waitForTimeout(1500);
await run(26);

// 3. Its tool is dragged.
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
  await page.waitForTimeout(300);
  return page.evaluate(() => doppel.handle.controls.axis !== null);
}, 60_000);
await point(at);
await shoot(500);
await page.mouse.down();
await run(36, async (i) => {
  const angle = (i / 36) * 2 * Math.PI;
  const to = { x: at.x + 45 * Math.sin(angle), y: at.y - 45 * (1 - Math.cos(angle)) };
  await page.mouse.move(to.x, to.y);
  await point(to);
});
await page.mouse.up();
await point(null);
await run(4);

// 4. Its description is edited while it moves.
const returned = start('move', 'joint_1=-0.9', 'joint_2=0.6', '--in', '5');
await page.waitForTimeout(1500);
await run(8);
const file = 'my_arm_description/urdf/my_arm.urdf.xacro';
await type('sed -i s/0.2857/0.42/ my_arm.urdf.xacro # a longer upper arm');
const before = readFileSync(join(folder, 'up.log'), 'utf8').length;
execFileSync('sed', ['-i', 's/0.2857/0.42/', join(folder, file)]);
const log = () => readFileSync(join(folder, 'up.log'), 'utf8').slice(before);
await until('the reload', async () => log().includes('applied in'), 60_000);
await ready();
await print(/\S+ applied in .*/.exec(log())[0], false, 400);
await run(46);
await shoot(1500);
await browser.close();
await Promise.all([moved, returned]);
writeFileSync(join(folder, 'frames.txt'), frames.join(' '));
console.log(frames.length, 'frames');
