// The time until the first picture of omarm_one is complete, for five openings after one warm-up:
//   DOPPEL=build/bin/doppel npm run bench:page [-- OTHER]
// OTHER: another checkout with its web/dist built; the two are opened in turns. LINK=1.6: over a link of that many
// Mbit/s, with a round trip of 40 ms. OPENINGS=9: the number of openings. MARKS=1 prints the durations of the phases.
// Exits with 1 if the median exceeds the limit; with LINK there is no limit.
import { Lab } from '../page/lab.mjs';

const LIMIT = 1500; // ms
const LATENCY = 40; // ms
const link = Number(process.env.LINK ?? 0); // Mbit/s; 0: unlimited
const openings = Number(process.env.OPENINGS ?? 5);
const other = process.argv[2];

async function throttle(page) {
  const session = await page.context().newCDPSession(page);
  const rate = (link * 1e6) / 8;
  await session.send('Network.enable');
  await session.send('Network.emulateNetworkConditions', { offline: false, latency: LATENCY, downloadThroughput: rate, uploadThroughput: rate });
}

async function open({ lab, times }, counts) {
  const page = await lab.page({ viewport: { width: 1440, height: 900 } }, lab.url, link > 0 ? throttle : undefined);
  const { first, marks } = await page.evaluate(() => ({
    first: doppel.world.firstPicture,
    marks: performance.getEntriesByType('mark').map((mark) => `${mark.name.replace('doppel: ', '')} ${Math.round(mark.startTime)}`).join(', '),
  }));
  if (process.env.MARKS) console.log(marks);
  if (counts) times.push(first);
  await page.close();
}

const sides = [{ name: 'this', lab: new Lab(), times: [] }, ...(other ? [{ name: other, lab: new Lab(other), times: [] }] : [])];
for (const { lab } of sides) await lab.start();
for (let i = 0; i <= openings; i += 1) for (const side of i % 2 ? sides : [...sides].reverse()) await open(side, i > 0);
for (const { lab } of sides) await lab.stop();
const medians = sides.map(({ times }) => times.sort((a, b) => a - b)[Math.floor(times.length / 2)]);
for (const [i, { name, times }] of sides.entries()) {
  console.log(`${name}: first picture ${times.map((t) => Math.round(t)).join(', ')} ms; median ${Math.round(medians[i])} ms${link > 0 ? ` at ${link} Mbit/s` : `, limit ${LIMIT} ms`}`);
}
if (other) console.log(`this to ${other}: ${(medians[0] / medians[1]).toFixed(3)}`);
process.exit(link > 0 || medians[0] <= LIMIT ? 0 : 1);
