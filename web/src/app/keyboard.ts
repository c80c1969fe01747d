// Keys of the whole page; they are off while text is typed.
import type { App } from './app';
import { isTyping } from './escape';
import type { Jog } from './jog';
import { settings } from './settings';
import { VIEWS, type ViewName } from '../scene/camera';

export const KEYS: [string, string][] = [
  ['Escape', 'emergency stop, also closes dialogs and lists (can be changed above)'], ['P', 'pause and play'], ['.', 'one step'],
  ['W S  A D  R F', 'tool along x, y, z'], ['U O  I K  J L', 'turn the tool about x, y, z'],
  ['[ ]', 'jog the chosen joint'], ['- +', 'choose the joint before, after'], ['1 … 6', 'views'], ['0', 'fit the view'],
  ['← → ↑ ↓', 'turn the picture, where it has the focus; with shift move it'], ['PgUp PgDn', 'nearer and farther'],
  ['Space L', 'in a recording: play and pause, loop'], ['← → Home End', 'in a recording: one thirtieth of a second, with shift one second; its start and end'],
  [', .', 'in a recording: the message before, the next one'],
];

export function startKeyboard(app: App, jog: Jog): void {
  const click = (id: string): void => document.getElementById(id)?.click();
  addEventListener('keydown', (event) => {
    const dialog = document.querySelector('dialog[open]') !== null;
    if (dialog || settings.stopKeys.includes(event.code) || isTyping(event.target) || event.ctrlKey || event.metaKey || event.altKey) return;
    if (!app.twin.recording && jog.press(event.code)) {
      event.preventDefault();
      return;
    }
    if (app.twin.recording && ['KeyP', 'Period'].includes(event.code)) return; // keys of its time line
    if (event.code === 'KeyP' && !event.repeat) click('play');
    else if (event.code === 'Period') click('step');
    else if (event.code === 'Minus') jog.nextJoint(-1);
    else if (event.code === 'Equal') jog.nextJoint(1);
    else if (event.code === 'Digit0') app.world.refit();
    else if (/^Digit[1-6]$/.test(event.code)) app.world.look(Object.keys(VIEWS)[Number(event.code[5]) - 1] as ViewName);
    else return;
    event.preventDefault();
  });
  addEventListener('keyup', (event) => jog.lift(event.code));
}
