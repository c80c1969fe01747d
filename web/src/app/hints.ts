// First steps for a new visitor, over the picture until they are dismissed.
import { button, h } from './dom';
import { icon } from './icons';
import { set, settings } from './settings';

// `recorded`: of a recording instead of a twin.
export function makeHints(recorded: boolean): HTMLElement | null {
  if (settings.hintsSeen) return null;
  const touch = matchMedia('(pointer: coarse)').matches;
  const picture: [string, string] = ['Picture', touch ? 'drag to turn, two fingers to zoom' : 'drag to turn, wheel to zoom, right drag to move'];
  const hints: [string, string][] = recorded ? [picture, ['Time', touch ? 'drag the line at the bottom' : 'drag the line at the bottom; space plays'], ['Curves', 'a click in them goes to that time']] : [
    picture,
    ['Robot', 'move a slider in Joints, or drag the handle at the tool'],
    ['STOP', touch ? 'at the upper right; it stops every robot' : 'at the upper right, or Escape; it stops every robot'],
  ];
  const close = (): void => {
    set('hintsSeen', true);
    card.remove();
  };
  const card = h('aside', { class: 'hints', 'aria-label': 'First steps' }, h('div', { class: 'details-head' }, h('strong', {}, 'First steps'), button(icon('close'), 'Close; they are not shown again', close, { class: 'icon' })),
    h('dl', {}, hints.map(([what, how]) => [h('dt', {}, what), h('dd', {}, how)])));
  return card;
}
