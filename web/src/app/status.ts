// The status of the twin's loop (/doppel/status) and the load of its joints (/doppel/joint_loads).
import type { Message } from '../protocol/cdr';

export const PHASES = ['control', 'physics', 'publish', 'bus', 'idle'] as const;
export type LoopPhase = (typeof PHASES)[number];

export interface Status {
  simTime: number; // s
  realTimeFactor: number;
  paused: boolean;
  speed: number; // requested factor; 0: as fast as possible
  lateness: { p50: number; p99: number; max: number }; // s
  times: Record<LoopPhase, number>; // mean microseconds of wall-clock time per step
  overruns: number;
  skipped: number; // messages skipped for slow clients
  divergence: string; // why the physics is paused at its last finite state; '': it is not
  hardware: ReadonlySet<string>; // namespaces of the robots that drive real hardware, as '/left' or ''
}

export interface Load {
  joint: string;
  effort: number; // N m or N, the present effort of the drive
  gravity: number; // the effort that gravity requires here
  sag: number; // rad or m, the sag under gravity; 0: it is at its limit
  play: number; // rad or m: friction can hold the joint anywhere within sag - play and sag + play
  margin: number; // of the limit beyond the holding effort; Infinity: no limit
  limit: number;
}

export function readStatus(m: Message): Status {
  const number = (name: string): number => Number(m[name] ?? NaN);
  return {
    simTime: number('sim_time'),
    realTimeFactor: number('real_time_factor'),
    paused: m['paused'] === true,
    speed: number('speed'),
    lateness: { p50: number('lateness_p50'), p99: number('lateness_p99'), max: number('lateness_max') },
    times: Object.fromEntries(PHASES.map((phase) => [phase, number(`time_${phase}`)])) as Record<LoopPhase, number>,
    overruns: number('overruns'),
    skipped: number('skipped'),
    divergence: String(m['divergence'] ?? ''),
    hardware: new Set((m['real_hardware'] as string[] | undefined ?? []).map((name) => (name === '' ? '' : `/${name}`))),
  };
}

export function readLoads(m: Message): Load[] {
  const column = (name: string): ArrayLike<number> => (m[name] ?? []) as ArrayLike<number>;
  const [efforts, gravity, sags, margins, limits, most] = ['efforts', 'gravity_torques', 'sags', 'margins', 'effort_limits', 'most_sags'].map(column);
  return (m['joint_names'] as string[]).map((joint, i) => ({
    joint,
    effort: efforts![i] ?? NaN,
    gravity: gravity![i] ?? NaN,
    sag: sags![i] ?? NaN,
    play: (most![i] ?? sags![i] ?? NaN) - (sags![i] ?? NaN),
    margin: margins![i] ?? NaN,
    limit: limits![i] ?? NaN,
  }));
}

// Describes how much of a joint's limit gravity takes, so that it is not shown by colour alone.
export function judgeLoad(load: Load): { share: number; word: 'free' | 'ample' | 'tight' | 'too much' } {
  if (!Number.isFinite(load.margin)) return { share: 0, word: 'free' };
  const share = load.limit > 0 ? (load.limit - load.margin) / load.limit : 1;
  return { share, word: load.margin < 0 || !(load.limit > 0) ? 'too much' : share > 0.8 ? 'tight' : 'ample' };
}
