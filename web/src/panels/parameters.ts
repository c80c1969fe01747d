// Nodes and their parameters, each with an editor of its type; the reason why a node rejects a value is shown in its
// row.
import type { App, Panel } from '../app/app';
import { breakable, button, fill, h, say } from '../app/dom';
import { showPage } from '../app/narrow';
import { kindOf, splitName, textOf, type Descriptor, type Kind, type Parameters } from '../app/parameters';

interface Row {
  full: string;
  kind: Kind;
  input: HTMLInputElement;
  error: HTMLElement;
  element: HTMLElement;
  waiting: boolean; // until the node responds
}

const OPEN = 1e300; // beyond it an end of a range is none: DBL_MAX

export function rangeText(from: number, to: number): string {
  const low = from > -OPEN, high = to < OPEN;
  return low && high ? `${from} … ${to}` : low ? `≥ ${from}` : high ? `≤ ${to}` : '';
}

export function parametersPanel(app: App, parameters: Parameters): Panel {
  const { twin } = app;
  const nodes = h('ul', { class: 'topic-list', role: 'listbox', 'aria-label': 'Nodes' });
  const table = h('div', { class: 'parameters' });
  const search = h('input', { type: 'text', placeholder: 'search', 'aria-label': 'Search parameters', oninput: () => build() });
  const nodeName = h('strong', { class: 'chosen-name' });
  let chosen = '';
  let rows = new Map<string, Row>();
  let known = '';
  let end: (() => void) | null = null;

  function tell(row: Row, problem: string): void {
    say(row.error, problem);
    row.error.hidden = problem === '';
    row.input.setAttribute('aria-invalid', String(problem !== ''));
  }

  function reset(row: Row): void {
    const value = parameters.values.get(row.full)?.value;
    if (row.kind === 'bool') row.input.checked = value === true;
    else row.input.value = textOf(value);
  }

  async function commit(row: Row): Promise<void> {
    const text = row.kind === 'bool' ? String(row.input.checked) : row.input.value;
    if (text === textOf(parameters.values.get(row.full)?.value)) {
      tell(row, '');
      return;
    }
    row.waiting = true;
    try {
      await parameters.set(row.full, text, row.kind);
      tell(row, '');
      row.element.classList.add('set');
      setTimeout(() => row.element.classList.remove('set'), 900);
    } catch (problem) {
      tell(row, (problem as Error).message);
      if (row.kind === 'bool') reset(row);
    } finally {
      row.waiting = false;
    }
  }

  function makeRow(full: string, name: string, descriptor: Descriptor | undefined): Row {
    const parameter = parameters.values.get(full)!;
    const kind = descriptor?.kind ?? kindOf(parameter);
    const range = descriptor ? rangeText(descriptor.from, descriptor.to) : '';
    const about = [descriptor?.description, descriptor?.constraints, range].filter(Boolean).join(' · ');
    const input = h('input', kind === 'bool' ? { type: 'checkbox' } : { type: 'text', spellcheck: false, class: /int|double/.test(kind) ? 'num' : '', ...(kind === 'int' || kind === 'double' ? { inputMode: 'decimal' } : {}) });
    input.setAttribute('aria-label', `${name} (${kind})`);
    const error = h('span', { class: 'error parameter-error', role: 'alert', hidden: true });
    const row: Row = {
      full, kind, input, error, waiting: false,
      element: h('div', { class: 'parameter' },
        h('span', { class: 'parameter-name', title: full }, breakable(name)), h('span', { class: 'parameter-value' }, descriptor?.readOnly ? h('span', { class: 'num', title: 'read only' }, textOf(parameter.value) || '–') : input),
        h('span', { class: 'muted' }, kind), h('span', { class: 'muted parameter-about' }, about), error),
    };
    input.addEventListener('change', () => void commit(row));
    reset(row);
    return row;
  }

  function build(): void {
    const found = new Map<string, string[]>();
    const wanted = search.value.toLowerCase();
    for (const full of [...parameters.values.keys()].sort()) {
      const { node, name } = splitName(full);
      if (!full.toLowerCase().includes(wanted)) continue;
      found.set(node, [...(found.get(node) ?? []), name]);
    }
    known = [...parameters.values.keys()].sort().join();
    if (!found.has(chosen)) chosen = [...found.keys()].find((node) => /controller$/.test(node)) ?? [...found.keys()][0] ?? '';
    fill(nodes, found.size === 0 ? h('li', { class: 'empty' }, parameters.values.size > 0 ? 'No match.' : 'No node has parameters.') : [...found].map(([node, names]) =>
      h('li', {}, h('button', { type: 'button', role: 'option', 'aria-selected': String(node === chosen), onclick: () => {
        chosen = node;
        showPage(element, 'detail');
        build();
      } }, h('span', { class: 'topic-name' }, breakable(node)), h('span', { class: 'num muted' }, String(names.length))))));
    const names = found.get(chosen) ?? [];
    const node = chosen;
    say(nodeName, node);
    rows = new Map();
    fill(table, names.length === 0 ? null : h('p', { class: 'empty' }, 'Loading.'));
    if (names.length === 0) return;
    void parameters.describe(node).then((descriptor) => {
      if (node !== chosen) return;
      rows = new Map(names.filter((name) => parameters.values.has(`${node}.${name}`)).map((name) => [`${node}.${name}`, makeRow(`${node}.${name}`, name, descriptor.get(name))]));
      fill(table, [...rows.values()].map((row) => row.element));
    });
  }

  parameters.changed.on((names) => {
    if (!end) return;
    if ([...parameters.values.keys()].sort().join() !== known) build();
    for (const name of names) {
      const row = rows.get(name);
      if (row && !row.waiting && document.activeElement !== row.input) {
        reset(row);
        tell(row, '');
      }
    }
  });
  twin.phaseChanged.on((phase) => {
    if (phase === 'open') parameters.refresh();
  });
  twin.controllersChanged.on(() => {
    if (end) void twin.client.getParameters().catch(() => {});
  });

  const back = button('‹ All', 'Back to the list of nodes', () => showPage(element, 'list'), { class: 'back' });
  const element = h('div', { class: 'topics-panel parameters-panel' }, h('div', { class: 'topics-left' }, h('div', { class: 'tools' }, search), nodes),
    h('div', { class: 'topics-right' }, h('div', { class: 'tools detail-head' }, back, nodeName), table));
  showPage(element, 'list');
  return {
    id: 'parameters', title: 'Parameters',
    element,
    shown: () => {
      end ??= parameters.watch();
      build();
    },
    hidden: () => {
      end?.();
      end = null;
    },
  };
}
