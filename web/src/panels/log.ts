// The messages of /rosout, by level.
import type { App, Panel } from '../app/app';
import { button, fill, h } from '../app/dom';
import type { LogLine } from '../app/twin';

const NAMES: [number, string][] = [[10, 'debug'], [20, 'info'], [30, 'warning'], [40, 'error'], [50, 'fatal']];
const MOST = 1000;

export function logPanel(app: App): Panel {
  const lines = app.twin.log;
  const list = h('div', { class: 'log', role: 'log', 'aria-label': 'Messages' });
  const none = h('p', { class: 'empty' }, 'No messages yet at this level. Nodes and controllers write here, by /rosout.');
  let least = 20;
  let follow = true;
  const level = h('select', { 'aria-label': 'Least level', onchange: () => {
    least = Number(level.value);
    show();
    bottom();
  } }, ...NAMES.map(([value, name]) => h('option', { value: String(value), selected: value === least }, name)));
  const search = h('input', { type: 'text', placeholder: 'search', 'aria-label': 'Search the log', oninput: () => show() });
  const fits = (line: LogLine): boolean => line.level >= least && (search.value === '' || `${line.name} ${line.text}`.toLowerCase().includes(search.value.toLowerCase()));
  const nameOf = (value: number): string => NAMES.reduce((best, [l, name]) => (value >= l ? name : best), 'debug');
  const row = (line: LogLine): HTMLElement => h('div', { class: `log-line ${nameOf(line.level)}`, title: line.place },
    h('span', { class: 'num muted' }, line.time.toFixed(3)), h('span', { class: 'level' }, nameOf(line.level)), h('span', { class: 'muted' }, line.name), h('span', { class: 'text' }, line.text));
  const show = (): void => {
    const fitting = lines.filter(fits);
    fill(list, fitting.length > 0 ? fitting.map(row) : none);
  };
  const bottom = (): void => {
    if (follow) list.scrollTop = list.scrollHeight;
  };
  list.addEventListener('scroll', () => (follow = list.scrollHeight - list.scrollTop - list.clientHeight < 24));
  app.twin.logged.on((line) => {
    if (!fits(line)) return;
    none.remove();
    list.appendChild(row(line));
    if (list.children.length > MOST) list.firstElementChild?.remove();
    bottom();
  });
  app.twin.rewound.on(() => {
    show();
    follow = true;
    bottom();
  });
  show();
  return {
    id: 'log', title: 'Log', shown: bottom,
    element: h('div', { class: 'log-panel' }, h('div', { class: 'tools' }, level, search, button('Clear', 'Empty the log', () => {
      lines.length = 0;
      show();
    })), list),
  };
}
