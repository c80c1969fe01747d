// The suite of `doppel validate` on a copy of the robot beside the running one: /doppel/validate, and what it publishes.
import type { Message } from '../protocol/cdr';
import { Signal } from './signal';
import type { Twin } from './twin';

export type Verdict = 'passed' | 'failed' | 'warning' | 'waived' | 'not_judged' | 'not_applicable' | 'not_run';
export type State = 'none' | 'running' | 'finished' | 'cancelled' | 'failed';
const STATES: State[] = ['none', 'running', 'finished', 'cancelled', 'failed'];
const LOADING_TIME = 60_000; // ms: the first request loads the suite, which may have to be built
const REPORT_TIME = 120_000; // ms

export interface Outcome {
  id: string;
  title: string;
  verdict: Verdict;
  summary: string;
}

export interface Run {
  state: State;
  number: number;
  robot: string; // its space in the twin: '' or '/left'
  effort: string;
  joint: string;
  done: number;
  check: string;
  message: string;
  judged: string[];
  outcomes: Outcome[];
}

export interface CheckInfo {
  id: string;
  title: string;
  kind: 'gate' | 'test' | 'extra';
  decidedBy: string;
  limit: string;
}

// Members of docs/validate.schema.json, with the curves and commands of a live run. null: not finite.
export interface Curve {
  label: string;
  x: (number | null)[];
  y: (number | null)[];
}
export interface Band {
  label: string;
  low: number | null;
  high: number | null;
  begin: number | null;
  end: number | null;
}
export interface CurvePanel {
  title: string;
  unit: string;
  x_axis: string;
  remark: string;
  curves: Curve[];
  bands: Band[];
}
export interface PosedEvidence {
  caption: string;
  joints: Record<string, number | null>;
  links: string[];
  command: string;
}
export interface Item {
  subject: string;
  verdict: Verdict;
  message: string;
  fix: string;
  file: string;
  line: number;
  column: number;
  poses: PosedEvidence[];
  curves: CurvePanel[];
}
export interface Metric {
  name: string;
  subject: string;
  value: number | null;
  unit: string;
  limit: number | null;
  better: 'neither' | 'lower' | 'higher';
}
export interface CheckResult extends Outcome {
  items: Item[];
  metrics: Metric[];
  notes: string[];
}

const NONE: Run = { state: 'none', number: 0, robot: '', effort: '', joint: '', done: 0, check: '', message: '', judged: [], outcomes: [] };

function readRun(m: Message): Run {
  const robot = String(m['robot']);
  return {
    state: STATES[Number(m['state'])] ?? 'none',
    number: Number(m['run']),
    robot: robot === '' ? '' : `/${robot}`,
    effort: String(m['effort']),
    joint: String(m['joint']),
    done: Number(m['done']),
    check: String(m['check']),
    message: String(m['message']),
    judged: m['judged'] as string[],
    outcomes: (m['outcomes'] as Message[]).map((one) => ({ id: String(one['id']), title: String(one['title']), verdict: String(one['verdict']) as Verdict, summary: String(one['summary']) })),
  };
}

// By check; of a text that is not such results none.
export function readResults(text: string): Map<string, CheckResult> {
  if (text === '') return new Map();
  try {
    const { checks } = JSON.parse(text) as { checks: CheckResult[] };
    return new Map(checks.map((check) => [check.id, check]));
  } catch {
    return new Map();
  }
}

export class Validation {
  readonly changed = new Signal();
  run: Run = NONE;
  results = new Map<string, CheckResult>();
  checks: CheckInfo[] = [];
  problem = ''; // why the last request was refused
  private listing: Promise<void> | null = null;
  private asking = false;

  constructor(private readonly twin: Twin) {
    const { client } = twin;
    client.subscribe('/doppel/validation', (m) => {
      this.run = readRun(m);
      if (this.run.state === 'none') this.results = new Map(); // another twin at the same address
      this.changed.emit();
    });
    client.subscribe('/doppel/validation/results', (m) => {
      this.results = readResults(String(m['data']));
      this.changed.emit();
    });
  }

  get offered(): boolean {
    return this.twin.client.services.has('/doppel/validate');
  }

  get running(): boolean {
    return this.run.state === 'running';
  }

  // The robot that was judged is the selected one.
  get isOfSelected(): boolean {
    return this.run.robot === this.twin.space;
  }

  // A request is on its way.
  get busy(): boolean {
    return this.asking;
  }

  // The names of the checks, once.
  list(): Promise<void> {
    if (this.checks.length > 0) return Promise.resolve();
    this.listing ??= this.call('/doppel/validate/checks', {}, LOADING_TIME).then((answer) => {
      this.listing = null;
      if (!answer) return;
      const column = (name: string): string[] => answer[name] as string[];
      this.checks = column('ids').map((id, i) => ({ id, title: column('titles')[i]!, kind: column('kinds')[i] as CheckInfo['kind'], decidedBy: column('decided_by')[i]!, limit: column('limits')[i]! }));
      this.changed.emit();
    });
    return this.listing;
  }

  async start(effort: string, only: string[], joint: string): Promise<void> {
    await this.call('/doppel/validate', { robot: this.twin.space.replace(/^\//, ''), effort, only, joint }, LOADING_TIME);
  }

  async cancel(): Promise<void> {
    await this.call('/doppel/validate/cancel', {});
  }

  // null: there is none, and `problem` says why.
  async report(format: string): Promise<string | null> {
    const page = `${location.origin}${location.pathname}`;
    const answer = await this.call('/doppel/validate/report', { format, page }, REPORT_TIME);
    return answer ? String(answer['text']) : null;
  }

  private async call(service: string, request: Message, time?: number): Promise<Message | null> {
    this.asking = true;
    this.problem = '';
    this.changed.emit();
    let answer: Message | null = null;
    try {
      answer = await this.twin.client.call(service, request, time);
      if (answer['success'] !== true) {
        this.problem = String(answer['message']);
        answer = null;
      }
    } catch (problem) {
      this.problem = (problem as Error).message;
    }
    this.asking = false;
    this.changed.emit();
    return answer;
  }
}
