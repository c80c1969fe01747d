// The keys of the emergency stop, and what Escape closes. They work everywhere on the page: in dialogs, in lists and while
// text is typed, which stays.
import type { Commander } from './commander';
import { settings } from './settings';

const open = new Set<() => void>();

// Registers what Escape closes: a dialog, a list. Returns the function that ends it.
export function closedByEscape(close: () => void): () => void {
  open.add(close);
  return () => open.delete(close);
}

export function closeAll(): void {
  for (const close of [...open]) close();
}

export function isTyping(target: EventTarget | null): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target instanceof HTMLInputElement) return !['range', 'checkbox', 'button'].includes(target.type);
  return target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement || target.isContentEditable;
}

export function startStopKeys(commander: Commander): void {
  const pressed = new Set<string>();
  const isStop = (event: KeyboardEvent): boolean => settings.stopKeys.includes(event.code) && !(event.code === 'Space' && isTyping(event.target));
  const stop = (): void => {
    if (!commander.stopped) void commander.stop();
  };
  addEventListener('keydown', (event) => {
    const stops = isStop(event), closes = event.code === 'Escape';
    if (!stops && !closes) return;
    pressed.add(event.code);
    event.preventDefault(); // a search field would delete its text
    if (event.repeat) return;
    if (stops) stop();
    if (closes) closeAll();
  }, true);
  // The open list of a select element or a colour field receives the key itself and closes; the page receives its release only.
  addEventListener('keyup', (event) => {
    const seen = pressed.delete(event.code);
    const list = event.target instanceof HTMLSelectElement || event.target instanceof HTMLInputElement;
    if (!seen && list && event.code === 'Escape' && isStop(event)) stop();
  }, true);
  addEventListener('blur', () => pressed.clear());
}
