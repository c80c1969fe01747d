// Whether the selected robot may be a real one, and a confirmation of what moves or releases it all at once.
import type { Message } from '../protocol/cdr';
import { openDialog } from './dialog';
import { button, h } from './dom';
import type { Twin } from './twin';

// Plugins that doppel simulates, by their names. It simulates one of another name, too, if no library provides it; the page
// cannot see that, and asks.
const SIMULATED = /sim|gazebo|ign_|mujoco|isaac|webots|mock|fake|generic/i;

export class Hardware {
  private plugins: string[] = []; // that may be real

  constructor(private readonly twin: Twin) {
    twin.selectedRobot.on(() => (this.plugins = []));
    twin.controllersChanged.on(() => void this.ask());
  }

  get real(): boolean {
    return this.plugins.length > 0;
  }

  private async ask(): Promise<void> {
    const { twin } = this;
    const { space } = twin;
    const service = twin.own('/controller_manager/list_hardware_components');
    if (!twin.client.services.has(service)) return;
    try {
      const answer = await twin.client.call(service);
      if (space === twin.space) this.plugins = (answer['component'] as Message[]).map((one) => String(one['plugin_name'])).filter((name) => !SIMULATED.test(name));
    } catch {
      // without an answer what was known stays
    }
  }

  // Does it at once in simulation; asks before on hardware, or if `always`.
  confirm(what: string, consequence: string, act: () => void, always = false): void {
    if (!this.real && !always) {
      act();
      return;
    }
    const dialog = h('dialog', { class: 'confirm', 'aria-label': what }, h('h2', {}, `${what}?`), h('p', {}, consequence),
      this.real ? h('p', { class: 'muted' }, `Hardware: ${this.plugins.join(', ')}`) : null,
      h('div', { class: 'row' }, h('span', { class: 'spacer' }), button('Cancel', 'Do nothing', () => dialog.close()),
        button(what, what, () => {
          dialog.close();
          act();
        }, { class: 'on', id: 'confirm' })));
    openDialog(dialog);
  }
}
