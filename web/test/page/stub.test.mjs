// The page in real Chromium against a twin that is made up: a loop that is paused or late, loads, contacts, a thousand
// joints.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { Lab, waitFor } from './lab.mjs';
import { comb, Stub } from './stub.mjs';

const lab = new Lab();
before(() => lab.startBrowser(), { timeout: 120000 });
after(() => lab.stop());

function check(name, joints, body) {
  test(name, { timeout: 180000 }, async () => {
    const stub = new Stub(comb(joints));
    const page = await lab.page({}, await stub.start(0));
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
  assert.equal(await page.evaluate(() => doppel.twin.paused), true, 'a step does not look like running');
  stub.tell({ paused: false, speed: 0.75, real_time_factor: 0.3 });
  await waitFor(page, () => document.querySelector('.factor').textContent === '0.30× slow');
  assert.equal(await page.evaluate(() => document.getElementById('speed').selectedOptions[0].textContent), '0.75×');
});

check('loads are told in words, and only asked for while somebody looks', 10, async (page, stub) => {
  await page.evaluate(() => doppel.layout.open('health'));
  await waitFor(page, () => document.querySelectorAll('.loads .gauge').length === 10 && doppel.twin.loads.size === 10);
  const words = () => page.evaluate(() => [...document.querySelectorAll('.loads tbody tr')].map((row) => row.cells[4].textContent));
  await waitFor(page, () => [...document.querySelectorAll('.loads tbody tr')].every((row) => /\d\.\d{3}$/.test(row.cells[4].textContent)));
  const told = await words();
  assert.equal(told[1], '5.000');
  assert.ok(told.some((text) => text.startsWith('▲ tight')) && told.every((text) => !text.startsWith('✕')), told.join('; '));
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
  assert.ok((await filled()) < 100, 'only rows that are seen are filled');
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
