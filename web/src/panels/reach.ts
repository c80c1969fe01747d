// The map of the reach: whether it is shown, and for which directions of the tool.
import type { App } from '../app/app';
import { h, say, toggle } from '../app/dom';
import type { Reach } from '../app/reach';
import { fixed } from '../app/units';

export function reachSection(app: App, reach: Reach, missing: () => string): { element: HTMLElement; update: () => void } {
  const show = toggle('Show reach', 'Show where the tool can go', false, (on) => reach.show(on));
  const box = show.querySelector('input')!;
  box.id = 'show-reach';
  const directions = h('select', { id: 'reach-directions', 'aria-label': 'Directions of the tool', onchange: () => reach.pointDown(directions.value === 'down') },
    h('option', { value: 'any' }, 'any direction'), h('option', { value: 'down' }, 'pointing down'));
  const state = h('p', { class: 'muted reach', role: 'status' });
  const describe = (): string => {
    const { map } = reach;
    if (reach.problem) return reach.problem;
    if (!map) return reach.on ? 'Computing a coarse map …' : '';
    const tip = app.twin.tree?.links[map.arm.tip] ?? '';
    const facts = `'${tip}' reaches ${fixed(map.farthest * 1000, 0)} mm from the first joint; ${fixed(map.volume * 1000, map.volume < 0.1 ? 1 : 0)} litres${map.question.approach ? ' pointing down' : ''}.`;
    return reach.busy ? `${facts} Computing a finer map …` : facts;
  };
  return {
    element: h('section', {}, h('h3', {}, 'Reach'), h('div', { class: 'row' }, show, directions), state),
    update: () => {
      box.checked = reach.on;
      box.disabled = !reach.on && missing() !== '';
      say(state, describe());
    },
  };
}
