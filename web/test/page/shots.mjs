// Screenshots of the running page:
//   node test/page/shots.mjs URL FOLDER [NAME...]
import { chromium } from 'playwright-core';
import { mkdirSync } from 'node:fs';

const [url, folder, ...only] = process.argv.slice(2);
mkdirSync(folder, { recursive: true });
const sizes = { wide: [1440, 900], middle: [1024, 768], phone: [390, 844] };
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
    await page.waitForFunction(() => window.doppel?.world.firstPicture > 0, null, { timeout: 20000 }).catch((e) => console.log(e.message));
    await page.evaluate(process.env.BEFORE ?? '0');
    await page.waitForTimeout(Number(process.env.WAIT ?? 1500));
    await page.screenshot({ path: `${folder}/${name}-${theme}.png` });
    console.log(`${name}-${theme}`, await page.evaluate(() => JSON.stringify({ first: Math.round(doppel.world.firstPicture), frame: +doppel.world.stage.frameTime.toFixed(1), frames: doppel.world.stage.frames })));
    await page.close();
  }
}
await browser.close();
