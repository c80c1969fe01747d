// Short functions to create elements.

type Props = Record<string, unknown>;
export type Child = Node | string | number | null | undefined | false | Child[];

function append(parent: Node, children: Child[]): void {
  for (const one of children) {
    if (one === null || one === undefined || one === false) continue;
    if (Array.isArray(one)) append(parent, one);
    else parent.appendChild(one instanceof Node ? one : document.createTextNode(String(one)));
  }
}

// `on...` are listeners, `class`, `style` and names with '-' attributes, the rest properties.
export function h<K extends keyof HTMLElementTagNameMap>(tag: K, props: Props = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(props)) {
    if (value === undefined || value === null) continue;
    if (name.startsWith('on')) element.addEventListener(name.slice(2), value as EventListener);
    else if (name === 'class' || name === 'for' || name === 'role' || name.includes('-')) element.setAttribute(name, String(value));
    else if (name === 'style') element.style.cssText = String(value);
    else (element as unknown as Props)[name] = value;
  }
  append(element, children);
  return element;
}

export function fill(parent: Element, ...children: Child[]): void {
  parent.replaceChildren();
  append(parent, children);
}

// A name of ROS that is broken after its '/', '_' and '.' where its line is too short.
export function breakable(name: string): Child[] {
  return name.split(/(?<=[/_.])/).flatMap((part, i) => (i === 0 ? [part] : [h('wbr'), part]));
}

// Sets a text only if it has changed, to avoid layout.
export function say(node: Node, text: string): void {
  if (node.textContent !== text) node.textContent = text;
}

export function button(label: string | Node, title: string, onclick: () => void, more: Props = {}): HTMLButtonElement {
  return h('button', { type: 'button', title, 'aria-label': title, onclick, ...more }, label);
}

export function toggle(label: string, title: string, on: boolean, change: (on: boolean) => void): HTMLLabelElement {
  const box = h('input', { type: 'checkbox', checked: on, onchange: () => change(box.checked) });
  return h('label', { class: 'toggle', title }, box, h('span', {}, label));
}

export function download(name: string, type: string, text: string): void {
  const url = URL.createObjectURL(new Blob([text], { type }));
  h('a', { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}

let toasts: HTMLElement | null = null;

export function toast(text: string, level: 'note' | 'warning' | 'error' = 'note'): void {
  if (!toasts) {
    toasts = h('div', { class: 'toasts', role: 'status', 'aria-live': 'polite' });
    document.body.appendChild(toasts);
  }
  const item = h('div', { class: `toast ${level}` }, text);
  toasts.appendChild(item);
  while (toasts.children.length > 4) toasts.firstChild?.remove();
  setTimeout(() => item.remove(), level === 'note' ? 3500 : 7000);
}
