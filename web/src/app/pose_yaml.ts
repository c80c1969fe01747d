// A pose as a YAML trajectory (what `topic pub` takes), and back. Reads the forms that people paste: flow or block
// lists; of several points the last.

export function poseYaml(names: string[], positions: number[], seconds = 2): string {
  const quoted = names.map((name) => JSON.stringify(name)).join(', ');
  return `joint_names: [${quoted}]\npoints:\n- positions: [${positions.map((p) => +p.toFixed(6)).join(', ')}]\n` +
    `  time_from_start: {sec: ${seconds}, nanosec: 0}\n`;
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
