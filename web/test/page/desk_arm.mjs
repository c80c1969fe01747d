// A small arm with servos, for tests of the page, and what they have in common.
import { test } from 'node:test';
import { waitFor } from './lab.mjs';
import assert from 'node:assert/strict';

export function armText(plugin, more = '') {
  const link = (name, length, colour) => `<link name="${name}"><visual><origin xyz="0 0 ${length / 2}"/><geometry><box size="0.04 0.05 ${length}"/></geometry><material name="${name}"><color rgba="${colour} 1"/></material></visual><inertial><origin xyz="0 0 ${length / 2}"/><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="5e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>`;
  const joint = (name, parent, child, axis, z) => `<joint name="${name}" type="revolute"><parent link="${parent}"/><child link="${child}"/><origin xyz="0 0 ${z}"/><axis xyz="${axis}"/><limit lower="-1.9" upper="1.9" effort="1.9" velocity="5"/><dynamics damping="0.05" friction="0.02"/></joint>`;
  const servo = (name, id) => `<joint name="${name}"><param name="id">${id}</param><param name="offset_deg">0</param><command_interface name="position"/><state_interface name="position"/><state_interface name="velocity"/></joint>`;
  return `<robot name="desk_arm"><link name="world"/>${link('base', 0.08, '0.25 0.28 0.31')}${link('shoulder', 0.1, '0.85 0.55 0.15')}${link('upper', 0.14, '0.25 0.5 0.75')}${link('fore', 0.12, '0.3 0.6 0.4')}
<joint name="mount" type="fixed"><parent link="world"/><child link="base"/></joint>
${joint('pan', 'base', 'shoulder', '0 0 1', 0.08)}${joint('lift', 'shoulder', 'upper', '0 -1 0', 0.1)}${joint('elbow', 'upper', 'fore', '0 -1 0', 0.14)}
<ros2_control name="Arm" type="system"><hardware><plugin>${plugin}</plugin><param name="gentle">never</param>${more}</hardware>${servo('pan', 1)}${servo('lift', 2)}${servo('elbow', 3)}</ros2_control></robot>`;
}

// A test of a page with that panel, which has heard of the devices.
export const check = (lab, panel, name, body, options = {}) => test(name, { timeout: 180000 }, async () => {
  const page = await lab.page(options);
  try {
    await page.evaluate((id) => doppel.layout.open(id), panel);
    await waitFor(page, () => doppel.devices.all.length > 0);
    await lab.watched(name, page, () => body(page));
    assert.deepEqual(page.problems, []);
  } finally {
    await page.close();
  }
});

export const textOf = (page, selector) => page.locator(selector).first().textContent();
export const stateOf = (page) => page.evaluate(() => doppel.devices.all[0].state);

// The panel in both themes on a phone.
export function checkPhone(lab, panel, what) {
  for (const theme of ['light', 'dark']) {
    check(lab, panel, `a phone of 360 pixels shows ${what} without a horizontal scroll, ${theme}`, async (page) => {
      await page.evaluate((name) => { document.documentElement.dataset.theme = name; dispatchEvent(new Event('themechange')); }, theme);
      await page.evaluate((id) => doppel.layout.open(id), panel);
      await new Promise((done) => setTimeout(done, 300));
      assert.ok(await page.evaluate((id) => {
        const element = document.getElementById(`panel-${id}`);
        return element.scrollWidth <= element.clientWidth + 1 && document.documentElement.scrollWidth <= innerWidth;
      }, panel));
      const low = await page.evaluate((id) => [...document.querySelectorAll(`#panel-${id} button`)].filter((one) => one.offsetParent && one.getBoundingClientRect().height < 26).length, panel);
      assert.equal(low, 0, 'expected buttons that a finger hits');
    }, { viewport: { width: 360, height: 740 }, isMobile: true, hasTouch: true });
  }
}
