// Topics with their rates; the last message as a tree, and a form to publish one.
import type { App, Panel } from '../app/app';
import { button, fill, h, say, toast } from '../app/dom';
import { blank, type Message, type Value } from '../protocol/cdr';
import type { MessageType } from '../protocol/schema';
import { plotWanted } from './plots';

const MOST_ELEMENTS = 60;

type Path = (string | number)[];

export function topicsPanel(app: App): Panel {
  const { twin } = app;
  const { client } = twin;
  const list = h('ul', { class: 'topic-list', role: 'listbox', 'aria-label': 'Topics' });
  const tree = h('div', { class: 'message-tree' });
  const head = h('div', { class: 'tools' });
  const search = h('input', { type: 'text', placeholder: 'search', 'aria-label': 'Search topics', oninput: () => build() });
  let chosen = '';
  let end: (() => void) | null = null;
  let last: Message | null = null;
  let fresh = false;
  let held = false;
  let visible = false;
  let leaves: { node: HTMLElement; path: Path }[] = [];
  let shape = '';
  const rates = new Map<string, { out: HTMLElement; count: number; at: number }>();

  function build(): void {
    const topics = [...client.channels.values()].sort((a, b) => (a.topic < b.topic ? -1 : 1)).filter((c) => c.topic.includes(search.value));
    rates.clear();
    fill(list, topics.length === 0 ? h('li', { class: 'empty' }, 'No topics.') : topics.map((channel) => {
      const out = h('span', { class: 'num muted rate' });
      rates.set(channel.topic, { out, count: client.received.get(channel.topic)?.count ?? 0, at: performance.now() });
      return h('li', {}, h('button', { type: 'button', role: 'option', 'aria-selected': String(channel.topic === chosen), title: channel.schemaName, onclick: () => choose(channel.topic) },
        h('span', { class: 'topic-name' }, channel.topic), out));
    }));
  }

  function choose(topic: string): void {
    end?.();
    chosen = topic;
    last = null;
    shape = '';
    held = false;
    fill(tree, h('p', { class: 'empty' }, 'No message yet.'));
    for (const item of list.querySelectorAll('button')) item.setAttribute('aria-selected', String(item.querySelector('.topic-name')?.textContent === topic));
    const channel = client.channel(topic);
    const hold = button('Hold', 'Keep this message', () => {
      held = !held;
      hold.setAttribute('aria-pressed', String(held));
    });
    fill(head, h('span', { class: 'muted' }, channel?.schemaName ?? ''), h('span', { class: 'spacer' }), hold, button('Publish…', 'Publish a message to this topic', () => publishForm(topic)));
    listen();
  }

  function listen(): void {
    end = chosen === '' || !visible ? null : client.subscribe(chosen, (message) => {
      if (held) return;
      last = message;
      fresh = true;
    });
  }

  // Numbers, texts and lists as nested lists; made anew only when their shape changes.
  function shapeOf(value: Value): string {
    if (value instanceof Uint8Array) return 'u';
    if (Array.isArray(value)) return `[${value.length}${value.length > 0 && typeof value[0] === 'object' ? shapeOf(value[0]!) : ''}]`;
    if (typeof value === 'object') return `{${Object.entries(value).map(([k, v]) => k + shapeOf(v)).join()}}`;
    return '.';
  }

  function textOf(value: Value | undefined): string {
    if (value instanceof Uint8Array) return `${value.length} bytes`;
    if (typeof value === 'number') return Number.isInteger(value) ? String(value) : value.toPrecision(6);
    if (typeof value === 'string') return value.length > 300 ? `${value.slice(0, 300)}… (${value.length} characters)` : value === '' ? '""' : value;
    return String(value);
  }

  function node(name: string, value: Value, path: Path): HTMLElement {
    if (typeof value === 'object' && !(value instanceof Uint8Array)) {
      const entries: [string | number, Value][] = Array.isArray(value) ? value.slice(0, MOST_ELEMENTS).map((v, i) => [i, v]) : Object.entries(value);
      const more = Array.isArray(value) && value.length > MOST_ELEMENTS ? h('div', { class: 'muted' }, `… ${value.length - MOST_ELEMENTS} more`) : null;
      return h('details', { open: path.length < 3 && entries.length <= 30 }, h('summary', {}, name, Array.isArray(value) ? h('span', { class: 'muted' }, ` [${value.length}]`) : null),
        entries.map(([key, v]) => node(String(key), v, [...path, key])), more);
    }
    const out = h('span', { class: 'num leaf' }, textOf(value));
    leaves.push({ node: out, path });
    return h('div', { class: 'leaf-row' }, h('span', { class: 'muted' }, name), out,
      typeof value === 'number' ? button('plot', `Plot ${path.join('.')}`, () => {
        plotWanted.emit({ topic: chosen, path });
        toast('It is among the plots now.');
      }, { class: 'plot-it' }) : null);
  }

  function show(): void {
    if (!last) return;
    const now = shapeOf(last);
    if (now !== shape) {
      shape = now;
      leaves = [];
      fill(tree, Object.entries(last).map(([key, value]) => node(key, value, [key])));
      if (leaves.length === 0) fill(tree, h('p', { class: 'empty' }, 'An empty message.'));
      return;
    }
    for (const { node: out, path } of leaves) {
      let at: Value | undefined = last;
      for (const part of path) at = (at as Record<string | number, Value>)[part];
      say(out, textOf(at));
    }
  }

  function publishForm(topic: string): void {
    const typeName = client.channel(topic)?.schemaName ?? '';
    const type = client.type(typeName);
    if (!type) return;
    const value = blank(type);
    const dialog = h('dialog', { class: 'publish' });
    const close = (): void => dialog.close();
    fill(dialog, h('h2', {}, `Publish to ${topic}`), h('p', { class: 'muted' }, typeName), h('div', { class: 'form' }, fields(type, value)),
      h('div', { class: 'row' }, h('span', { class: 'spacer' }), button('Close', 'Close', close), button('Publish', 'Publish once', () => {
        try {
          client.publish(topic, typeName, value);
          toast(`Published to ${topic}.`);
        } catch (problem) {
          toast((problem as Error).message, 'error');
        }
      }, { class: 'on' })));
    dialog.addEventListener('close', () => dialog.remove());
    document.body.appendChild(dialog);
    dialog.showModal();
  }

  function fields(type: MessageType, value: Message): HTMLElement[] {
    return type.fields.map((field) => {
      if (field.message && !field.list) {
        return h('fieldset', {}, h('legend', {}, field.name), fields(field.message, value[field.name] as Message));
      }
      if (field.type === 'bool' && !field.list) {
        const box = h('input', { type: 'checkbox', checked: value[field.name] === true, onchange: () => (value[field.name] = box.checked) });
        return h('label', {}, h('span', {}, field.name), box);
      }
      const listed = field.list || field.message;
      const input = h('input', { type: 'text', spellcheck: false, value: listed ? JSON.stringify(value[field.name]) : String(value[field.name]), title: field.typeName + (listed ? '[] as JSON' : '') });
      input.addEventListener('input', () => {
        try {
          value[field.name] = listed ? (JSON.parse(input.value) as Value) : field.type === 'string' ? input.value : Number(input.value.replace(',', '.'));
          if (!listed && field.type !== 'string' && (input.value.trim() === '' || Number.isNaN(value[field.name]))) throw new Error('no number');
          input.setCustomValidity('');
        } catch {
          input.setCustomValidity(listed ? 'JSON is wanted here' : 'a number is wanted here');
        }
        input.reportValidity();
      });
      return h('label', {}, h('span', {}, field.name, h('small', { class: 'muted' }, ` ${field.typeName}${field.list ? '[]' : ''}`)), input);
    });
  }

  let known = '';
  twin.graphChanged.on(() => {
    const now = [...client.channels.values()].map((c) => c.topic).join();
    if (now !== known) build();
    known = now;
  });
  return {
    id: 'topics', title: 'Topics', rate: 8,
    element: h('div', { class: 'topics-panel' }, h('div', { class: 'topics-left' }, h('div', { class: 'tools' }, search), list), h('div', { class: 'topics-right' }, head, tree)),
    update: () => {
      if (fresh) {
        fresh = false;
        show();
      }
      const now = performance.now();
      for (const [topic, state] of rates) {
        if (now - state.at < 1000) continue;
        const count = client.received.get(topic)?.count ?? 0;
        const rate = ((count - state.count) / (now - state.at)) * 1000;
        say(state.out, rate > 0.05 ? `${rate < 10 ? rate.toFixed(1) : rate.toFixed(0)} Hz` : count > 0 ? 'still' : '');
        state.count = count;
        state.at = now;
      }
    },
    shown: () => {
      visible = true;
      listen();
    },
    hidden: () => {
      visible = false;
      end?.();
      end = null;
    },
  };
}
