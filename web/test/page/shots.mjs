// Screenshots of the running page, in three sizes and both themes; with TABS=all of every tab, with content in each:
//   [TABS=all] node test/page/shots.mjs URL FOLDER [NAME...]
import { chromium } from 'playwright-core';
import { mkdirSync } from 'node:fs';
import { waitFor } from './lab.mjs';

const [url, folder, ...only] = process.argv.slice(2);
mkdirSync(folder, { recursive: true });
const sizes = { wide: [1440, 900], middle: [1024, 768], phone: [390, 844], side: [844, 390] };
const wait = Number(process.env.WAIT ?? 1500);
const timeout = 180_000; // rendered by the processor, which may be busy

// Actions in the page before the picture of a tab is taken.
const TABS = {
  joints: () => doppel.commander.set(doppel.twin.tree.moving[0], 1.1),
  tree: () => doppel.select({ link: doppel.twin.tree.moving.at(1)?.childLink ?? 0 }),
  tool: () => doppel.select(null),
  sensors: () => doppel.world.setLayer('lidar', true),
  poses: async () => {
    for (const name of ['home', 'above the table']) {
      const input = document.querySelector('#panel-poses input[type=text]');
      input.value = name;
      [...document.querySelectorAll('#panel-poses button')].find((b) => b.textContent === 'Save pose').click();
      [...document.querySelectorAll('#panel-poses button')].filter((b) => b.textContent === '+ step').at(-1).click();
    }
  },
  objects: async () => {
    if (doppel.objects.missing) return;
    document.getElementById('object-add').click();
    await new Promise((done) => setTimeout(done, 500));
    doppel.objects.select([...doppel.objects.objects.keys()][0] ?? null);
  },
  control: () => doppel.objects.select(null),
  health: () => {},
  plots: () => doppel.commander.set(doppel.twin.tree.moving[0], 1.8),
  topics: () => [...document.querySelectorAll('.topic-list button')].find((b) => b.textContent.startsWith('/joint_states'))?.click(),
  drive: () => {},
  services: async () => {
    document.querySelectorAll('.topics-panel .segments button')[1].click();
    await new Promise((done) => setTimeout(done, 200));
    [...document.querySelectorAll('.topic-list button')].find((b) => /switch_controller|apply_joint_effort/.test(b.textContent))?.click();
  },
  parameters: () => {},
  tf: () => {},
  log: () => {},
};

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--headless=new', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--no-sandbox'],
});
for (const theme of ['light', 'dark']) {
  for (const [name, [width, height]] of Object.entries(sizes)) {
    if (only.length > 0 && !only.includes(`${name}-${theme}`)) continue;
    const page = await browser.newPage({ viewport: { width, height }, colorScheme: theme });
    page.on('console', (m) => (m.type() === 'error' || m.type() === 'warning') && console.log(`${name}-${theme}: ${m.text()}`));
    page.on('pageerror', (e) => console.log(`${name}-${theme}: ${e.stack}`));
    await page.goto(url);
    await waitFor(page, () => window.doppel?.ready && doppel.world.firstPicture > 0, undefined, timeout).catch((e) => console.log(e.message));
    await page.evaluate(process.env.BEFORE ?? '0');
    await page.waitForTimeout(wait);
    await page.screenshot({ path: `${folder}/${name}-${theme}.png`, timeout });
    console.log(`${name}-${theme}`, await page.evaluate(() => JSON.stringify({ first: Math.round(doppel.world.firstPicture), frame: +doppel.world.stage.frameTime.toFixed(1), frames: doppel.world.stage.frames })));
    for (const [tab, act] of process.env.TABS === 'all' ? Object.entries(TABS) : []) {
      await page.evaluate((id) => doppel.layout.open(id), tab === 'services' ? 'topics' : tab);
      await page.waitForTimeout(200);
      await page.evaluate(act);
      await page.waitForTimeout(wait / 2);
      await page.screenshot({ path: `${folder}/${name}-${theme}-${tab}.png` });
    }
    await page.close();
  }
}
await browser.close();
