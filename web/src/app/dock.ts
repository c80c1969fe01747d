// A place for panels: tabs above, one panel below.
import { fill, h } from './dom';
import { set, settings } from './settings';
import type { Panel } from './app';

export class Dock {
  readonly element: HTMLElement;
  private readonly tabs = h('div', { class: 'tabs', role: 'tablist' });
  private readonly body = h('div', { class: 'dock-body' });
  private panels: Panel[] = [];
  private current: Panel | null = null;
  private due = 0;

  constructor(private readonly name: string, label: string, more: HTMLElement[] = []) {
    this.element = h('section', { class: `dock ${name}`, 'aria-label': label }, h('div', { class: 'dock-head' }, this.tabs, ...more), this.body);
  }

  setPanels(panels: Panel[]): void {
    this.panels = panels;
    fill(this.tabs, panels.map((panel, i) =>
      h('button', {
        type: 'button', class: 'tab', role: 'tab', id: `tab-${panel.id}`, 'aria-controls': `panel-${panel.id}`,
        onclick: () => this.open(panel.id),
        onkeydown: (event: KeyboardEvent) => {
          const step = event.key === 'ArrowRight' ? 1 : event.key === 'ArrowLeft' ? -1 : 0;
          const next = this.panels[(i + step + this.panels.length) % this.panels.length];
          if (step === 0 || !next) return;
          event.preventDefault();
          this.open(next.id);
          document.getElementById(`tab-${next.id}`)?.focus();
        },
      }, panel.title)));
    for (const panel of panels) {
      panel.element.id = `panel-${panel.id}`;
      panel.element.classList.add('panel');
      panel.element.setAttribute('role', 'tabpanel');
      panel.element.setAttribute('aria-labelledby', `tab-${panel.id}`);
    }
    const wanted = settings.tabs[this.name];
    const first = panels.find((panel) => panel.id === wanted) ?? panels[0];
    if (first) this.open(first.id, false);
  }

  has(id: string): boolean {
    return this.panels.some((panel) => panel.id === id);
  }

  open(id: string, keep = true): void {
    const panel = this.panels.find((one) => one.id === id);
    if (!panel || panel === this.current) return;
    this.current?.hidden?.();
    this.current = panel;
    for (const tab of this.tabs.children) {
      const on = tab.id === `tab-${id}`;
      tab.setAttribute('aria-selected', String(on));
      (tab as HTMLElement).tabIndex = on ? 0 : -1;
      if (on) tab.scrollIntoView({ block: 'nearest', inline: 'nearest' });
    }
    this.body.replaceChildren(panel.element);
    panel.shown?.();
    panel.update?.();
    if (keep) set('tabs', { ...settings.tabs, [this.name]: id });
  }

  clear(): void {
    this.current?.hidden?.();
    this.current = null;
    this.panels = [];
    this.body.replaceChildren();
  }

  tick(dt: number): void {
    const { current } = this;
    if (!current?.update || this.element.offsetParent === null) return;
    this.due -= dt;
    if (this.due > 0) return;
    this.due = 1 / (current.rate ?? 10);
    current.update();
  }
}
