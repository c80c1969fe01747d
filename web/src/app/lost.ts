// The banner over the picture without a connection: how old the data is, and how to start the twin again.
import type { App } from './app';
import { copyText } from './clipboard';
import { button, h, say } from './dom';

const DEFAULT_PORT = '8700';

function ago(seconds: number): string {
  return seconds < 100 ? `${Math.floor(seconds)} s` : seconds < 6000 ? `${Math.floor(seconds / 60)} min` : `${Math.floor(seconds / 3600)} h`;
}

export function makeLostBanner(app: App): { element: HTMLElement; update: () => void } {
  const { twin, commander } = app;
  const { client } = twin;
  const age = h('strong', { class: 'num' });
  const shown = h('p', {});
  const stop = h('p', {}, 'STOP is sent as soon as the connection is back.');
  const command = h('code', {});
  const start = h('p', {}, 'Start the twin again: ', command, ' ',
    button('Copy', 'Copy the command', () => void copyText(command.textContent!, 'The command'), { class: 'small' }));
  const element = h('div', { class: 'lost-note', role: 'alert', hidden: true }, age,
    shown, stop, start,
    h('div', { class: 'row' }, button('Connect now', 'Connect now instead of in a few seconds', () => client.retry()),
      button('Open a recording…', 'Choose .mcap files of this machine; they can also be dropped on the page', () => app.chooseRecording(), { id: 'lost-open' })));
  // At this page's port, which the next twin would not choose by itself.
  const restart = (): string => {
    const line = client.metadata['command'] ?? 'doppel up';
    const { port } = location;
    return port === '' || port === DEFAULT_PORT || / --port\b/.test(line) ? line : `${line} --port ${port}`;
  };
  return {
    element,
    update: () => {
      const lost = client.phase === 'lost';
      document.body.classList.toggle('lost', lost);
      element.hidden = !lost;
      if (!lost) return;
      say(age, client.lostAt > 0 ? `No connection to the twin for ${ago((performance.now() - client.lostAt) / 1000)}.` : 'No twin answers at this address.');
      say(shown, client.lostAt > 0 ? 'Picture and values are the last that were received. The page connects again by itself.'
        : 'The page connects by itself as soon as one is started. A recording (.mcap) can be dropped here.');
      stop.hidden = !commander.unsent;
      say(command, restart());
    },
  };
}
