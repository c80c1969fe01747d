// A confirmation of what moves or releases all of a robot at once, if it drives real hardware.
import { openDialog } from './dialog';
import { button, h } from './dom';
import type { Twin } from './twin';

export class Hardware {
  constructor(private readonly twin: Twin) {}

  get real(): boolean {
    return this.twin.status?.hardware.has(this.twin.space) ?? false;
  }

  // Does it at once in simulation; asks before on hardware, or if `always`.
  confirm(what: string, consequence: string, act: () => void, always = false): void {
    if (!this.real && !always) {
      act();
      return;
    }
    const dialog = h('dialog', { class: 'confirm', 'aria-label': what }, h('h2', {}, `${what}?`), h('p', {}, consequence),
      this.real ? h('p', { class: 'muted' }, 'This robot drives real hardware.') : null,
      h('div', { class: 'row' }, h('span', { class: 'spacer' }), button('Cancel', 'Do nothing', () => dialog.close()),
        button(what, what, () => {
          dialog.close();
          act();
        }, { class: 'on', id: 'confirm' })));
    openDialog(dialog);
  }
}
