// Recordings that are dropped on the page or chosen in a dialog. The reader is loaded with the first of them.
import type { App } from './app';
import { h } from './dom';

type Place = 'first' | 'second';
interface Dropped {
  name: string;
  file: File;
}

const loadReader = (): Promise<typeof import('../bag/session')> => import('../bag/session');

async function open(app: App, files: Promise<Dropped[]>, place: Place): Promise<void> {
  const [{ openFiles }, found] = await Promise.all([loadReader(), files]);
  await openFiles(app, found, place);
}

// A file chooser, for devices without drag and drop.
export function chooseRecording(app: App, place: Place = 'first'): void {
  const input = h('input', {
    type: 'file',
    multiple: true,
    class: 'unseen',
    id: 'bag-file',
    oncancel: () => input.remove(),
    onchange: () => {
      void open(app, Promise.resolve([...(input.files ?? [])].map((file) => ({ name: file.name, file }))), place);
      input.remove();
    },
  });
  document.body.append(input);
  input.click();
}

// The files of a folder, and of the folders in it.
async function filesIn(entry: FileSystemEntry): Promise<Dropped[]> {
  if (entry.isFile) {
    const file = await new Promise<File>((done, failed) => (entry as FileSystemFileEntry).file(done, failed));
    return [{ name: entry.fullPath.replace(/^\//, ''), file }];
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  const found: Dropped[] = [];
  for (;;) {
    // the browser gives at most a hundred at once
    const entries = await new Promise<FileSystemEntry[]>((done, failed) => reader.readEntries(done, failed));
    if (entries.length === 0) return found;
    for (const one of entries) found.push(...(await filesIn(one)));
  }
}

// The entries must be taken before the event is over.
async function filesOf(transfer: DataTransfer): Promise<Dropped[]> {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.() ?? null);
  const files = [...transfer.files].map((file) => ({ name: file.name, file }));
  if (!entries.some((entry) => entry?.isDirectory)) return files;
  return (await Promise.all(entries.flatMap((entry) => (entry ? [filesIn(entry)] : [])))).flat();
}

export function startRecordings(app: App): void {
  const zone = (place: Place, title: string, text: string): HTMLElement => {
    const element = h(
      'div',
      { class: 'drop-zone', id: `drop-${place}` },
      h('strong', {}, title),
      h('span', { class: 'muted' }, text),
    );
    element.addEventListener('dragover', () => element.classList.add('over'));
    element.addEventListener('dragleave', () => element.classList.remove('over'));
    return element;
  };
  const first = zone('first', 'Open the recording', '.mcap files, or the folder of a bag');
  const second = zone('second', 'Compare with the open recording', 'its robot is drawn as a ghost');
  const zones = h('div', { class: 'drop-zones', hidden: true }, first, second);
  document.body.append(zones);
  const hasFiles = (event: DragEvent): boolean => event.dataTransfer?.types.includes('Files') ?? false;
  const hide = (): void => {
    zones.hidden = true;
    for (const element of [first, second]) element.classList.remove('over');
  };
  addEventListener('dragover', (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    second.hidden = app.playback === null;
    zones.hidden = false;
  });
  addEventListener('dragleave', (event) => event.relatedTarget === null && hide());
  addEventListener('drop', (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    const place = second.contains(event.target as Node) ? 'second' : 'first';
    hide();
    void open(app, filesOf(event.dataTransfer!), place);
  });
}
