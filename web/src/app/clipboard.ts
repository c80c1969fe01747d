// The clipboard. Browsers provide it to secure pages only, which a page over plain HTTP from another machine is not:
// there copying uses a selection, and pasting a field.
import { openDialog } from './dialog';
import { button, h, toast } from './dom';

function copyBySelection(text: string): boolean {
  const field = h('textarea', { value: text, class: 'unseen', readOnly: true });
  document.body.appendChild(field);
  const before = document.activeElement as HTMLElement | null;
  field.select();
  const done = document.execCommand('copy');
  field.remove();
  before?.focus();
  return done;
}

// `what`: the beginning of the sentence that reports it.
export async function copyText(text: string, what: string): Promise<void> {
  const done = await Promise.resolve(navigator.clipboard?.writeText(text).then(() => true)).catch(() => false) ?? false;
  if (done || copyBySelection(text)) toast(`${what} is on the clipboard.`);
  else toast(`The browser does not give the clipboard to this page. ${text}`, 'warning');
}

export async function pasteText(title: string, take: (text: string) => void): Promise<void> {
  const text = await Promise.resolve(navigator.clipboard?.readText?.()).catch(() => undefined);
  if (text !== undefined) {
    take(text);
    return;
  }
  const field = h('textarea', { rows: 8, 'aria-label': title, placeholder: 'Paste here', spellcheck: false });
  const dialog = h('dialog', { class: 'paste', 'aria-label': title }, h('h2', {}, title), field,
    h('div', { class: 'row' }, h('span', { class: 'spacer' }), button('Cancel', 'Close without it', () => dialog.close()),
      button('Use', title, () => {
        dialog.close();
        take(field.value);
      }, { class: 'on' })));
  openDialog(dialog);
  field.focus();
}
