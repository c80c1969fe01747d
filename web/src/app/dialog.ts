// Dialogs below the bar, so that STOP remains in use. What they cover is inert while one is open.
import { h } from './dom';
import { closeAll, closedByEscape } from './escape';

// Opens the dialog and removes it when it closes. `light`: a click beside it closes it.
export function openDialog(dialog: HTMLDialogElement, light = false): void {
  closeAll(); // one at a time
  const focused = document.activeElement;
  const work = document.querySelector<HTMLElement>('.work');
  const layer = h('div', { class: 'dialog-layer' }, dialog);
  const end = closedByEscape(() => dialog.close());
  layer.addEventListener('click', (event) => light && (event.target === layer || event.target === dialog) && dialog.close());
  dialog.addEventListener('close', () => {
    end();
    layer.remove();
    if (work) work.inert = false;
    if (focused instanceof HTMLElement && focused.isConnected) focused.focus();
  }, { once: true });
  document.getElementById('app')!.append(layer);
  if (work) work.inert = true;
  dialog.show();
}
