// Validate: the gates and tests of `doppel validate` on a copy of the robot, with their evidence in the picture.
import type { App, Badge, Panel } from '../app/app';
import { copyText } from '../app/clipboard';
import { button, download, fill, h, say, toast } from '../app/dom';
import { jointsOf, moveToPose } from '../app/linked_pose';
import { placeLabel } from '../app/place_label';
import type { CheckInfo, CheckResult, Item, Metric, Outcome, PosedEvidence, Validation, Verdict } from '../app/validation';
import { type EvidenceGhost, positionsOf } from '../scene/evidence_ghost';
import { evidencePlot } from './evidence_plot';

// The signs of the HTML report: a verdict never has its colour alone.
const SIGNS: Record<Verdict, string> = { passed: '✓', failed: '✗', not_run: '⊘', warning: '!', not_judged: '?', waived: '~', not_applicable: '–' };
const LEVELS: Partial<Record<Verdict, string>> = { failed: 'error', not_run: 'error', warning: 'warning', not_judged: 'warning', passed: 'active' };
const EFFORTS = ['quick', 'standard', 'full'] as const;
const EFFORT_TITLES = { quick: 'Fewer samples: seconds', standard: 'All gates and tests: a minute or some', full: 'More samples, and the extras: minutes' };
const KINDS: [CheckInfo['kind'], string][] = [['gate', 'Gates'], ['test', 'Tests'], ['extra', 'Extras, in a full run or where chosen']];

const words = (verdict: Verdict): string => verdict.replace('_', ' ');
const verdictTag = (verdict: Verdict): HTMLElement => h('span', { class: `tag ${LEVELS[verdict] ?? ''}` }, `${SIGNS[verdict] ?? '?'} ${words(verdict)}`);
const number = (value: number | null): string => (value === null ? '–' : String(+value.toPrecision(4)));

function isOver({ value, limit, better }: Metric): boolean {
  return value !== null && limit !== null && ((better === 'lower' && value > limit) || (better === 'higher' && value < limit));
}

function metricsTable(metrics: Metric[]): HTMLElement | null {
  if (metrics.length === 0) return null;
  return h('div', { class: 'metrics' }, h('table', {},
    h('thead', {}, h('tr', {}, ['of', 'number', 'value', 'limit', 'unit'].map((name) => h('th', { scope: 'col' }, name)))),
    h('tbody', {}, metrics.map((metric) => h('tr', {}, h('td', {}, metric.subject), h('td', {}, metric.name),
      h('td', { class: `num${isOver(metric) ? ' error' : ''}` }, `${isOver(metric) ? '✗ ' : ''}${number(metric.value)}`),
      h('td', { class: 'num' }, metric.limit === null ? '' : number(metric.limit)), h('td', {}, metric.unit))))));
}

interface Row {
  element: HTMLDetailsElement;
  verdict: HTMLElement;
  name: HTMLElement;
  result: HTMLElement;
  body: HTMLElement;
  drawn: string; // the result that the body shows
  ends: (() => void)[]; // of its plots
}

export function validatePanel(app: App, validation: Validation, ghost: EvidenceGhost): Panel {
  const { twin } = app;
  let effort: (typeof EFFORTS)[number] = 'standard';
  const chosen = new Set<string>();
  const rows = new Map<string, Row>();
  let lastRun = 0;
  let opened = 0; // the run whose failures were opened

  const efforts = EFFORTS.map((name) => button(name, EFFORT_TITLES[name], () => {
    effort = name;
    reflect();
  }, { id: `validate-${name}` }));
  const joint = h('select', { id: 'validate-joint', 'aria-label': 'Joint that is judged' });
  const boxes = h('div', { class: 'validate-checks' });
  const which = h('summary', {});
  const choice = h('details', { class: 'validate-choice', ontoggle: () => choice.open && void validation.list() }, which, boxes) as HTMLDetailsElement;
  const run = button('Run', 'Run the checks on a copy of the robot', () => void validation.start(effort, [...chosen], joint.value), { class: 'on', id: 'validate-run' });
  const cancel = button('Cancel', 'End the run', () => void validation.cancel(), { id: 'validate-cancel' });
  const save = button('Save report', 'Save the HTML report of the last run', () => void saveReport(), { id: 'validate-save' });
  const bar = h('progress', { max: 1, 'aria-label': 'Completed part of the run' });
  const state = h('p', { class: 'validate-state', role: 'status' });
  const problem = h('p', { class: 'error', role: 'alert' });
  const judged = h('ul', {});
  const about = h('details', { class: 'validate-judged' }, h('summary', {}, 'What is judged'), judged);
  const table = h('div', { class: 'validate-rows' });

  async function saveReport(): Promise<void> {
    const text = await validation.report('html');
    if (text === null) return;
    download(`${twin.tree?.robot.name ?? 'robot'}-validation.html`, 'text/html', text);
    toast('The report is saved.');
  }

  function showChecks(): void {
    fill(boxes, KINDS.map(([kind, heading]) => {
      const checks = validation.checks.filter((one) => one.kind === kind);
      return checks.length === 0 ? null : h('fieldset', {}, h('legend', {}, heading), checks.map(({ id, title, decidedBy }) => {
        const box = h('input', { type: 'checkbox', checked: chosen.has(id), value: id, onchange: () => {
          if (box.checked) chosen.add(id);
          else chosen.delete(id);
          reflect();
        } });
        return h('label', { class: 'toggle', title: decidedBy }, box, h('span', {}, h('b', {}, id), ` ${title}`));
      }));
    }));
  }

  // -- evidence

  // Joints of another robot may have the same names.
  function withRobot(action: () => void): void {
    if (validation.isOfSelected) action();
    else toast(`This is a configuration of ${validation.run.robot || 'another robot'}: select that robot first.`, 'warning');
  }

  function poseRow(evidence: PosedEvidence): HTMLElement {
    const show = button('Show', `Show this configuration in the picture: ${evidence.caption}`, () => withRobot(() => ghost.show(ghost.shown === evidence ? null : evidence)), { class: 'small show-pose', 'aria-pressed': String(ghost.shown === evidence) });
    poses.set(show, evidence);
    return h('div', { class: 'validate-pose' }, h('span', { class: 'validate-caption' }, evidence.caption, evidence.links.length > 0 ? h('span', { class: 'muted' }, `: ${evidence.links.join(', ')}`) : null),
      show,
      button('Move …', 'Move the running robot there, after a question', () => withRobot(() => moveToPose(app, jointsOf(app, positionsOf(evidence)), 'the configuration of the validation')), { class: 'small' }),
      h('code', {}, evidence.command), button('Copy', 'Copy this command', () => void copyText(evidence.command, 'The command'), { class: 'small' }));
  }
  const poses = new Map<HTMLElement, PosedEvidence>();
  ghost.changed.on(() => {
    for (const [show, evidence] of poses) show.setAttribute('aria-pressed', String(ghost.shown === evidence));
  });

  function itemView(item: Item, of: CheckResult, ends: (() => void)[]): HTMLElement {
    const plots = item.curves.map((curves) => evidencePlot(curves));
    ends.push(...plots.map(({ end }) => end));
    const place = item.file ? placeLabel({ file: app.sources.whole(item.file), line: item.line, column: item.column }) : null;
    return h('div', { class: 'validate-item' },
      h('p', {}, item.verdict === of.verdict ? null : [verdictTag(item.verdict), ' '], item.subject ? h('b', {}, `${item.subject}: `) : null, item.message),
      item.fix ? h('p', { class: 'validate-fix' }, 'Fix: ', item.fix) : null, place ? h('p', { class: 'muted' }, place) : null,
      item.poses.map(poseRow), plots.map(({ element }) => element));
  }

  function closeBody(row: Row): void {
    for (const end of row.ends) end();
    row.ends = [];
    for (const show of row.body.querySelectorAll<HTMLElement>('.show-pose')) {
      if (poses.get(show) === ghost.shown) ghost.show(null);
      poses.delete(show);
    }
    row.drawn = '';
    fill(row.body);
  }

  function drawBody(id: string, row: Row): void {
    const result = validation.results.get(id);
    if (!row.element.open || !result) return;
    const text = JSON.stringify(result);
    if (text === row.drawn) return;
    closeBody(row);
    row.drawn = text;
    const info = validation.checks.find((one) => one.id === id);
    fill(row.body, info ? h('p', { class: 'muted' }, `Decided by: ${info.decidedBy}. Limit: ${info.limit}.`) : null,
      result.items.map((item) => itemView(item, result, row.ends)), result.notes.map((note) => h('p', { class: 'muted' }, note)), metricsTable(result.metrics));
  }

  // -- the table

  function rowOf({ id, title }: Outcome): Row {
    const present = rows.get(id);
    if (present) return present;
    const verdict = h('span', { class: 'validate-verdict' }), name = h('span', { class: 'validate-name' }, h('b', {}, id), ` ${title}`), result = h('span', { class: 'validate-result muted' });
    const body = h('div', { class: 'validate-body' });
    const row: Row = { verdict, name, result, body, drawn: '', ends: [], element: h('details', { class: 'validate-row', id: `validate-row-${id}`, ontoggle: () => (row.element.open ? drawBody(id, row) : closeBody(row)) }, h('summary', {}, verdict, name, result), body) };
    rows.set(id, row);
    return row;
  }

  function forgetRows(): void {
    for (const row of rows.values()) closeBody(row);
    rows.clear();
    fill(table);
  }

  function showRows(): void {
    const { outcomes } = validation.run;
    const order = new Map(validation.checks.map(({ id }, i) => [id, i]));
    const sorted = [...outcomes].sort((a, b) => (order.get(a.id) ?? 0) - (order.get(b.id) ?? 0));
    sorted.forEach((outcome, i) => {
      const row = rowOf(outcome);
      if (table.children[i] !== row.element) table.insertBefore(row.element, table.children[i] ?? null);
      if (row.verdict.textContent !== `${SIGNS[outcome.verdict]} ${words(outcome.verdict)}`) fill(row.verdict, verdictTag(outcome.verdict));
      say(row.result, outcome.summary);
      row.element.classList.toggle('failed', LEVELS[outcome.verdict] === 'error');
      drawBody(outcome.id, row);
    });
  }

  // A run that has ended shows its failures with what there is to see.
  function openFailures(): void {
    const { run: last } = validation;
    if (last.state !== 'finished' || opened === last.number || validation.results.size < last.outcomes.length) return;
    opened = last.number;
    const failed = last.outcomes.filter((one) => one.verdict === 'failed').map((one) => rowOf(one).element);
    for (const element of failed) element.open = true;
  }

  function stateText(): string {
    const { run: now } = validation;
    const of = now.joint ? `, of ${now.joint}` : '';
    const check = validation.checks.find((one) => one.id === now.check);
    switch (now.state) {
      case 'none': return 'Nothing has been validated since the start.';
      case 'running': return `${Math.floor(now.done * 100)} %: ${now.check ? `${now.check} ${check?.title ?? ''}` : 'reading the description'} (${now.effort}${of})`;
      case 'finished': return `${now.message} (${now.effort}${of})`;
      case 'cancelled': return `Cancelled at ${Math.floor(now.done * 100)} %. ${now.message}`;
      case 'failed': return `Not validated: ${now.message}`;
    }
  }

  function reflect(): void {
    const { run: now, running, busy } = validation;
    if (now.number !== lastRun) {
      lastRun = now.number;
      forgetRows();
    }
    efforts.forEach((one, i) => one.setAttribute('aria-pressed', String(EFFORTS[i] === effort)));
    run.disabled = running || busy || !validation.offered;
    cancel.disabled = !running;
    save.disabled = running || busy || now.outcomes.length === 0;
    bar.hidden = !running;
    bar.value = now.done;
    say(state, stateText());
    say(problem, validation.problem);
    problem.hidden = validation.problem === '';
    about.hidden = now.judged.length === 0;
    const sentences = now.judged.join('\n');
    if (judged.dataset['shown'] !== sentences) {
      judged.dataset['shown'] = sentences;
      fill(judged, now.judged.map((one) => h('li', {}, one)));
    }
    say(which, chosen.size === 0 ? `Checks: all${effort === 'full' ? ', with the extras' : ''}` : `Checks: ${[...chosen].join(', ')}`);
    if (boxes.childElementCount === 0 && validation.checks.length > 0) showChecks();
    showRows();
    openFailures();
    app.tabsChanged.emit();
  }

  function badge(): Badge | null {
    const { run: now } = validation;
    if (now.state === 'running') return { text: `${Math.floor(now.done * 100)} %`, level: 'warning', title: 'The validation runs' };
    const failures = now.outcomes.filter((one) => LEVELS[one.verdict] === 'error').length;
    return now.state === 'finished' && failures > 0 ? { text: `✗ ${failures}`, level: 'error', title: `${failures} checks failed` } : null;
  }

  twin.robotChanged.on((tree) => {
    fill(joint, h('option', { value: '' }, 'all joints'), tree.moving.filter((one) => !one.mimic).map((one) => h('option', { value: one.name }, one.name)));
  });
  validation.changed.on(reflect);
  twin.graphChanged.on(reflect);
  addEventListener('themechange', () => {
    for (const [id, row] of rows) {
      if (row.ends.length === 0) continue;
      row.drawn = '';
      drawBody(id, row);
    }
  });
  reflect();

  return {
    id: 'validate', title: 'Validate',
    applies: () => validation.offered,
    badge,
    element: h('div', { class: 'padded validate' },
      h('p', { class: 'muted' }, 'Gates and tests on a copy of the robot. The running one is not touched.'),
      h('div', { class: 'row' }, h('div', { class: 'segments', role: 'group', 'aria-label': 'Effort' }, efforts), joint),
      choice, h('div', { class: 'row' }, run, cancel, h('span', { class: 'spacer' }), save), bar, state, problem, about, table),
    shown: () => {
      if (validation.offered) void validation.list();
    },
    hidden: () => ghost.show(null),
  };
}
