// Controllers with their states and claims; the speed of time and the durations of the loop's phases.
import type { App, Panel } from '../app/app';
import { button, fill, h, say } from '../app/dom';
import { PHASES, type Status } from '../app/status';

const FIGURE = '\u2007'; // a space as wide as a digit

export function controlPanel(app: App): Panel {
  const { twin, commander } = app;
  const list = h('div', { class: 'controllers' });
  const times = h('dl', { class: 'facts' });

  function build(): void {
    fill(list, twin.controllers.length === 0 ? h('p', { class: 'empty' }, commander.viewing ? 'Kinematics alone: the sliders set the joints.' : 'This twin has no controllers.') : twin.controllers.map((c) => {
      const active = c.state === 'active';
      return h('div', { class: 'controller' },
        h('div', { class: 'row' }, h('strong', {}, c.name), h('span', { class: `tag ${c.state}` }, c.state), h('span', { class: 'spacer' }),
          button(active ? 'Deactivate' : 'Activate', `${active ? 'Deactivate' : 'Activate'} ${c.name}`, () => {
            const change = (): void => void commander.switchControllers(active ? [] : [c.name], active ? [c.name] : []);
            const falls = active && c.interface === 'position';
            if (active) app.hardware.confirm(`Deactivate ${c.name}`, falls ? `Nothing holds ${c.joints.join(', ')} then: the arm will fall.` : 'Its joints get no commands any more.', change);
            else change();
          }, { disabled: !active && c.state !== 'inactive' })),
        h('div', { class: 'muted' }, c.type),
        c.joints.length > 0 ? h('div', { class: 'claims' }, `${active ? 'claims' : 'requires'} ${c.interface || 'mixed interfaces'} of ${c.joints.join(', ')}`) : null);
    }));
  }

  const facts: [string, () => string][] = [
    ['simulated time', () => `${twin.simTime.toFixed(3)} s`],
    ['real-time factor', () => (!twin.status ? '–' : twin.paused ? 'paused' : `${twin.status.realTimeFactor.toFixed(3)} of ${twin.status.speed > 0 ? twin.status.speed : 'as fast as possible'}`)],
    ['drawing', () => `${app.world.stage.frameTime.toFixed(1)} ms a frame`],
    ['received', () => `${(rate / 1024).toFixed(0)} KiB/s`],
  ];
  const outs = facts.map(([name]) => [h('dt', {}, name), h('dd', { class: 'num' })] as const);
  fill(times, outs.map((pair) => [...pair]));
  let bytes = 0, rate = 0, at = performance.now();

  // A bar as wide as a step: the share of each phase of the loop, and the rest.
  const total = h('span', { class: 'muted' });
  const parts = PHASES.map((phase) => ({ phase, piece: h('i', { class: `phase ${phase}` }), out: h('dd', { class: 'num' }) }));
  const stack = h('div', { class: 'stack', role: 'img' }, parts.map((part) => part.piece));
  const lateness = h('dd', { class: 'num' }), overruns = h('dd', { class: 'num' }), skipped = h('dd', { class: 'num' });
  const loop = h('section', { 'aria-label': 'Where the time goes' },
    h('h4', {}, 'Time of a step ', total), stack,
    h('dl', { class: 'facts phases' }, parts.map(({ phase, out }) => [h('dt', {}, h('i', { class: `phase key ${phase}` }), phase === 'idle' ? 'idle, waiting for time' : phase), out])),
    h('dl', { class: 'facts' }, h('dt', { title: 'How late the steps begin' }, 'latency p50 · p99 · max'), lateness, h('dt', {}, 'late steps'), overruns, h('dt', { title: 'For clients that read too slowly' }, 'messages dropped'), skipped));

  function showLoop(status: Status | null): void {
    loop.hidden = status === null;
    if (!status) return;
    const { times } = status;
    const sum = PHASES.reduce((all, phase) => all + (Number.isFinite(times[phase]) ? times[phase] : 0), 0);
    say(total, status.paused ? 'while paused' : `${sum.toFixed(0)} µs`);
    for (const { phase, piece, out } of parts) {
      const share = sum > 0 && Number.isFinite(times[phase]) ? times[phase] / sum : 0;
      piece.style.flexGrow = String(share);
      say(out, `${(Number.isFinite(times[phase]) ? times[phase].toFixed(1) : '–').padStart(6, FIGURE)} µs  ${(share * 100).toFixed(0).padStart(3, FIGURE)} %`);
    }
    stack.setAttribute('aria-label', parts.map(({ phase, out }) => `${phase} ${out.textContent}`).join(', '));
    const ms = (s: number): string => (s * 1000).toFixed(2);
    say(lateness, `${ms(status.lateness.p50)} · ${ms(status.lateness.p99)} · ${ms(status.lateness.max)} ms`);
    say(overruns, String(status.overruns));
    say(skipped, String(status.skipped));
  }

  let visible = false;
  twin.statusChanged.on((status) => visible && showLoop(status));
  twin.controllersChanged.on(build);
  twin.robotChanged.on(build);
  build();
  return {
    id: 'control', title: 'Control', rate: 4,
    applies: () => !commander.viewing,
    element: h('div', { class: 'padded' }, h('h3', {}, 'Controllers'), list, h('h3', {}, 'Time'), times, loop),
    update: () => {
      const now = performance.now();
      if (now - at > 900) {
        rate = ((twin.client.bytes - bytes) / (now - at)) * 1000;
        bytes = twin.client.bytes;
        at = now;
      }
      facts.forEach(([, text], i) => say(outs[i]![1], text()));
      for (const pair of outs.slice(0, 2)) for (const one of pair) one.hidden = commander.viewing; // no time has passed
    },
    shown: () => {
      visible = true;
      showLoop(twin.status);
    },
    hidden: () => (visible = false),
  };
}
