// The files of a recording: a folder of rosbag2 lists them in its metadata.yaml; otherwise they are ordered by name.
import { byName, openBag, type Bag } from './bag';
import { bytesAt, FileBytes, textAt, type Progress } from './bytes';
import { BagProblem } from './problem';

const METADATA = 'metadata.yaml';

// The list under relative_file_paths; an empty one is written as []. Paths have no further syntax of YAML than quotes.
export function listedFiles(yaml: string, name: string): string[] {
  if (/^\s*storage_identifier:\s*['"]?sqlite3/m.test(yaml)) {
    throw new BagProblem(
      `${name} is a SQLite bag of rosbag2, which this page does not read; 'doppel bag convert' does not either.` +
        ` Convert it by 'ros2 bag convert -i FOLDER -o options.yaml' with storage_id: mcap, or by 'rosbags-convert'.`,
    );
  }
  if (/^\s*compression_mode:\s*['"]?file/im.test(yaml))
    throw new BagProblem(
      `${name}: the files of this bag are compressed as a whole. Decompress them by 'zstd -d', and open the .mcap files.`,
    );
  const list = /^( *)relative_file_paths:[ \t]*\r?\n((?:[ \t]*-[ \t]+.*\r?\n?)+)/m.exec(yaml)?.[2] ?? '';
  const found = list
    .split('\n')
    .map((line) =>
      line
        .trim()
        .replace(/^-\s+/, '')
        .replace(/^(['"])(.*)\1$/, '$2'),
    )
    .filter(Boolean);
  if (found.length === 0) throw new BagProblem(`${name} lists no files under relative_file_paths.`);
  return found;
}

const tail = (path: string): string => path.split('/').filter(Boolean).pop() ?? path;

// The last name of an address, as it is called on the disk.
function nameAt(pathname: string): string {
  try {
    return decodeURIComponent(tail(pathname));
  } catch {
    return tail(pathname); // a % that escapes nothing
  }
}

// The address of a file, of a folder, or of its metadata.yaml.
export async function openAddress(address: string, progress: Progress): Promise<Bag> {
  let url: URL;
  try {
    url = new URL(address, location.href);
  } catch {
    throw new BagProblem(`${address} is not an address.`);
  }
  progress(`Opening ${nameAt(url.pathname)}.`);
  const last = tail(url.pathname);
  const isFolder =
    url.pathname.endsWith('/') ||
    (!last.includes('.') && (await textAt(new URL(`${url.pathname}/${METADATA}${url.search}`, url).href)) !== null);
  if (last !== METADATA && !isFolder) return openBag(nameAt(url.pathname), [await bytesAt(url.href, progress)], progress);
  const metadata =
    last === METADATA ? url : new URL(`${url.pathname.replace(/\/$/, '')}/${METADATA}${url.search}`, url);
  const yaml = await textAt(metadata.href);
  if (yaml === null)
    throw new BagProblem(
      `${metadata.href}: the server has no such file. The address of a folder needs it; that of an .mcap file does not.`,
    );
  const paths = listedFiles(yaml, metadata.pathname);
  const files = [];
  for (const path of paths) files.push(await bytesAt(new URL(`${path}${url.search}`, metadata).href, progress));
  return openBag(nameAt(metadata.pathname.slice(0, -METADATA.length)), files, progress);
}

// Files that were dropped or chosen, with their paths.
export async function openDropped(dropped: { name: string; file: File }[], progress: Progress): Promise<Bag> {
  const metadata = dropped.find(({ name }) => tail(name) === METADATA);
  const folder = metadata?.name.slice(0, -METADATA.length) ?? '';
  if (metadata) {
    const paths = listedFiles(await metadata.file.text(), metadata.name);
    const files = paths.map((path) => {
      const found =
        dropped.find(({ name }) => name === folder + path) ?? dropped.find(({ name }) => tail(name) === tail(path));
      if (!found)
        throw new BagProblem(`${metadata.name} lists ${path}, which is not among the files. Drop the whole folder.`);
      return new FileBytes(path, found.file);
    });
    return openBag(tail(folder) || tail(paths[0]!), files, progress);
  }
  const recordings = dropped.filter(({ name }) => /\.mcap$/i.test(name)).sort((a, b) => byName(a.name, b.name));
  const chosen = recordings.length > 0 ? recordings : dropped.slice(0, 1); // the reason is that of the first one
  if (chosen.length === 0) throw new BagProblem('Nothing was dropped that is a file.');
  return openBag(
    chosen.length === 1 ? tail(chosen[0]!.name) : `${tail(chosen[0]!.name)} and ${chosen.length - 1} more`,
    chosen.map(({ name, file }) => new FileBytes(name, file)),
    progress,
  );
}
