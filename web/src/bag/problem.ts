// Why a file cannot be read as a recording, with its name, the offset where that is known, and what to do.
export class BagProblem extends Error {}

const text = (bytes: Uint8Array): string => String.fromCharCode(...bytes);

// Files that are taken for a recording, by their first bytes.
const FORMATS: [start: string, what: (name: string) => string][] = [
  [
    'SQLite format 3\0',
    (name) =>
      `${name} is a SQLite bag of rosbag2 (.db3), which this page does not read; 'doppel bag convert' does not either.` +
      ` Convert its folder by 'ros2 bag convert -i FOLDER -o options.yaml' with storage_id: mcap, or by 'rosbags-convert'.`,
  ],
  [
    '#ROSBAG V',
    (name) =>
      `${name} is a bag of ROS 1 (.bag), which this page does not read; 'doppel bag convert' does not either.` +
      ` Convert it by 'rosbags-convert --src ${name} --dst FOLDER --dst-storage mcap'.`,
  ],
  [
    '\x28\xb5\x2f\xfd',
    (name) => `${name} is compressed as a whole by zstd. Decompress it by 'zstd -d ${name}', and open the result.`,
  ],
  [
    '\x04\x22\x4d\x18',
    (name) => `${name} is compressed as a whole by lz4. Decompress it by 'lz4 -d ${name}', and open the result.`,
  ],
  [
    '\x1f\x8b',
    (name) => `${name} is compressed as a whole by gzip. Decompress it by 'gzip -d ${name}', and open the result.`,
  ],
];
export const MAGIC = '\x89MCAP0\r\n';

// Throws if the file does not begin as an MCAP file does.
export function requireMcap(name: string, start: Uint8Array): void {
  const found = text(start.subarray(0, 16));
  if (found.startsWith(MAGIC)) return;
  if (start.length === 0) throw new BagProblem(`${name} is empty.`);
  const known = FORMATS.find(([begin]) => found.startsWith(begin));
  if (known) throw new BagProblem(known[1](name));
  if (/^\s*</.test(found))
    throw new BagProblem(
      `${name} is a page of text, not an MCAP file: the server has probably no file at this address.`,
    );
  const hex = [...start.subarray(0, 8)].map((byte) => byte.toString(16).padStart(2, '0')).join(' ');
  throw new BagProblem(`${name} is not an MCAP file: at byte 0 it has ${hex} instead of 89 4d 43 41 50 30 0d 0a.`);
}
