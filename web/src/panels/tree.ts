// The tree of links, each with the joint that carries it: search, arrow keys, selection shared with the picture.
import type { App, Panel } from '../app/app';
import { fill, h, say } from '../app/dom';
import type { Signal } from '../app/signal';
import { narrow } from '../app/narrow';
import type { Tree } from '../robot/tree';

interface Node {
  link: number;
  depth: number;
  children: number[];
  text: string; // the text that is searched
}

const MARKS: Record<string, string> = { revolute: '↻', continuous: '↻', prismatic: '↔', fixed: '—', floating: '✥', planar: '▱' };

// Links in the order of the tree, with their depths; those without a path of joints to the root are last.
export function treeOrder(tree: Tree): { link: number; depth: number; children: number[] }[] {
  const children = tree.links.map((): number[] => []);
  for (const joint of tree.joints) children[joint.parentLink]!.push(joint.childLink);
  const out: { link: number; depth: number; children: number[] }[] = [];
  const seen = new Set<number>();
  const waiting: [number, number][] = tree.links.map((_, link): [number, number] => [link, 0]).filter(([link]) => link !== tree.root && !tree.parentJoint[link]).reverse();
  waiting.push([tree.root, 0]);
  while (waiting.length > 0) {
    const [link, depth] = waiting.pop()!;
    if (seen.has(link) || tree.links[link] === undefined) continue;
    seen.add(link);
    out.push({ link, depth, children: children[link]! });
    for (const child of children[link]!.slice().reverse()) waiting.push([child, depth + 1]);
  }
  return out;
}

export function treePanel(app: App): Panel {
  const { twin } = app;
  const rows = h('div', { class: 'tree-rows', role: 'presentation' });
  const list = h('div', { class: 'tree', role: 'tree', 'aria-label': 'Links and joints', tabIndex: 0 }, rows);
  const none = h('p', { class: 'empty' });
  const search = h('input', { type: 'text', placeholder: 'search links and joints', 'aria-label': 'Search links and joints', oninput: () => {
    list.scrollTop = 0;
    reflect();
  } });
  const folded = new Set<number>();
  let nodes: Node[] = [];
  let shown: Node[] = []; // those that are neither collapsed nor filtered out
  let byLink = new Map<number, Node>();
  let built: Tree | null = null;

  const height = (): number => (narrow().matches ? 42 : 26);
  const chosen = (): number => shown.findIndex((node) => node.link === app.selection?.link);

  function build(tree: Tree): void {
    built = tree;
    folded.clear();
    nodes = treeOrder(tree).map((one) => ({ ...one, text: `${tree.links[one.link]} ${tree.parentJoint[one.link]?.name ?? ''}`.toLowerCase() }));
    byLink = new Map(nodes.map((node) => [node.link, node]));
    none.remove();
    reflect();
  }

  function reflect(): void {
    const wanted = search.value.trim().toLowerCase();
    const kept = new Set<number>();
    const hidden = new Set<number>();
    for (const { link, children, text } of nodes) {
      if (hidden.has(link) || folded.has(link)) for (const child of children) hidden.add(child);
      if (wanted === '' || !text.includes(wanted)) continue;
      for (let at: number | undefined = link; at !== undefined && !kept.has(at); at = built?.parentJoint[at]?.parentLink) kept.add(at);
    }
    shown = nodes.filter(({ link }) => (wanted === '' ? !hidden.has(link) : kept.has(link)));
    rows.style.height = `${shown.length * height()}px`;
    draw();
  }

  // Only the visible rows exist: a robot may have a thousand.
  function draw(): void {
    const tall = height();
    const first = Math.max(0, Math.floor(list.scrollTop / tall) - 4);
    const last = Math.min(shown.length, Math.ceil((list.scrollTop + list.clientHeight) / tall) + 4);
    fill(rows, shown.slice(first, last).map((node, i) => row(node, (first + i) * tall)));
    const at = chosen();
    if (at >= first && at < last) list.setAttribute('aria-activedescendant', `tree-${shown[at]!.link}`);
    else list.removeAttribute('aria-activedescendant');
  }

  function row({ link, depth, children }: Node, top: number): HTMLElement {
    const joint = built!.parentJoint[link];
    const toggle = h('span', { class: 'tree-fold', 'aria-hidden': 'true' }, children.length === 0 ? '' : folded.has(link) ? '▸' : '▾');
    const element = h('div', {
      class: 'tree-row', role: 'treeitem', id: `tree-${link}`, 'aria-level': depth + 1, 'aria-selected': String(link === app.selection?.link), style: `--depth:${Math.min(depth, 12)};top:${top}px`,
      onclick: (event: MouseEvent) => {
        if (event.target === toggle && children.length > 0) fold(link, !folded.has(link));
        else app.select({ link });
        list.focus({ preventScroll: true });
      },
    }, toggle, h('span', { class: 'tree-link' }, built!.links[link]!),
    joint ? h('span', { class: 'tree-joint muted', title: `${joint.name}, ${joint.kind}` }, `${MARKS[joint.kind] ?? ''} ${joint.name}`) : null);
    if (children.length > 0) element.setAttribute('aria-expanded', String(!folded.has(link)));
    return element;
  }

  function fold(link: number, on: boolean): void {
    if (on) folded.add(link);
    else folded.delete(link);
    reflect();
  }

  function step(to: Node | undefined): void {
    if (to) app.select({ link: to.link });
  }

  list.addEventListener('keydown', (event) => {
    const at = chosen();
    const node = shown[at];
    switch (event.key) {
      case 'ArrowDown': step(shown[Math.min(at + 1, shown.length - 1)]); break;
      case 'ArrowUp': step(shown[Math.max(at - 1, 0)]); break;
      case 'Home': step(shown[0]); break;
      case 'End': step(shown[shown.length - 1]); break;
      case 'ArrowRight':
        if (node && folded.has(node.link)) fold(node.link, false);
        else if (node?.children.length) step(byLink.get(node.children[0]!));
        break;
      case 'ArrowLeft':
        if (node && node.children.length > 0 && !folded.has(node.link)) fold(node.link, true);
        else if (node) step(byLink.get(built?.parentJoint[node.link]?.parentLink ?? -1));
        break;
      default: return;
    }
    event.preventDefault();
  });
  search.addEventListener('keydown', (event) => {
    if (event.key !== 'Enter' && event.key !== 'ArrowDown') return;
    event.preventDefault();
    const wanted = search.value.trim().toLowerCase();
    step(shown.find((node) => node.text.includes(wanted)));
    list.focus();
  });

  // Expands what hides the selection, and scrolls to it.
  function follow(): void {
    const { selection } = app;
    for (let at = selection ? built?.parentJoint[selection.link]?.parentLink : undefined; at !== undefined; at = built?.parentJoint[at]?.parentLink) folded.delete(at);
    reflect();
    const at = chosen(), tall = height();
    if (at < 0) return;
    if (at * tall < list.scrollTop) list.scrollTop = at * tall;
    else if ((at + 1) * tall > list.scrollTop + list.clientHeight) list.scrollTop = (at + 1) * tall - list.clientHeight;
    draw();
  }

  list.addEventListener('scroll', draw, { passive: true });
  new ResizeObserver(() => reflect()).observe(list);
  app.selected.on(follow);
  twin.robotChanged.on(build);
  for (const signal of [twin.statusChanged, twin.robotsChanged] as Signal<unknown>[]) signal.on(() => say(none, twin.missing));
  say(none, twin.missing);
  list.append(none);
  const element = h('div', { class: 'tree-panel' }, h('div', { class: 'tools' }, search), list);
  return {
    id: 'tree', title: 'Tree', element,
    shown: () => {
      element.append(app.details); // where it does not cover the picture
      follow();
    },
    hidden: () => app.world.stage.host.append(app.details),
  };
}
