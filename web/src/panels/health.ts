// Findings of the audit, and the gravity load of each joint.
import type { App, Badge, Panel } from '../app/app';
import { button, fill, h, say, type Child } from '../app/dom';
import { readFindings, type Finding } from '../app/health';
import { placeLabel } from '../app/place_label';
import { Seen } from '../app/seen';
import type { Signal } from '../app/signal';
import { judgeLoad } from '../app/status';
import { fixed, shown, unitOf } from '../app/units';
import type { Tree, TreeJoint } from '../robot/tree';

interface Row {
  joint: TreeJoint;
  element: HTMLElement;
  cells: HTMLElement[]; // created when first visible
  bar: HTMLElement;
}

// Marked by a sign as well as by its colour.
function badgeOf(findings: Finding[]): Badge | null {
  const count = (severity: string): number => findings.filter((one) => one.severity === severity).length;
  const errors = count('error'), warnings = count('warning');
  if (errors + warnings === 0) return null;
  const words = [[errors, 'error'], [warnings, 'warning']].filter(([n]) => n !== 0).map(([n, word]) => `${n} ${word}${n === 1 ? '' : 's'}`);
  return errors > 0 ? { text: `✕ ${errors}`, level: 'error', title: words.join(', ') } : { text: `⚠ ${warnings}`, level: 'warning', title: words.join(', ') };
}

export function healthPanel(app: App): Panel {
  const { twin } = app;
  const findings = h('div', {});
  const table = h('tbody', {});
  const missing = h('p', { class: 'empty' });
  const loads = h('table', { class: 'loads' },
    h('thead', {}, h('tr', {}, ['joint', 'effort', 'gravity', 'sag', 'margin', ''].map((t) => h('th', { scope: 'col' }, t)))), table);
  const seen = new Seen<Row>((row) => showLoad(row));
  let visible = false;
  let built: Tree | null = null;
  let endLoads = (): void => {};

  // The first link or joint of the description that the text of the finding names.
  function find(finding: Finding): { link: number; joint: TreeJoint | null } | null {
    const { tree } = twin;
    if (!tree) return null;
    for (const text of [finding.subject, ...[...finding.message.matchAll(/'([^']+)'/g)].map((m) => m[1]!)]) {
      const name = text.replace(/^(link|joint) /, '').replace(/^'|'$/g, '');
      const joint = tree.jointByName.get(name);
      const link = /^joint /.test(text) ? joint?.childLink : tree.linkIndex.get(name) ?? joint?.childLink;
      if (link !== undefined) return { link, joint: joint && (/^joint /.test(text) || !tree.linkIndex.has(name)) ? joint : null };
    }
    return null;
  }

  function showFinding(finding: Finding): HTMLElement {
    const { sources } = app;
    const about = find(finding);
    const written = !about ? undefined : about.joint ? sources.joints.get(about.joint.name) : sources.links.get(twin.tree!.links[about.link]!);
    const place = finding.file ? { file: sources.whole(finding.file), line: finding.line, column: finding.column } : written;
    const facts: [string, Child][] = [['leads to', finding.consequence], ['fix', finding.fix], ['where', place ? placeLabel(place) : ''], ['rule', finding.rule]];
    const name = about ? about.joint?.name ?? twin.tree!.links[about.link]! : '';
    return h('details', { class: 'finding' },
      h('summary', {}, h('span', { class: `tag ${finding.severity}` }, finding.severity), ' ', finding.subject ? `${finding.subject}: ` : '', finding.message),
      h('dl', { class: 'facts' }, facts.filter(([, value]) => value !== '').map(([key, value]) => [h('dt', {}, key), h('dd', {}, value)])),
      about ? button(`Show ${name}`, `Select ${name}`, () => app.select({ link: about.link })) : null);
  }

  let reported = '';
  let badge: Badge | null = null;
  function show(): void {
    const read = readFindings(reported);
    badge = badgeOf(read?.findings ?? []);
    app.tabsChanged.emit();
    if (!read) fill(findings, h('p', { class: 'empty' }, `${twin.own('/doppel/health')} has no valid content.`));
    else fill(findings, read.findings.length === 0 ? h('p', { class: 'empty' }, 'Nothing found.') : read.findings.map(showFinding));
  }

  function forget(): void {
    reported = '';
    badge = null;
    app.tabsChanged.emit();
    fill(findings, h('p', { class: 'empty' }, `No findings received yet on ${twin.own('/doppel/health')}.`));
  }

  forget();
  twin.selectedRobot.on(forget);
  twin.follow('/doppel/health', (m) => {
    reported = String(m['data']);
    show();
  });
  // Names and locations are available only with the description and the sources.
  for (const signal of [app.sources.changed, app.world.built] as Signal<unknown>[]) signal.on(() => reported !== '' && show());
  // Rows are created when they become visible: there may be a thousand.
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

  // The bar is the share of the limit that gravity takes; the word next to it means the same.
  function showLoad(row: Row): void {
    const { joint, bar } = row;
    if (row.cells.length === 0) {
      row.cells = [0, 1, 2, 3].map(() => h('td', { class: 'num' }));
      row.element.append(...row.cells, h('td', { class: 'margin' }, h('span', { class: 'gauge' }, bar)));
    }
    const [effort, gravity, sag, margin] = row.cells;
    const load = twin.loads.get(joint.name);
    const number = (value: number | undefined): string => fixed(value ?? NaN, 3);
    say(effort!, number(load?.effort));
    say(gravity!, number(load?.gravity));
    const digits = unitOf(joint) === 'rad' ? 4 : 2;
    const angle = (value: number): string => `${fixed(shown(joint, value), digits)} ${unitOf(joint)}`;
    say(sag!, load && Number.isFinite(load.sag) ? angle(load.sag) : '–');
    // The column is too narrow for a range.
    sag!.title = load && load.play > 0 ? `with friction anywhere from ${angle(load.sag - load.play)} to ${angle(load.sag + load.play)}` : '';
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
    badge: () => badge,
    update: () => {
      say(missing, twin.recording ? 'This recording has no joint loads.' : app.commander.viewing ? 'Loads need physics: doppel up instead of doppel view.' : 'This twin does not publish joint loads.');
      const offered = twin.client.channel(twin.own('/doppel/joint_loads')) !== null;
      missing.hidden = offered;
      loads.hidden = !offered;
      if (offered) for (const row of seen) showLoad(row);
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
