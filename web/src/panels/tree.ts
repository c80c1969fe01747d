// The tree of links, each behind the joint that carries it: search, arrow keys, selection shared with the picture.
import type { App, Panel } from '../app/app';
import { fill, h } from '../app/dom';
import type { Tree } from '../robot/tree';

interface Node {
  link: number;
  depth: number;
  children: number[];
  element: HTMLElement;
}

const MARKS: Record<string, string> = { revolute: '↻', continuous: '↻', prismatic: '↔', fixed: '—', floating: '✥', planar: '▱' };

// Links in the order of the tree, with their depths; those that no joint reaches come last.
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
  const list = h('div', { class: 'tree', role: 'tree', 'aria-label': 'Links and joints', tabIndex: 0 });
  const none = h('p', { class: 'empty' }, 'Waiting for the description of the robot.');
  const search = h('input', { type: 'text', placeholder: 'search links and joints', 'aria-label': 'Search links and joints', oninput: () => reflect() });
  let nodes: Node[] = [];
  const byLink = new Map<number, Node>();
  const folded = new Set<number>();
  let built: Tree | null = null; // rows are made when somebody looks: there may be a thousand
  let visible = false;
  let marked: Node | null = null;

  function build(): void {
    const { tree } = twin;
    if (!visible || !tree || tree === built) return;
    built = tree;
    marked = null;
    byLink.clear();
    folded.clear();
    nodes = treeOrder(tree).map(({ link, depth, children }) => {
      const joint = tree.parentJoint[link];
      const toggle = h('span', { class: 'tree-fold', 'aria-hidden': 'true' }, children.length > 0 ? '▾' : '');
      const element = h('div', {
        class: 'tree-row', role: 'treeitem', id: `tree-${link}`, 'aria-level': depth + 1, 'aria-selected': 'false', style: `--depth:${Math.min(depth, 12)}`,
        onclick: (event: MouseEvent) => {
          if (event.target === toggle && children.length > 0) fold(link, !folded.has(link));
          else app.select({ link });
          list.focus();
        },
      }, toggle, h('span', { class: 'tree-link' }, tree.links[link]!),
      joint ? h('span', { class: 'tree-joint muted', title: `${joint.name}, ${joint.kind}` }, `${MARKS[joint.kind] ?? ''} ${joint.name}`) : null);
      if (children.length > 0) element.setAttribute('aria-expanded', 'true');
      const node = { link, depth, children, element };
      byLink.set(link, node);
      return node;
    });
    fill(list, nodes.map((node) => node.element));
    reflect();
    mark();
  }

  function fold(link: number, on: boolean): void {
    if (on) folded.add(link);
    else folded.delete(link);
    const { element } = byLink.get(link)!;
    element.setAttribute('aria-expanded', String(!on));
    element.firstChild!.textContent = on ? '▸' : '▾';
    reflect();
  }

  function reflect(): void {
    const { tree } = twin;
    if (!tree) return;
    const wanted = search.value.trim().toLowerCase();
    const visible = new Set<number>();
    const hidden = new Set<number>();
    for (const { link, children } of nodes) {
      if (hidden.has(link) || folded.has(link)) for (const child of children) hidden.add(child);
      const joint = tree.parentJoint[link];
      if (wanted !== '' && `${tree.links[link]} ${joint?.name ?? ''}`.toLowerCase().includes(wanted)) {
        for (let at: number | undefined = link; at !== undefined && !visible.has(at); at = tree.parentJoint[at]?.parentLink) visible.add(at);
      }
    }
    for (const { link, element } of nodes) element.hidden = wanted === '' ? hidden.has(link) : !visible.has(link);
  }

  function step(to: Node | undefined): void {
    if (to) app.select({ link: to.link });
  }

  list.addEventListener('keydown', (event) => {
    const shown = nodes.filter((node) => !node.element.hidden);
    const at = shown.findIndex((node) => node.link === app.selection?.link);
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
        else if (node) step(byLink.get(twin.tree?.parentJoint[node.link]?.parentLink ?? -1));
        break;
      default: return;
    }
    event.preventDefault();
  });
  search.addEventListener('keydown', (event) => {
    if (event.key !== 'Enter' && event.key !== 'ArrowDown') return;
    event.preventDefault();
    const wanted = search.value.trim().toLowerCase();
    step(nodes.find((node) => !node.element.hidden && node.element.textContent?.toLowerCase().includes(wanted)));
    list.focus();
  });
  function mark(): void {
    const chosen = app.selection ? byLink.get(app.selection.link) ?? null : null;
    marked?.element.setAttribute('aria-selected', 'false');
    marked = chosen;
    if (!chosen) {
      list.removeAttribute('aria-activedescendant');
      return;
    }
    chosen.element.setAttribute('aria-selected', 'true');
    list.setAttribute('aria-activedescendant', chosen.element.id);
    for (let at = twin.tree?.parentJoint[chosen.link]?.parentLink; at !== undefined; at = twin.tree?.parentJoint[at]?.parentLink) {
      if (folded.has(at)) fold(at, false);
    }
    chosen.element.scrollIntoView({ block: 'nearest' });
  }

  app.selected.on(mark);
  twin.robotChanged.on(build);
  fill(list, none);
  return {
    id: 'tree', title: 'Tree', element: h('div', { class: 'tree-panel' }, h('div', { class: 'tools' }, search), list),
    shown: () => {
      visible = true;
      build();
      marked?.element.scrollIntoView({ block: 'nearest' });
    },
    hidden: () => (visible = false),
  };
}
