// Topics with their rates, the last message as a tree or an image, a form to publish one; services, called with a form.
import type { App, Panel } from '../app/app';
import { breakable, button, fill, h, say, toast } from '../app/dom';
import { ImagePainter, isImage } from '../app/image';
import { formFields, invalid } from '../app/form';
import { blank, isNumbers, type Message, type Value } from '../protocol/cdr';
import type { MessageType } from '../protocol/schema';
import { showPage } from '../app/narrow';
import { plotWanted } from './plots';

const MOST_ELEMENTS = 60;

type Path = (string | number)[];

export function topicsPanel(app: App): Panel {
  const { twin } = app;
  const { client } = twin;
  const list = h('ul', { class: 'topic-list', role: 'listbox', 'aria-label': 'Topics' });
  const tree = h('div', { class: 'message-tree' });
  const head = h('div', { class: 'tools' });
  const search = h('input', { type: 'text', placeholder: 'search', 'aria-label': 'Search topics and services', oninput: () => build() });
  const canvas = h('canvas', { role: 'img', 'aria-label': 'The last image' });
  const caption = h('figcaption', { class: 'muted' });
  const painter = new ImagePainter(canvas);
  painter.onpainted = () => say(caption, painter.note);
  const none = h('p', { class: 'empty' });
  const back = button('‹ All', 'Back to the list', () => showPage(element, 'list'), { class: 'back' });
  let publishing = false;
  let kind: 'topics' | 'services' = 'topics';
  const kinds = h('div', { class: 'segments', role: 'group', 'aria-label': 'What is listed' }, button('Topics', 'Topics', () => showKind('topics'), { 'aria-pressed': 'true' }), button('Services', 'Services', () => showKind('services'), { 'aria-pressed': 'false' }));
  let chosen = '';
  let end: (() => void) | null = null;
  let last: Message | null = null;
  let fresh = false;
  let held = false;
  let visible = false;
  let leaves: { node: HTMLElement; path: Path }[] = [];
  let shape = '';
  const rates = new Map<string, { out: HTMLElement; count: number; at: number }>();

  function entry(name: string, title: string, pick: () => void, more: HTMLElement | null): HTMLElement {
    return h('li', {}, h('button', { type: 'button', role: 'option', 'aria-selected': String(name === chosen), title: `${name}\n${title}`, onclick: pick }, h('span', { class: 'topic-name' }, breakable(name)), more));
  }

  function build(): void {
    const wanted = search.value.toLowerCase();
    const fits = (name: string): boolean => name.toLowerCase().includes(wanted);
    rates.clear();
    const entries = kind === 'services'
      ? [...client.services.values()].filter((s) => fits(s.name)).sort((a, b) => (a.name < b.name ? -1 : 1)).map((s) => entry(s.name, s.type, () => chooseService(s.name), null))
      : [...client.channels.values()].filter((c) => fits(c.topic)).sort((a, b) => (a.topic < b.topic ? -1 : 1)).map((channel) => {
        const out = h('span', { class: 'num muted rate' });
        rates.set(channel.topic, { out, count: client.received.get(channel.topic)?.count ?? 0, at: performance.now() });
        return entry(channel.topic, channel.schemaName, () => choose(channel.topic), out);
      });
    fill(list, entries.length === 0 ? h('li', { class: 'empty' }, wanted ? 'No match.' : `No ${kind} yet.`) : entries);
  }

  function explain(): void {
    if (chosen !== '') return;
    say(none, kind === 'topics' ? 'Choose a topic to see its last message.' : 'Choose a service to call it.');
    if (!none.isConnected) fill(tree, none);
  }

  function showKind(next: typeof kind): void {
    kind = next;
    explain();
    for (const b of kinds.children) b.setAttribute('aria-pressed', String(b.textContent?.toLowerCase() === kind));
    list.setAttribute('aria-label', next === 'topics' ? 'Topics' : 'Services');
    build();
  }

  function mark(): void {
    for (const item of list.querySelectorAll('button')) item.setAttribute('aria-selected', String(item.querySelector('.topic-name')?.textContent === chosen));
  }

  function choose(topic: string): void {
    end?.();
    chosen = topic;
    last = null;
    held = false;
    mark();
    const schema = client.channel(topic)?.schemaName ?? '';
    const hold = button('Hold', 'Keep this message', () => {
      held = !held;
      hold.setAttribute('aria-pressed', String(held));
    }, { 'aria-pressed': 'false' });
    const publish = button('Publish…', 'Publish a message to this topic', () => {
      publishing = !publishing;
      reflect();
    }, { id: 'publish' });
    const reflect = (): void => {
      publish.setAttribute('aria-pressed', String(publishing));
      hold.disabled = publishing;
      publish.disabled = twin.recording !== '';
      if (publish.disabled) publish.title = 'This is a recording: nothing reads what is published.';
      shape = '';
      if (publishing) publishForm();
      else if (last) show();
      else fill(tree, h('p', { class: 'empty' }, 'No message yet.'));
    };
    publishing = false;
    showPage(element, 'detail');
    fill(head, back, h('strong', { class: 'chosen-name' }, topic), h('span', { class: 'muted schema', title: schema }, schema), h('span', { class: 'spacer' }), hold, publish);
    reflect();
    listen();
  }

  function listen(): void {
    end?.();
    end = chosen === '' || !visible || client.services.has(chosen) ? null : client.subscribe(chosen, (message) => {
      if (held) return;
      last = message;
      fresh = true;
    });
  }

  // Numbers, texts and lists as nested lists; recreated only when their shape changes.
  function shapeOf(value: Value): string {
    if (value instanceof Uint8Array) return 'u';
    if (isNumbers(value)) return `[${value.length}]`;
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

  function node(name: string, value: Value, path: Path, plots = true): HTMLElement {
    if (typeof value === 'object' && !(value instanceof Uint8Array)) {
      const list: ArrayLike<Value> | null = Array.isArray(value) || isNumbers(value) ? value : null;
      const entries: [string | number, Value][] = list ? Array.from({ length: Math.min(list.length, MOST_ELEMENTS) }, (_, i) => [i, list[i]!]) : Object.entries(value);
      const more = list && list.length > MOST_ELEMENTS ? h('div', { class: 'muted' }, `… ${list.length - MOST_ELEMENTS} more`) : null;
      return h('details', { open: path.length < 3 && entries.length <= 30 }, h('summary', {}, name, list ? h('span', { class: 'muted' }, ` [${list.length}]`) : null),
        entries.map(([key, v]) => node(String(key), v, [...path, key], plots)), more);
    }
    const out = h('span', { class: 'num leaf' }, textOf(value));
    leaves.push({ node: out, path });
    return h('div', { class: 'leaf-row' }, h('span', { class: 'muted' }, name), out,
      (typeof value === 'number' || typeof value === 'bigint') && plots ? button('plot', `Plot ${path.join('.')}`, () => {
        plotWanted.emit({ topic: chosen, path });
        toast('Added to the plots.');
      }, { class: 'plot-it' }) : null);
  }

  function show(): void {
    if (!last || publishing) return;
    const schema = client.channel(chosen)?.schemaName ?? '';
    if (isImage(schema)) painter.take(last);
    const now = shapeOf(last);
    if (now !== shape) {
      shape = now;
      leaves = [];
      fill(tree, isImage(schema) ? h('figure', { class: 'image' }, canvas, caption) : null, Object.entries(last).map(([key, value]) => node(key, value, [key])));
      if (leaves.length === 0) fill(tree, h('p', { class: 'empty' }, 'An empty message.'));
      return;
    }
    for (const { node: out, path } of leaves) {
      let at: Value | undefined = last;
      for (const part of path) at = (at as Record<string | number, Value>)[part];
      say(out, textOf(at));
    }
  }

  // -- forms

  function form(title: string, type: MessageType, value: Message, verb: string, send: (value: Message) => void, more: HTMLElement[] = []): void {
    const fields = h('form', { class: 'form', onsubmit: (event: Event) => {
      event.preventDefault();
      const wrong = invalid(fields);
      if (wrong) wrong.reportValidity();
      else send(value);
    } }, formFields(type, value));
    const go = button(verb, `${verb}: ${title}`, () => fields.requestSubmit(), { class: 'on', id: 'form-send' });
    fill(tree, fields, h('div', { class: 'row form-row' }, more, h('span', { class: 'spacer' }), go));
  }

  function publishForm(value?: Message): void {
    const typeName = client.channel(chosen)?.schemaName ?? '';
    const type = client.type(typeName);
    if (!type) return;
    const latest = last;
    form(chosen, type, value ?? blank(type), 'Publish', (message) => {
      try {
        client.publish(chosen, typeName, message);
        toast(`Published to ${chosen}.`);
      } catch (problem) {
        toast((problem as Error).message, 'error');
      }
    }, [button('From the last message', 'Fill the form with the last message', () => publishForm(structuredClone(latest!)), { disabled: latest === null })]);
  }

  function callForm(service: string): void {
    const type = client.requestType(service);
    if (!type) return;
    const answer = h('div', { class: 'answer', role: 'status' });
    form(service, type, blank(type), 'Call', (request) => {
      const began = performance.now();
      fill(answer, h('p', { class: 'muted' }, 'Asked.'));
      client.call(service, request, 30000).then(
        (message) => {
          leaves = [];
          fill(answer, h('p', { class: 'muted' }, `Answered in ${(performance.now() - began).toFixed(0)} ms.`), Object.entries(message).map(([key, one]) => node(key, one, [key], false)));
          answer.scrollIntoView({ block: 'nearest' });
        },
        (problem: Error) => fill(answer, h('p', { class: 'error' }, problem.message)));
    });
    tree.append(answer);
  }

  function chooseService(service: string): void {
    end?.();
    end = null;
    chosen = service;
    last = null;
    mark();
    showPage(element, 'detail');
    fill(head, back, h('strong', { class: 'chosen-name' }, service), h('span', { class: 'muted schema' }, client.services.get(service)?.type ?? ''));
    callForm(service);
  }

  let known = '';
  twin.graphChanged.on(() => {
    kinds.hidden = twin.recording !== '';
    if (kinds.hidden && kind === 'services') showKind('topics');
    const now = [...[...client.channels.values()].map((c) => c.topic), ...client.services.keys()].join();
    if (now !== known) build();
    known = now;
  });
  const element = h('div', { class: 'topics-panel' }, h('div', { class: 'topics-left' }, h('div', { class: 'tools' }, kinds, search), list), h('div', { class: 'topics-right' }, head, tree));
  showPage(element, 'list');
  explain();
  return {
    id: 'topics', title: 'Topics', rate: 8,
    element,
    update: () => {
      if (fresh) {
        fresh = false;
        show();
      }
      const now = performance.now();
      explain();
      for (const [topic, state] of rates) {
        if (now - state.at < 1000) continue;
        const count = client.received.get(topic)?.count ?? 0;
        const rate = ((count - state.count) / (now - state.at)) * 1000;
        say(state.out, rate > 0.05 ? `${rate < 10 ? rate.toFixed(1) : rate.toFixed(0)} Hz` : count > 0 ? 'idle' : '');
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
