import { openDialog } from './dialog';
import { button, fill, h, toast } from './dom';
import { KEYS } from './keyboard';
import { set, settings } from './settings';

export function openSettings(version: string, openRecording: () => void): void {
  const dialog = h('dialog', { 'aria-label': 'Settings' });
  const choice = (label: string, value: string, options: [string, string][], change: (value: string) => void): HTMLElement => {
    const select = h('select', { onchange: () => change(select.value) }, options.map(([v, text]) => h('option', { value: v, selected: v === value }, text)));
    return h('label', { class: 'setting' }, h('span', {}, label), select);
  };
  fill(dialog, h('h2', {}, 'Settings'),
    choice('Theme', settings.theme, [['system', 'as the system'], ['light', 'light'], ['dark', 'dark']], (v) => set('theme', v as typeof settings.theme)),
    choice('Key of the stop', settings.stopKeys.join(), [['Escape', 'Escape'], ['Space', 'Space'], ['Escape,Space', 'Escape and Space']], (v) => set('stopKeys', v.split(','))),
    h('h2', { style: 'margin-top:16px' }, 'Keys'),
    h('table', {}, KEYS.map(([key, what]) => h('tr', {}, h('td', {}, key.split(' ').map((k) => (k ? [h('kbd', {}, k), ' '] : ' '))), h('td', {}, what)))),
    h('p', { class: 'muted' }, 'Gamepad: hold a shoulder button, then sticks and triggers move the tool; B stops.'),
    h('p', { class: 'muted about' }, version ? `doppel ${version}. ` : '', 'The manual: ', h('code', {}, 'doppel man'), '; the robots that come with it: ', h('code', {}, 'doppel robots'), '.'),
    h('div', { class: 'row' }, button('Open a recording…', 'Choose .mcap files of this machine; they can also be dropped on the page', () => {
      dialog.close();
      openRecording();
    }), button('Show the first steps again', 'Show them with the next load of the page', () => {
      set('hintsSeen', false);
      toast('The first steps are shown with the next load of the page.');
    }), h('span', { class: 'spacer' }), button('Close', 'Close', () => dialog.close())));
  openDialog(dialog);
}
