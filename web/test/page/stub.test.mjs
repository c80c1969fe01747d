// The page in Chromium with a stub of a twin: a loop that is paused or late, loads, contacts, a thousand joints.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { Lab, waitFor } from './lab.mjs';
import { comb, Stub } from './stub.mjs';

const lab = new Lab();
before(() => lab.startBrowser(), { timeout: 120000 });
after(() => lab.stop());

function check(name, robot, body, options = {}) {
  test(name, { timeout: 180000 }, async () => {
    const stub = new Stub(typeof robot === 'string' ? robot : comb(robot));
    const page = await lab.page(options, await stub.start(0));
    try {
      await lab.watched(name, page, () => body(page, stub));
      assert.deepEqual(page.problems, []);
    } finally {
      await page.close();
      stub.stop();
    }
  });
}

check('a pause, the speed and where the time goes are what the twin says', 10, async (page, stub) => {
  await page.evaluate(() => doppel.layout.open('control'));
  await waitFor(page, () => doppel.twin.status !== null && !doppel.twin.paused);
  const shares = () => page.evaluate(() => [...document.querySelectorAll('.stack .phase')].map((piece) => Number(piece.style.flexGrow)));
  assert.deepEqual((await shares()).map((s) => Math.round(s * 100)), [4, 30, 2, 1, 63]);
  assert.match(await page.locator('.stack').getAttribute('aria-label'), /physics\s+300\.0 µs\s+30 %/);
  stub.tell({ paused: true });
  await waitFor(page, () => doppel.twin.paused);
  const time = await page.evaluate(() => doppel.twin.simTime);
  stub.tell({ sim_time: time + 0.1 });
  await waitFor(page, (t) => doppel.twin.simTime > t + 0.05, time);
  assert.equal(await page.evaluate(() => doppel.twin.paused), true, 'expected a step to keep the page paused');
  stub.tell({ paused: false, speed: 0.75, real_time_factor: 0.3 });
  await waitFor(page, () => document.querySelector('.factor').textContent === '0.30× slow');
  assert.equal(await page.evaluate(() => document.getElementById('speed').selectedOptions[0].textContent), '0.75×');
});

check('a divergence is shown with its cause and a way to go on until it is over', 10, async (page, stub) => {
  await waitFor(page, () => doppel.twin.status !== null);
  assert.equal(await page.locator('.diverged-note').isVisible(), false);
  stub.tell({ paused: true, divergence: "the physics diverged in step 7 (t = 0.007 s): joint 'joint_3' moves at 1e9 rad/s" });
  await page.locator('.diverged-note').waitFor();
  assert.match(await page.locator('.diverged-note').textContent(), /The physics diverged in step 7 .*'joint_3' moves.*last finite state.*Reset/s);
  stub.tell({ paused: false, divergence: '' });
  await page.locator('.diverged-note').waitFor({ state: 'hidden' });
});

check('loads are shown in words, and only asked for while somebody looks', 10, async (page, stub) => {
  await page.evaluate(() => doppel.layout.open('health'));
  await waitFor(page, () => document.querySelectorAll('.loads .gauge').length === 10 && doppel.twin.loads.size === 10);
  const words = () => page.evaluate(() => [...document.querySelectorAll('.loads tbody tr')].map((row) => row.cells[4].textContent));
  await waitFor(page, () => [...document.querySelectorAll('.loads tbody tr')].every((row) => /\d\.\d{3}$/.test(row.cells[4].textContent)));
  const shown = await words();
  assert.equal(shown[1], '5.000');
  assert.ok(shown.some((text) => text.startsWith('▲ tight')) && shown.every((text) => !text.startsWith('✕')), shown.join('; '));
  await page.evaluate(() => {
    doppel.layout.open('tool');
    doppel.layout.open('log');
  });
  await waitFor(page, () => doppel.twin.loadWatchers === 0);
  assert.equal(await page.evaluate(() => doppel.twin.client.subscriptions.has('/doppel/joint_loads')), false);
  void stub;
});

check('contacts are drawn as points and arrows while the layer is on', 10, async (page, stub) => {
  await page.evaluate(() => doppel.world.setLayer('contacts', true));
  await waitFor(page, () => doppel.twin.client.subscriptions.has('/gazebo/contacts'));
  const zero = { x: 0, y: 0, z: 0 };
  const wrench = { force: { x: 0, y: 0, z: 5 }, torque: zero };
  const state = { info: '', collision1_name: 'a', collision2_name: 'b', wrenches: [wrench, wrench], total_wrench: wrench,
    contact_positions: [zero, { x: 0.1, y: 0, z: 0 }], contact_normals: [zero, zero], depths: [0, 0] };
  const header = { stamp: { sec: 0, nanosec: 0 }, frame_id: 'world' };
  const visible = () => {
    let count = 0;
    doppel.world.stage.scene.traverse((object) => (count += object.visible && object.geometry?.type === 'SphereGeometry' && object.scale.x < 0.5 ? 1 : 0));
    return count;
  };
  const none = await page.evaluate(visible);
  for (const [states, marks] of [[[state], 2], [[], 0]]) {
    await waitFor(page, () => doppel.twin.client.byId.size > 0);
    const timer = setInterval(() => stub.publish('/gazebo/contacts', { header, states }), 50);
    await waitFor(page, `(${visible})() === ${none + marks}`).finally(() => clearInterval(timer));
  }
});

check('a thousand joints do not freeze the page', 1000, async (page, stub) => {
  await waitFor(page, () => document.querySelectorAll('.joint').length === 1000);
  const filled = () => page.evaluate(() => [...document.querySelectorAll('.joint')].filter((row) => row.childElementCount > 0).length);
  await waitFor(page, () => document.querySelector('.joint .slider') !== null);
  assert.ok((await filled()) < 100, 'expected only visible rows to be filled');
  await page.evaluate(() => {
    window.long = [];
    new PerformanceObserver((list) => window.long.push(...list.getEntries().map((entry) => Math.round(entry.duration)))).observe({ type: 'longtask' });
  });
  await page.locator('.joints').evaluate((list) => (list.scrollTop = list.scrollHeight));
  const last = page.locator('.joint').last();
  await waitFor(page, () => [...document.querySelectorAll('.joint')].at(-1).querySelector('.slider') !== null);
  await last.locator('.name').click();
  await waitFor(page, () => doppel.selection && doppel.twin.tree.links[doppel.selection.link] === doppel.twin.tree.moving.at(-1).child);
  const name = await last.locator('.name').textContent();
  await last.locator('.slider').evaluate((element) => {
    element.value = '0.5';
    element.dispatchEvent(new Event('input', { bubbles: true }));
    element.dispatchEvent(new Event('change', { bubbles: true }));
  });
  await waitFor(page, (n) => Math.abs(doppel.twin.q[doppel.twin.tree.jointByName.get(n).index] - 0.5) < 1e-6, name);
  assert.equal(stub.positions.get(name), 0.5);
  const costs = await page.evaluate(async () => {
    const out = {};
    for (const id of ['joints', 'health', 'tf', 'plots', 'topics']) {
      doppel.layout.open(id);
      await new Promise(requestAnimationFrame);
      const dock = [doppel.layout.right, doppel.layout.bottom].find((one) => one.has(id));
      const times = Array.from({ length: 9 }, () => {
        const start = performance.now();
        dock.current.update?.();
        return performance.now() - start;
      }).sort((a, b) => a - b);
      out[id] = +times[4].toFixed(2);
    }
    return { updates: out, long: window.long, frame: +doppel.world.stage.frameTime.toFixed(1) };
  });
  console.log(`a thousand joints: update in ms ${JSON.stringify(costs.updates)}, long tasks ${JSON.stringify(costs.long)} ms, a frame ${costs.frame} ms`);
  assert.ok((await filled()) < 200);
});

const LONG = 'Lift (upright) whose name goes beyond every row_and_has_no_spaces_towards_its_very_end';
const LIFT = `<robot name="A robot with a name too long for a narrow bar"><link name="base"/><link name="Column"><visual><geometry><box size="0.1 0.1 0.4"/></geometry></visual></link>
  <joint name="${LONG}" type="prismatic"><parent link="base"/><child link="Column"/><axis xyz="0 0 1"/><limit lower="0" upper="0.8" effort="200" velocity="0.5"/></joint></robot>`;
const FINDINGS = { findings: [{ rule: 'name.x', severity: 'note', subject: `joint '${LONG}'`, message: 'is long', file: 'urdf/lift.urdf', line: 2, column: 3, fix: 'a shorter one', consequence: 'long lines' },
  { rule: 'name.y', severity: 'warning', subject: "link 'Column'", message: 'is not ASCII', fix: '', consequence: '' }] };
const SOURCES = { links: { Column: { file: '/home/me/lift/urdf/lift.urdf', line: 1, column: 58 } }, joints: {} };

check('on a phone long names stay within the page, and findings tell where they are written', LIFT, async (page, stub) => {
  for (const [topic, data] of [['/doppel/health', FINDINGS], ['/doppel/sources', SOURCES]]) {
    stub.topic(topic, 'std_msgs/msg/String');
    stub.publish(topic, { data: JSON.stringify(data) }, true);
  }
  await page.evaluate(() => doppel.layout.open('health'));
  await waitFor(page, () => document.querySelectorAll('.finding').length === 2);
  for (const summary of await page.locator('.finding summary').all()) await summary.click();
  await waitFor(page, () => [...document.querySelectorAll('.finding code')].map((one) => one.textContent).join() === 'lift.urdf:1:58,lift.urdf:2:3');
  assert.equal(await page.locator('.finding code').nth(1).getAttribute('title'), '/home/me/lift/urdf/lift.urdf:2:3');
  assert.ok(await page.evaluate(() => [...document.querySelectorAll('.finding')].every((one) => {
    const [row, tag] = [one, one.querySelector('.tag')].map((element) => element.getBoundingClientRect());
    return tag.top >= row.top && tag.bottom <= row.bottom;
  })), 'the word for how bad it is stands in its row');
  await page.locator('.finding button', { hasText: 'Copy' }).first().click();
  await page.locator('.toast', { hasText: 'lift.urdf:1:58 is on the clipboard.' }).waitFor();
  await page.locator('.finding button', { hasText: 'Show' }).nth(1).click();
  assert.equal(await page.evaluate(() => doppel.twin.tree.links[doppel.selection.link]), 'Column');

  for (const id of ['health', 'joints', 'tree', 'tool', 'control', 'plots', 'tf']) {
    await page.evaluate((tab) => doppel.layout.open(tab), id);
    assert.deepEqual(await page.evaluate(() => [...document.querySelectorAll('button, input, select, strong, .tag, .finding, .chip')].filter((one) => {
      const box = one.getBoundingClientRect();
      return box.width > 0 && !one.closest('.tabs') && (box.left < -1 || box.right > innerWidth + 1);
    }).map((one) => `${one.className} ${one.textContent}`)), [], id);
  }
  const small = await page.evaluate(() => [...document.querySelectorAll('.views button, .bar button, .tab')].filter((one) => one.offsetWidth > 0 && (one.offsetWidth < 40 || one.offsetHeight < 40)).map((one) => one.textContent));
  assert.deepEqual(small, [], 'expected targets large enough for a finger');
}, { viewport: { width: 390, height: 844 }, hasTouch: true });

check('without the browser\'s clipboard a pose is pasted into a field', 10, async (page) => {
  await page.evaluate(() => {
    Object.defineProperty(navigator, 'clipboard', { value: undefined });
    document.execCommand = (what) => what === 'copy' && document.activeElement.value.includes('joint_names') && (window.copied = document.activeElement.value) !== '';
    doppel.layout.open('joints');
  });
  await page.locator('.joints-panel button', { hasText: 'Copy' }).click();
  await page.locator('.toast', { hasText: 'on the clipboard' }).waitFor();
  assert.match(await page.evaluate(() => window.copied), /joint_names:.*joint_3/);
  await page.locator('.joints-panel button', { hasText: 'Paste' }).click();
  await page.locator('dialog.paste textarea').fill('joint_names: [joint_3]\npoints:\n- positions: [0.5]\n');
  await page.locator('dialog.paste button', { hasText: 'Use' }).click();
  await waitFor(page, () => doppel.twin.target[doppel.twin.tree.jointByName.get('joint_3').index] === 0.5);
  await page.locator('dialog.paste').waitFor({ state: 'detached' });
});
