// Controllers with their states and claims; how time runs and where it goes.
import type { App, Panel } from '../app/app';
import { button, fill, h, say } from '../app/dom';
import type { Message } from '../protocol/cdr';

export function controlPanel(app: App): Panel {
  const { twin, commander } = app;
  const list = h('div', { class: 'controllers' });
  const times = h('dl', { class: 'facts' });
  const loop = h('div', {});

  function build(): void {
    fill(list, twin.controllers.length === 0 ? h('p', { class: 'empty' }, 'This twin has no controllers.') : twin.controllers.map((c) => {
      const active = c.state === 'active';
      return h('div', { class: 'controller' },
        h('div', { class: 'row' }, h('strong', {}, c.name), h('span', { class: `tag ${c.state}` }, c.state), h('span', { class: 'spacer' }),
          button(active ? 'Deactivate' : 'Activate', `${active ? 'Deactivate' : 'Activate'} ${c.name}`, () => {
            void commander.switchControllers(active ? [] : [c.name], active ? [c.name] : []);
          }, { disabled: !active && c.state !== 'inactive' })),
        h('div', { class: 'muted' }, c.type),
        c.joints.length > 0 ? h('div', { class: 'claims' }, `${active ? 'claims' : 'wants'} ${c.interface || 'mixed interfaces'} of ${c.joints.join(', ')}`) : null);
    }));
  }

  const facts: [string, () => string][] = [
    ['simulated time', () => `${twin.simTime.toFixed(3)} s`],
    ['real-time factor', () => (twin.paused ? 'paused' : Number.isFinite(twin.realTimeFactor) ? twin.realTimeFactor.toFixed(3) : '–')],
    ['drawing', () => `${app.world.stage.frameTime.toFixed(1)} ms a frame`],
    ['received', () => `${(rate / 1024).toFixed(0)} KiB/s`],
  ];
  const outs = facts.map(([name]) => [name, h('dd', { class: 'num' })] as const);
  fill(times, outs.map(([name, dd]) => [h('dt', {}, name), dd]));
  let bytes = 0, rate = 0, at = performance.now();

  function diagnose(message: Message): void {
    fill(loop, (message['status'] as Message[]).map((status) => h('details', { open: true },
      h('summary', {}, h('span', { class: ['', 'warning', 'error', 'muted'][Number(status['level'])] ?? '' }, String(status['name'])), ' ', h('span', { class: 'muted' }, String(status['message']))),
      h('dl', { class: 'facts' }, (status['values'] as Message[]).map((pair) => [h('dt', {}, String(pair['key'])), h('dd', { class: 'num' }, String(pair['value']))])))));
  }

  let end: (() => void) | null = null;
  twin.controllersChanged.on(build);
  build();
  return {
    id: 'control', title: 'Control', rate: 4,
    element: h('div', { class: 'padded' }, h('h3', {}, 'Controllers'), list, h('h3', {}, 'Time'), times, loop),
    update: () => {
      const now = performance.now();
      if (now - at > 900) {
        rate = ((twin.client.bytes - bytes) / (now - at)) * 1000;
        bytes = twin.client.bytes;
        at = now;
      }
      facts.forEach(([, text], i) => say(outs[i]![1], text()));
    },
    shown: () => (end = twin.client.subscribe('/diagnostics', diagnose)),
    hidden: () => end?.(),
  };
}
