// Findings of the audit, and what gravity asks of each joint.
import type { App, Panel } from '../app/app';
import { fill, h, say } from '../app/dom';
import { readFindings, type Finding } from '../app/health';
import { format, unitOf } from '../app/units';
import type { TreeJoint } from '../robot/tree';

export function healthPanel(app: App): Panel {
  const { twin } = app;
  const findings = h('div', {});
  const table = h('tbody', {});
  let rows: { joint: TreeJoint; cells: HTMLElement[]; bar: HTMLElement }[] = [];

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
  twin.robotChanged.on((tree) => {
    rows = tree.moving.filter((j) => !j.mimic).map((joint) => ({ joint, cells: [h('td', { class: 'num' }), h('td', { class: 'num' }), h('td', { class: 'num' })], bar: h('i', {}) }));
    fill(table, rows.map((row) => h('tr', {}, h('td', {}, row.joint.name), row.cells, h('td', { class: 'margin' }, row.bar))));
  });

  return {
    id: 'health', title: 'Health', rate: 4,
    element: h('div', { class: 'padded' }, h('h3', {}, 'Findings'), findings, h('h3', {}, 'Load of the joints'),
      h('table', { class: 'loads' }, h('thead', {}, h('tr', {}, ['joint', 'error', 'effort', 'of limit', ''].map((t) => h('th', { scope: 'col' }, t)))), table)),
    update: () => {
      for (const { joint, cells, bar } of rows) {
        const effort = twin.effort[joint.index]!;
        const share = joint.effort > 0 ? Math.abs(effort) / joint.effort : NaN;
        say(cells[0]!, `${format(joint, twin.target[joint.index]! - twin.q[joint.index]!)} ${unitOf(joint)}`);
        say(cells[1]!, Number.isFinite(effort) ? `${effort.toFixed(3)} ${joint.kind === 'prismatic' ? 'N' : 'N m'}` : '–');
        say(cells[2]!, Number.isFinite(share) ? `${(share * 100).toFixed(0)} %` : '–');
        bar.style.width = `${Math.min(100, (Number.isFinite(share) ? share : 0) * 100)}%`;
        bar.className = share > 0.8 ? 'high' : '';
      }
    },
    shown: () => (twin.effortWanted += 1),
    hidden: () => (twin.effortWanted -= 1),
  };
}
