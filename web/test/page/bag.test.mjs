// Recordings in Chromium, from a plain file server: no twin runs. The content security policy is that of the program's server.
import assert from 'node:assert/strict';
import { createServer } from 'node:http';
import { existsSync, readFileSync, statSync } from 'node:fs';
import { dirname, extname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { elbowAt, makeBag, shoulderAt } from '../make_bag.mjs';
import { freePort, Lab, sleep, waitFor } from './lab.mjs';

const here = dirname(fileURLToPath(import.meta.url));
const dist = join(here, '../../dist');
const policy = /kPagePolicy =\s*((?:"[^"]*"\s*)+);/.exec(readFileSync(join(here, '../../../src/doppel/ros/server/http_responses.cpp'), 'utf8'))[1].replace(/"\s*"|"/g, '').trim();
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css' };

const files = new Map(); // path → bytes
const asked = []; // { path, bytes } of each answer
const server = createServer((request, answer) => {
  const path = decodeURIComponent(new URL(request.url, 'http://x').pathname);
  const stored = join(dist, path === '/' ? 'index.html' : path);
  const bytes = files.get(path.replace('/plain/', '/bags/')) ?? (existsSync(stored) && statSync(stored).isFile() ? readFileSync(stored) : null);
  if (!bytes) {
    answer.writeHead(404).end('there is no such file');
    return;
  }
  const range = path.startsWith('/plain/') ? null : /bytes=(\d+)-(\d+)/.exec(request.headers.range ?? ''); // a server without ranges
  const part = range ? bytes.subarray(Number(range[1]), Number(range[2]) + 1) : bytes;
  if (path.startsWith('/bags/')) asked.push({ path, bytes: part.length });
  answer.writeHead(range ? 206 : 200, {
    'Content-Type': TYPES[extname(path)] ?? (path === '/' ? 'text/html' : 'application/octet-stream'), 'Content-Security-Policy': policy, 'Content-Length': part.length,
    ...(range && { 'Content-Range': `bytes ${range[1]}-${Number(range[1]) + part.length - 1}/${bytes.length}` }),
  }).end(part);
});

const lab = new Lab();
before(async () => {
  files.set('/bags/a.mcap', await makeBag());
  files.set('/bags/b.mcap', await makeBag({ offset: 0.1, compression: 'lz4' }));
  files.set('/bags/bare.mcap', await makeBag({ describe: false, mesh: false }));
  files.set('/bags/cut.mcap', files.get('/bags/a.mcap').slice(0, 70_000));
  files.set('/bags/old.db3', Buffer.from('SQLite format 3\0 and its pages'));
  files.set('/bags/notes.mcap', Buffer.from('these are notes'));
  files.set('/bags/odd.mcap', await makeBag({ compression: 'brotli' }));
  files.set('/bags/run/run_0.mcap', await makeBag({ to: 5 }));
  files.set('/bags/run/run_1.mcap', await makeBag({ from: 5 }));
  files.set('/bags/run/metadata.yaml', Buffer.from('rosbag2_bagfile_information:\n  storage_identifier: mcap\n  relative_file_paths:\n    - run_0.mcap\n    - run_1.mcap\n'));
  const port = await freePort();
  await new Promise((done) => server.listen(port, '127.0.0.1', done));
  lab.url = `http://127.0.0.1:${port}/`;
  await lab.startBrowser();
}, { timeout: 120000 });
after(async () => {
  await lab.stop();
  server.close();
});

// A test in a page of its own; its console has no other messages than those that `permitted` names.
const check = (name, query, body, { options = {}, pictured = true, permitted = /^$/ } = {}) => test(name, { timeout: 180000 }, async () => {
  const page = await lab.page(options, lab.url + query, undefined, pictured);
  try {
    await lab.watched(name, page, () => body(page));
    assert.deepEqual(page.problems.filter((text) => !permitted.test(text)), []);
  } finally {
    await page.close();
  }
});
const joint = (page, name, which = 'twin') => page.evaluate(([of, from]) => {
  const twin = from === 'twin' ? doppel.twin : doppel.session.comparison.twin;
  return twin.q[twin.tree.jointByName.get(of).index];
}, [name, which]);
const shown = async (page, time) => {
  await waitFor(page, (at) => doppel.playback && !doppel.playback.isReading && Math.abs(doppel.playback.time - at) < 0.011 && Math.abs(doppel.playback.source.time - at) < 0.011, time);
  const { time: exact } = await page.evaluate(() => ({ time: doppel.playback.time }));
  return exact;
};
const near = (value, expected, tolerance = 1e-6) => assert.ok(Math.abs(value - expected) <= tolerance, `${value} instead of ${expected}`);
// The joint states are those of the last multiple of 20 ms.
const sampled = (time) => Math.floor(time * 50 + 1e-6) / 50;
const surveyed = (page) => waitFor(page, () => doppel.session?.survey?.isComplete);
const clickTrack = async (page, share) => {
  const box = await page.locator('.bag-track').boundingBox();
  await page.mouse.click(box.x + box.width * share, box.y + box.height / 2);
};
const drop = (page, names, zone = '#drop-first', from = names) => page.evaluate(async ([list, addresses, place]) => {
  const transfer = new DataTransfer();
  for (const [i, name] of list.entries()) transfer.items.add(new File([await (await fetch(addresses[i])).blob()], name));
  window.dispatchEvent(new DragEvent('dragover', { dataTransfer: transfer, bubbles: true, cancelable: true }));
  document.querySelector(place).dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, bubbles: true, cancelable: true }));
}, [names, from.map((name) => `/plain/${name}`), zone]);
const noteOf = async (page) => {
  await page.locator('#bag-note').waitFor();
  return page.locator('#bag-note').textContent();
};

check('arm, curves, log and picture follow the time line, forwards and backwards', '?bag=bags/a.mcap', async (page) => {
  await surveyed(page);
  assert.equal(await page.locator('.link').textContent(), 'recording a.mcap');
  for (const share of [0.8, 0.25]) {
    await clickTrack(page, share);
    const time = await shown(page, share * 10.01);
    near(await joint(page, 'shoulder'), shoulderAt(sampled(time)));
    near(await joint(page, 'elbow'), elbowAt(sampled(time)));
  }
  await page.locator('#tab-log').click();
  const lines = () => page.locator('.log-line .text').allTextContents();
  assert.deepEqual(await lines(), ['second 1', 'second 2']);
  await clickTrack(page, 0.65);
  await shown(page, 6.5065);
  assert.equal((await lines()).at(-1), 'the goal is out of reach');
  await page.locator('#tab-topics').click();
  await page.locator('.topic-list button', { hasText: '/camera/image_raw' }).click();
  const first = () => page.evaluate(() => {
    const canvas = document.querySelector('figure.image canvas');
    return canvas ? canvas.getContext('2d').getImageData(2, 2, 1, 1).data[0] : -1;
  });
  await waitFor(page, () => document.querySelector('figure.image canvas'));
  for (const [share, value] of [[0.9, 44], [0.3, 14]]) {
    await clickTrack(page, share);
    await shown(page, share * 10.01);
    await waitFor(page, (expected) => document.querySelector('figure.image canvas').getContext('2d').getImageData(2, 2, 1, 1).data[0] === expected, value).catch(async () => assert.equal(await first(), value));
  }
  await page.locator('#tab-sensors').click();
  await page.locator('.sensor canvas').first().waitFor();
  const marks = await page.locator('.bag-mark').evaluateAll((all) => all.map((mark) => `${mark.className} ${mark.title}`));
  assert.deepEqual(marks.sort(), ['bag-mark error 6.00 s  planner: the goal is out of reach', 'bag-mark event 4.00 s  note.txt (text/plain)', 'bag-mark event 5.00 s  event: the light went out', 'bag-mark warning 3.00 s  planner: the goal is near a limit']);
});

check('the curves are those of the whole recording; a click in them sets the time', '?bag=bags/a.mcap', async (page) => {
  await surveyed(page);
  const [count, largest] = await page.evaluate(() => {
    const [times, values] = doppel.recorder.window(0, 99, ['joint:shoulder:position']);
    return [times.length, Math.max(...values)];
  });
  assert.equal(count, 501);
  near(largest, 0.9, 1e-3);
  const box = await page.locator('.plot .u-over').boundingBox();
  await page.mouse.click(box.x + box.width * 0.5, box.y + box.height / 2);
  const time = await shown(page, 5.005);
  near(time, 5.005, 0.03);
  near(await joint(page, 'shoulder'), shoulderAt(sampled(time)));
  assert.equal(await page.locator('select[aria-label="Width of the window"]').inputValue(), 'all');
});

check('?t= opens at that moment, and the copied link names it', '?bag=bags/a.mcap&t=7.5', async (page) => {
  near(await shown(page, 7.5), 7.5);
  near(await joint(page, 'shoulder'), shoulderAt(7.5));
  await page.evaluate(() => {
    navigator.clipboard.writeText = (text) => ((window.copied = text), Promise.resolve());
    doppel.playback.seek(2.125);
  });
  await page.locator('#bag-link').click();
  await waitFor(page, () => window.copied);
  assert.equal(await page.evaluate(() => window.copied), `${lab.url}?bag=bags/a.mcap&t=2.125`);
});

check('play, speed, loop and keys', '?bag=bags/a.mcap&t=9', async (page) => {
  await shown(page, 9);
  await page.locator('#bag-speed').selectOption('2');
  await page.locator('#bag-play').click();
  await waitFor(page, () => !doppel.playback.isPlaying);
  near(await shown(page, 10.01), 10.01); // it ends there
  await page.evaluate(() => document.activeElement.blur());
  await page.keyboard.press('l');
  await page.keyboard.press('Space');
  await waitFor(page, () => doppel.playback.loops && doppel.playback.isPlaying && doppel.playback.time > 0.2 && doppel.playback.time < 9); // from the start
  const [time, wall] = await page.evaluate(() => [doppel.playback.time, performance.now()]);
  await sleep(1500);
  const [later, then] = await page.evaluate(() => [doppel.playback.time, performance.now()]);
  const length = 10.01;
  const factor = (((later - time + length) % length) / (then - wall)) * 1000; // it may have begun again
  assert.ok(factor > 0.8 && factor < 2.2, `${factor} times as fast`); // a busy machine draws a few frames a second
  near(await joint(page, 'shoulder'), shoulderAt(sampled(await page.evaluate(() => doppel.playback.time))), 0.08);
  await page.keyboard.press('Space');
  assert.equal(await page.evaluate(() => doppel.playback.isPlaying), false);
  for (const [key, expected] of [['Home', 0], ['Shift+ArrowRight', 1], ['ArrowRight', 1 + 1 / 30], ['ArrowLeft', 1], ['End', 10.01], ['Home', 0]]) {
    await page.keyboard.press(key);
    near(await shown(page, expected), expected, 1e-9);
  }
  await page.keyboard.press('.');
  await waitFor(page, () => doppel.playback.time > 0);
  near(await page.evaluate(() => doppel.playback.time), 0.005); // the description
  await page.evaluate(() => doppel.playback.seek(10));
  await shown(page, 10);
  await page.evaluate(() => doppel.playback.setSpeed(10));
  await page.keyboard.press('Space');
  await waitFor(page, () => doppel.playback.time > 0.1 && doppel.playback.time < 9.9); // past the end to the start
});

check('nothing can be commanded, and the page says why', '?bag=bags/a.mcap', async (page) => {
  assert.equal(await page.locator('#stop').isVisible(), false);
  assert.equal(await page.locator('.bar .tag', { hasText: 'read only' }).isVisible(), true);
  const sliders = page.locator('.joint .slider');
  assert.equal(await sliders.count(), 3);
  for (const slider of await sliders.all()) assert.equal(await slider.isDisabled(), true);
  assert.equal(await page.locator('.joint .why').first().textContent(), 'a recording');
  const titles = await page.locator('.tab:visible > span:first-child').allTextContents();
  assert.deepEqual(titles.filter((title) => ['Control', 'Tool', 'Drive', 'Poses', 'Parameters', 'Objects', 'Compare'].includes(title)), []);
  const pose = await page.evaluate(() => [...doppel.twin.q]);
  for (const key of ['w', 'd', '[', 'p', 'Escape']) await page.keyboard.press(key);
  assert.equal(await page.evaluate(() => doppel.commander.stopped), false);
  assert.deepEqual(await page.evaluate(() => [...doppel.twin.q]), pose);
  await page.locator('#tab-topics').click();
  await page.locator('.topic-list button', { hasText: '/joint_states' }).click();
  assert.equal(await page.locator('#publish').isDisabled(), true);
});

check('a large recording is read in parts; a server without ranges sends all of it', '?bag=plain/a.mcap&t=3', async (page) => {
  await shown(page, 3);
  near(await joint(page, 'shoulder'), shoulderAt(3));
  files.set('/bags/long.mcap', await makeBag({ seconds: 400, chunkSize: 256 * 1024 }));
  asked.length = 0;
  const far = await lab.page({}, `${lab.url}?bag=bags/long.mcap&t=300`);
  await shown(far, 300);
  near(await joint(far, 'shoulder'), shoulderAt(300));
  await surveyed(far);
  const sizes = asked.map(({ bytes }) => bytes);
  assert.ok(sizes.length > 8 && Math.max(...sizes) < files.get('/bags/long.mcap').length / 4, `answers of ${sizes} bytes`);
  assert.deepEqual(far.problems, []);
  await far.close();
});

check('the folder of a bag is opened by its address or by its metadata.yaml', '?bag=bags/run/&t=7', async (page) => {
  await shown(page, 7);
  near(await joint(page, 'shoulder'), shoulderAt(7));
  near(await page.evaluate(() => doppel.playback.length), 10.01);
  const other = await lab.page({}, `${lab.url}?bag=bags/run/metadata.yaml&t=2`);
  await shown(other, 2);
  near(await joint(other, 'shoulder'), shoulderAt(2));
  await other.close();
});

check('a file that is dropped is opened, with its meshes, and two recordings are compared', '?ws=ws://127.0.0.1:9/', async (page) => {
  await drop(page, ['a.mcap']);
  await waitFor(page, () => doppel.twin.recording === 'a.mcap' && doppel.world.view?.loading === 0 && doppel.playback);
  assert.deepEqual(await page.evaluate(() => doppel.world.view.failed), []);
  assert.equal(await page.locator('#bag-link').isDisabled(), true);
  await page.locator('.lost-note').waitFor({ state: 'hidden' });
  await surveyed(page);
  await drop(page, ['b.mcap'], '#drop-second');
  await page.locator('.residuals tbody tr').first().waitFor();
  const rows = await page.locator('.residuals tbody tr').evaluateAll((all) => all.map((row) => [...row.children].map((cell) => cell.textContent)));
  assert.deepEqual(rows.map(([name, largest, , rms]) => [name, largest, rms]), [['shoulder', '5.7296°', '5.7296°'], ['elbow', '0.0000°', '0.0000°'], ['finger', '0.000 mm', '0.000 mm']]);
  await page.evaluate(() => doppel.playback.seek(6));
  await shown(page, 6);
  await waitFor(page, () => doppel.session.comparison.twin.q[0] !== doppel.session.comparison.twin.q[1]);
  near(await joint(page, 'shoulder', 'second') - await joint(page, 'shoulder'), 0.1);
  assert.equal(await page.evaluate(() => doppel.session.comparison.view.root.visible && doppel.session.comparison.view.root.parent !== null), true);
  assert.match(await page.locator('.stage-legend').textContent(), /b\.mcap/);
  await page.locator('#tab-plots').click();
  assert.match(await page.locator('.chips').textContent(), /shoulder difference/);
  await page.locator('#tab-compare').click();
  await page.locator('#bag-close-second').click();
  assert.equal(await page.locator('#tab-compare').isVisible(), false);
  await page.locator('.chip', { hasText: 'shoulder position' }).waitFor();
  assert.doesNotMatch(await page.locator('.chips').textContent(), /difference/);
}, { pictured: false, permitted: /WebSocket connection/ });

check('where nothing can be dropped, files are chosen', '?bag=bags/a.mcap', async (page) => {
  await surveyed(page);
  const choose = async (button, name, bytes) => {
    const chooser = page.waitForEvent('filechooser');
    await page.locator(button).tap();
    await (await chooser).setFiles({ name, mimeType: 'application/octet-stream', buffer: Buffer.from(bytes) });
  };
  await choose('#bag-compare', 'chosen.mcap', files.get('/bags/b.mcap'));
  await page.locator('.residuals tbody tr').first().waitFor();
  await choose('#bag-open', 'other.mcap', files.get('/bags/b.mcap'));
  await waitFor(page, () => doppel.twin.recording === 'other.mcap' && doppel.session.survey?.isComplete && doppel.playback.length > 10);
  assert.equal(await page.locator('.bag-line').count(), 1);
  assert.equal(await page.locator('.residuals').count(), 0);
  near(await page.evaluate(() => doppel.recorder.valueAt('joint:shoulder:position', 5)), shoulderAt(5, 0.1));
}, { options: { viewport: { width: 390, height: 844 }, hasTouch: true } });

check('&bag2= names the second recording, and the link keeps it', '?bag=bags/a.mcap&bag2=bags/b.mcap&t=4', async (page) => {
  await page.locator('.residuals tbody tr').first().waitFor();
  await shown(page, 4);
  await waitFor(page, () => Math.abs(doppel.session.comparison.twin.q[0] - doppel.twin.q[0] - 0.1) < 1e-6);
  await page.evaluate(() => (navigator.clipboard.writeText = (text) => ((window.copied = text), Promise.resolve())));
  await page.locator('#bag-link').click();
  await waitFor(page, () => window.copied);
  assert.equal(await page.evaluate(() => window.copied), `${lab.url}?bag=bags/a.mcap&bag2=bags/b.mcap&t=4.000`);
});

for (const [what, address, text] of [
  ['is not there', 'bags/none.mcap', /status 404, it has no such file/],
  ['is no MCAP file', 'bags/notes.mcap', /notes\.mcap is not an MCAP file: at byte 0 it has 74 68 65 73/],
  ['is a SQLite bag', 'bags/old.db3', /old\.db3 is a SQLite bag of rosbag2.*ros2 bag convert/],
  ['has an unknown compression', 'bags/odd.mcap', /odd\.mcap, byte \d+: the chunk is compressed by 'brotli'/],
]) {
  check(`a recording that ${what} is refused with the reason, and another one can be dropped`, `?bag=${address}`, async (page) => {
    assert.match(await noteOf(page), text);
    assert.equal(await page.locator('#stop').isVisible(), false);
    assert.equal(await page.locator('.link').textContent(), 'no recording');
    await drop(page, ['a.mcap']);
    await waitFor(page, () => doppel.twin.recording === 'a.mcap' && doppel.twin.tree);
    assert.equal(await page.locator('#bag-note').count(), 0);
  }, { pictured: false, permitted: /status of 404/ });
}

check('a recording that is cut off is shown until there, with a warning', '?bag=bags/cut.mcap', async (page) => {
  assert.match(await noteOf(page), /cut\.mcap ends at byte 70000 without an index: .*doppel bag recover/);
  await page.evaluate(() => doppel.playback.seek(3));
  await shown(page, 3);
  near(await joint(page, 'shoulder'), shoulderAt(3));
});

check('without a description curves and log work', '?bag=bags/bare.mcap&t=6.5', async (page) => {
  assert.match(await noteOf(page), /bare\.mcap has no \/robot_description/);
  await page.locator('#bag-note button', { hasText: 'Close' }).click();
  await page.locator('#tab-log').click();
  assert.equal((await page.locator('.log-line .text').allTextContents()).at(-1), 'the goal is out of reach');
  await page.locator('#tab-topics').click();
  await page.locator('.topic-list button', { hasText: '/joint_states' }).click();
  await page.locator('.leaf-row button[title="Plot position.0"]').click();
  await waitFor(page, () => doppel.session.survey.isComplete && doppel.recorder.count === 501 && Number.isFinite(doppel.recorder.valueAt('topic:/joint_states.position[0]', 5)));
  near(await page.evaluate(() => doppel.recorder.valueAt('topic:/joint_states.position[0]', 5)), shoulderAt(5));
}, { pictured: false });

for (const [name, options] of Object.entries({ upright: { viewport: { width: 390, height: 844 }, hasTouch: true }, 'on its side': { viewport: { width: 844, height: 390 }, hasTouch: true, colorScheme: 'dark' } })) {
  check(`on a phone ${name} the time line is whole, and its controls are large enough`, '?bag=bags/a.mcap', async (page) => {
    const { width, height } = options.viewport;
    const line = await page.locator('.bag-line').boundingBox();
    assert.ok(line.x >= 0 && line.x + line.width <= width + 0.5 && line.y + line.height <= height + 0.5, JSON.stringify(line));
    assert.ok(line.height < 150, `${line.height} px high`);
    const play = await page.locator('#bag-play').boundingBox();
    assert.ok(play.width >= 40 && play.height >= 40, JSON.stringify(play));
    const track = await page.locator('.bag-track').boundingBox();
    assert.ok(track.width > 150, `${track.width} px of track`);
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth > innerWidth), false);
    await page.touchscreen.tap(track.x + track.width * 0.7, track.y + track.height / 2);
    near(await shown(page, 0.7 * 10.01), 0.7 * 10.01, 0.05);
  }, { options });
}

test('a recording that is dropped on the page of a twin takes its place', { timeout: 180000 }, async () => {
  const twin = new Lab();
  await twin.start();
  try {
    const page = await twin.fresh();
    const bytes = [...await makeBag({ seconds: 4 })];
    await page.evaluate((content) => {
      const transfer = new DataTransfer();
      transfer.items.add(new File([Uint8Array.from(content)], 'run.mcap'));
      document.body.dispatchEvent(new DragEvent('drop', { dataTransfer: transfer, bubbles: true, cancelable: true }));
    }, bytes);
    await waitFor(page, () => doppel.twin.recording === 'run.mcap' && doppel.twin.tree?.robot.name === 'small_arm' && doppel.playback && doppel.session.survey.isComplete);
    await page.evaluate(() => doppel.playback.seek(2));
    await waitFor(page, () => doppel.playback.source.time === 2);
    near(await joint(page, 'shoulder'), shoulderAt(2));
    for (const gone of ['#stop', '.clock']) await page.locator(gone).waitFor({ state: 'hidden' });
    assert.deepEqual(await page.evaluate(() => doppel.twin.controllers), []);
    await page.locator('#bag-back-to-twin').click();
    await waitFor(page, () => window.doppel?.ready && doppel.twin.client.phase === 'open' && !doppel.twin.recording && doppel.twin.controllers.length > 0);
    assert.equal(await page.locator('#stop').isVisible(), true);
    assert.deepEqual(page.problems, []);
  } finally {
    await twin.stop();
  }
});
