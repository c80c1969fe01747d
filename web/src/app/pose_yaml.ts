// Poses as YAML trajectories (the format of `doppel topic pub` and `ros2 topic pub`), and back. Reads the forms that
// users paste: flow or block lists; of several points the last; of several documents all.

export interface TrajectoryPoint {
  time: number; // s from the start
  positions: number[];
}

const list = (items: (string | number)[]): string => `[${items.join(', ')}]`;

// `topic` is in a comment, for publishing by hand.
export function trajectoryYaml(names: string[], points: TrajectoryPoint[], topic = ''): string {
  const rows = points.map(({ time, positions }) => {
    const sec = Math.floor(time + 5e-10), nanosec = Math.max(0, Math.round((time - sec) * 1e9));
    return `- positions: ${list(positions.map((p) => +p.toFixed(6)))}\n  time_from_start: {sec: ${sec}, nanosec: ${nanosec}}\n`;
  });
  return `${topic ? `# ${topic}\n` : ''}joint_names: ${list(names.map((name) => JSON.stringify(name)))}\npoints:\n${rows.join('')}`;
}

function listAfter(text: string, key: string, last: boolean): string[] | null {
  const matches = [...text.matchAll(new RegExp(`(?:^|[\\s{,-])${key}:[ \\t]*(?:\\[([^\\]]*)\\]|((?:\\s*\\n[ \\t]*-[ \\t]+[^\\n]+)+))`, 'g'))];
  const match = last ? matches[matches.length - 1] : matches[0];
  if (!match) return null;
  const items = match[1] !== undefined
    ? [...match[1].matchAll(/\s*(?:"((?:[^"\\]|\\.)*)"|'([^']*)'|([^,\s][^,\n]*))/g)].map((m) => m[1]?.replace(/\\(.)/g, '$1') ?? m[2] ?? m[3] ?? '')
    : match[2]!.split('\n').map((line) => line.replace(/^[ \t]*-[ \t]+/, '').trim().replace(/^(["'])(.*)\1$/, '$2'));
  return items.map((item) => item.trim()).filter((item) => item !== '');
}

export function parsePose(text: string): Map<string, number> | null {
  const out = new Map<string, number>();
  for (const document of text.split(/^---[ \t]*$/m).filter((part) => /[^\s]/.test(part.replace(/^\s*#.*$/gm, '')))) {
    const read = parseDocument(document);
    if (!read) return null;
    for (const [name, value] of read) out.set(name, value);
  }
  return out.size > 0 ? out : null;
}

function parseDocument(text: string): Map<string, number> | null {
  const names = listAfter(text, 'joint_names', false) ?? listAfter(text, 'name', false);
  const positions = listAfter(text, 'positions', true) ?? listAfter(text, 'position', true);
  if (!names || !positions || names.length !== positions.length || names.length === 0) return null;
  const out = new Map<string, number>();
  for (let i = 0; i < names.length; i += 1) {
    const value = Number(positions[i]);
    if (!Number.isFinite(value)) return null;
    out.set(names[i]!, value);
  }
  return out;
}
