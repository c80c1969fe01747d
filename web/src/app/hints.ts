// What a first visitor can do, over the picture until it is dismissed.
import type { App } from './app';
import { button, h } from './dom';
import { icon } from './icons';
import { set, settings } from './settings';

export function makeHints({ commander }: App): HTMLElement | null {
  if (settings.hintsSeen) return null;
  const touch = matchMedia('(pointer: coarse)').matches;
  const hints: [string, string][] = [
    ['Picture', touch ? 'drag to turn, two fingers to zoom and move' : 'drag to turn, right drag to move, wheel to zoom'],
    ['Robot', commander.viewing ? 'move the sliders in Joints, or drag the handle at the tool' : 'move the sliders in Joints, drag the handle at the tool, or press Play in Poses'],
    ['STOP', touch ? 'the button at the upper right stops every robot' : 'the button at the upper right and the Escape key stop every robot'],
  ];
  const close = (): void => {
    set('hintsSeen', true);
    card.remove();
  };
  const card = h('aside', { class: 'hints', 'aria-label': 'First steps' }, h('div', { class: 'details-head' }, h('strong', {}, 'First steps'), button(icon('close'), 'Close; they are not shown again', close, { class: 'icon' })),
    h('dl', {}, hints.map(([what, how]) => [h('dt', {}, what), h('dd', {}, how)])));
  return card;
}
