// A place for panels: tabs above, one panel below.
import type { Panel } from './app';
import { button, fill, h, say } from './dom';
import { closedByEscape } from './escape';
import { icon } from './icons';
import { set, settings } from './settings';

export class Dock {
  readonly element: HTMLElement;
  private readonly tabs = h('div', { class: 'tabs', role: 'tablist' });
  private readonly body = h('div', { class: 'dock-body' });
  private readonly list = h('div', { class: 'tab-list', role: 'menu', hidden: true });
  private readonly more: HTMLButtonElement;
  private panels: Panel[] = [];
  private current: Panel | null = null;
  private chosen = ''; // the tab that the user has opened, here or in an earlier session
  private endList = (): void => {};
  private due = 0;

  constructor(private readonly name: string, label: string, more: HTMLElement[] = []) {
    this.more = button(icon('down'), 'All panels', () => this.showList(this.list.hidden), { class: 'icon more-tabs', 'aria-haspopup': 'menu', 'aria-expanded': 'false', hidden: true });
    this.element = h('section', { class: `dock ${name}`, 'aria-label': label }, h('div', { class: 'dock-head' }, this.tabs, this.more, ...more, this.list), this.body);
    this.tabs.addEventListener('scroll', () => this.fade());
    new ResizeObserver(() => this.fade()).observe(this.tabs);
    this.element.addEventListener('focusout', (event) => {
      if (!this.list.hidden && !this.list.contains(event.relatedTarget as Node | null) && event.relatedTarget !== this.more) this.showList(false);
    });
  }

  setPanels(panels: Panel[]): void {
    this.panels = panels;
    fill(this.tabs, panels.map((panel) =>
      h('button', {
        type: 'button', class: 'tab', role: 'tab', id: `tab-${panel.id}`, 'aria-controls': `panel-${panel.id}`,
        onclick: () => this.open(panel.id),
        onkeydown: (event: KeyboardEvent) => {
          const offered = this.panels.filter((one) => this.offers(one));
          const step = event.key === 'ArrowRight' ? 1 : event.key === 'ArrowLeft' ? -1 : 0;
          const next = offered[(offered.indexOf(panel) + step + offered.length) % offered.length];
          if (step === 0 || !next) return;
          event.preventDefault();
          this.open(next.id);
          this.tab(next)?.focus();
        },
      }, h('span', {}, panel.title), h('span', { class: 'badge', hidden: true }))));
    for (const panel of panels) {
      panel.element.id = `panel-${panel.id}`;
      panel.element.classList.add('panel');
      panel.element.setAttribute('role', 'tabpanel');
      panel.element.setAttribute('aria-labelledby', `tab-${panel.id}`);
    }
    this.chosen = settings.tabs[this.name] ?? '';
    this.refresh();
  }

  // Shows the tabs of the panels that apply to this twin, and what their badges say.
  refresh(): void {
    if (this.panels.length === 0) return;
    if (!this.current || !this.offers(this.current)) {
      const first = this.panels.find((panel) => panel.id === this.chosen && this.offers(panel)) ?? this.panels.find((panel) => this.offers(panel));
      if (first) this.open(first.id, false);
    } else if (this.chosen !== this.current.id) {
      const wanted = this.panels.find((panel) => panel.id === this.chosen);
      if (wanted && this.offers(wanted)) this.open(wanted.id, false);
    }
    for (const panel of this.panels) {
      const tab = this.tab(panel);
      if (!tab) continue;
      tab.hidden = !this.offers(panel);
      const badge = panel.badge?.() ?? null;
      const mark = tab.lastElementChild as HTMLElement;
      mark.hidden = badge === null;
      mark.className = `badge ${badge?.level ?? ''}`;
      say(mark, badge?.text ?? '');
      tab.title = badge?.title ?? '';
    }
    this.fade();
  }

  has(id: string): boolean {
    return this.panels.some((panel) => panel.id === id);
  }

  open(id: string, keep = true): void {
    const panel = this.panels.find((one) => one.id === id);
    if (!panel) return;
    if (keep) {
      this.chosen = id;
      set('tabs', { ...settings.tabs, [this.name]: id });
    }
    if (panel === this.current) return;
    const before = this.current;
    before?.hidden?.();
    this.current = panel;
    if (before) this.tab(before)!.hidden = !this.offers(before);
    for (const tab of this.tabs.children) {
      const on = tab.id === `tab-${id}`;
      tab.setAttribute('aria-selected', String(on));
      (tab as HTMLElement).tabIndex = on ? 0 : -1;
      if (on) (tab as HTMLElement).hidden = false;
      if (on) tab.scrollIntoView({ block: 'nearest', inline: 'center' });
    }
    this.body.replaceChildren(panel.element);
    panel.shown?.();
    panel.update?.();
    this.fade();
  }

  clear(): void {
    this.current?.hidden?.();
    this.current = null;
    this.panels = [];
    this.showList(false);
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

  // A panel that was opened on purpose stays, also where it does not apply.
  private offers(panel: Panel): boolean {
    if (panel.excluded?.()) return false;
    return (panel.applies?.() ?? true) || (panel === this.current && panel.id === this.chosen);
  }

  private tab(panel: Panel): HTMLElement | null {
    return this.tabs.children[this.panels.indexOf(panel)] as HTMLElement ?? null;
  }

  // Tabs that do not fit are faded at the edge and reached by the list.
  private fade(): void {
    const { scrollLeft, scrollWidth, clientWidth } = this.tabs;
    const before = scrollLeft > 1, after = scrollLeft + clientWidth < scrollWidth - 1;
    this.tabs.classList.toggle('more-before', before);
    this.tabs.classList.toggle('more-after', after);
    if (scrollWidth > clientWidth + 1) this.more.hidden = false;
    else if (!this.more.hidden && scrollWidth + this.more.offsetWidth <= this.tabs.parentElement!.clientWidth) this.more.hidden = true;
    if (this.more.hidden) this.showList(false);
  }

  private showList(on: boolean): void {
    if (on === !this.list.hidden) return;
    this.list.hidden = !on;
    this.more.setAttribute('aria-expanded', String(on));
    this.endList();
    this.endList = on ? closedByEscape(() => this.showList(false)) : () => {};
    if (!on) return;
    fill(this.list, this.panels.filter((panel) => this.offers(panel)).map((panel) => {
      const badge = panel.badge?.() ?? null;
      return h('button', { type: 'button', role: 'menuitem', class: panel === this.current ? 'on' : '', onclick: () => {
        this.showList(false);
        this.open(panel.id);
        this.tab(panel)?.focus();
      } }, panel.title, badge ? h('span', { class: `badge ${badge.level}` }, badge.text) : null);
    }));
    (this.list.querySelector('.on') as HTMLElement | null ?? this.list.firstElementChild as HTMLElement | null)?.focus();
  }
}
