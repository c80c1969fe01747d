// The banner over the picture while the physics is paused because it has diverged: the cause, and how to go on.
import type { App } from './app';
import { button, h, say } from './dom';
import { resetSimulation } from './simulation';

export function makeDivergedBanner(app: App): { element: HTMLElement; update: () => void } {
  const { twin } = app;
  const advice = h('p', {}, 'Time is paused at the last finite state. Reset the world, or correct the file that caused it and save it.');
  const reset = h('div', { class: 'row' }, button('Reset', 'Reset: time and joints back to the start', () => resetSimulation(app)));
  const cause = h('p', {});
  const element = h('div', { class: 'diverged-note', role: 'alert', hidden: true }, h('strong', {}, 'The physics has diverged.'), cause, advice, reset);
  return {
    element,
    update: () => {
      const text = twin.client.phase === 'open' ? twin.status?.divergence ?? '' : '';
      element.hidden = text === '';
      advice.hidden = reset.hidden = twin.recording !== '';
      say(cause, text === '' ? '' : `${text[0]!.toUpperCase()}${text.slice(1)}.`);
    },
  };
}
