// Findings of the audit, and what gravity asks of each joint.
import type { App, Panel } from '../app/app';
import { fill, h, say } from '../app/dom';
import { readFindings, type Finding } from '../app/health';
import { Seen } from '../app/seen';
import { judgeLoad } from '../app/status';
import { shown, unitOf } from '../app/units';
import type { Tree, TreeJoint } from '../robot/tree';

interface Row {
  joint: TreeJoint;
  element: HTMLElement;
  cells: HTMLElement[]; // made when first seen
  bar: HTMLElement;
}

export function healthPanel(app: App): Panel {
  const { twin } = app;
  const findings = h('div', {});
  const table = h('tbody', {});
  const missing = h('p', { class: 'empty' }, 'This twin does not tell the load of its joints.');
  const loads = h('table', { class: 'loads' },
    h('thead', {}, h('tr', {}, ['joint', 'effort', 'gravity', 'sag', 'margin', ''].map((t) => h('th', { scope: 'col' }, t)))), table);
  const seen = new Seen<Row>((row) => showLoad(row));
  let visible = false;
  let built: Tree | null = null;
  let endLoads = (): void => {};

  // The first link or joint of the description that the finding's words name.
  function find(finding: Finding): number {
    const { tree } = twin;
    if (!tree) return -1;
    for (const text of [finding.subject, ...[...finding.message.matchAll(/'([^']+)'/g)].map((m) => m[1]!)]) {
      const name = text.replace(/^(link|joint) /, '').replace(/^'|'$/g, '');
      const link = tree.linkIndex.get(name) ?? tree.jointByName.get(name)?.childLink;
      if (link !== undefined) return link;
    }
    return -1;
  }

  function show(text: string): void {
    const read = readFindings(text);
    if (!read) {
      fill(findings, h('p', { class: 'empty' }, '/doppel/health holds nothing that can be read.'));
      return;
    }
    fill(findings,
      read.findings.length === 0 ? h('p', { class: 'empty' }, 'Nothing found.') : read.findings.map((f) => {
        const link = find(f);
        return h('details', { class: 'finding' },
          h('summary', {}, h('span', { class: `tag ${f.severity}` }, f.severity), ' ', f.subject ? `${f.subject}: ` : '', f.message),
          h('dl', { class: 'facts' }, [['leads to', f.consequence], ['mend', f.mend], ['where', f.file ? `${f.file}:${f.line}` : ''], ['rule', f.rule]]
            .filter(([, value]) => value !== '').map(([key, value]) => [h('dt', {}, key!), h('dd', {}, value!)])),
          link >= 0 ? h('button', { type: 'button', onclick: () => app.select({ link }) }, `Show ${twin.tree!.links[link]}`) : null);
      }));
  }

  twin.client.subscribe('/doppel/health', (m) => show(String(m['data'])));
  fill(findings, h('p', { class: 'empty' }, 'This twin does not publish /doppel/health.'));
  // Rows are made when somebody looks: there may be a thousand.
  function build(): void {
    const { tree } = twin;
    if (!visible || tree === built) return;
    built = tree;
    const rows: [Element, Row][] = (tree?.moving ?? []).filter((j) => !j.mimic).map((joint) => {
      const element = h('tr', {}, h('th', { scope: 'row' }, joint.name, ' ', h('small', { class: 'muted' }, joint.kind === 'prismatic' ? 'N' : 'N m')));
      return [element, { joint, element, cells: [], bar: h('i', {}) }];
    });
    fill(table, rows.map(([element]) => element));
    seen.watch(rows);
  }
  twin.robotChanged.on(build);

  // The bar is what gravity takes of the limit; the word beside it says the same.
  function showLoad(row: Row): void {
    const { joint, bar } = row;
    if (row.cells.length === 0) {
      row.cells = [0, 1, 2, 3].map(() => h('td', { class: 'num' }));
      row.element.append(...row.cells, h('td', { class: 'margin' }, h('span', { class: 'gauge' }, bar)));
    }
    const [effort, gravity, sag, margin] = row.cells;
    const load = twin.loads.get(joint.name);
    const number = (value: number | undefined): string => (value !== undefined && Number.isFinite(value) ? value.toFixed(3) : '–');
    say(effort!, number(load?.effort));
    say(gravity!, number(load?.gravity));
    say(sag!, load && Number.isFinite(load.sag) ? `${shown(joint, load.sag).toFixed(unitOf(joint) === 'rad' ? 4 : 2)} ${unitOf(joint)}` : '–');
    if (!load) {
      say(margin!, '–');
      return;
    }
    const { share, word } = judgeLoad(load);
    say(margin!, word === 'free' ? 'no limit' : `${word === 'ample' ? '' : word === 'tight' ? '▲ tight, ' : '✕ too much, '}${number(load.margin)}`);
    bar.style.width = `${Math.min(100, share * 100)}%`;
    bar.className = word === 'too much' ? 'over' : word === 'tight' ? 'high' : '';
  }

  return {
    id: 'health', title: 'Health', rate: 4,
    element: h('div', { class: 'padded' }, h('h3', {}, 'Findings'), findings, h('h3', {}, 'Load of the joints'),
      missing, loads),
    update: () => {
      const told = twin.client.channel('/doppel/joint_loads') !== null;
      missing.hidden = told;
      loads.hidden = !told;
      if (told) for (const row of seen) showLoad(row);
    },
    shown: () => {
      visible = true;
      build();
      endLoads = twin.watchLoads();
    },
    hidden: () => {
      visible = false;
      endLoads();
    },
  };
}
