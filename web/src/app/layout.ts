// The layout: the picture, a dock at the right, one below; on narrow screens one dock below the picture.
import type { Panel } from './app';
import { button, h } from './dom';
import { setIcon } from './icons';
import { Dock } from './dock';
import { narrow } from './narrow';
import { set, settings } from './settings';

const MIN_SHARE = 0.15, MAX_SHARE = 0.8; // of the height, for the picture of a narrow window

export class Layout {
  readonly stage = h('section', { class: 'stage', 'aria-label': 'Picture' });
  private readonly fold = button('', 'Fold the lower panels', () => this.setBottom(!settings.bottomOpen), { class: 'icon fold', id: 'fold' });
  private readonly right = new Dock('right', 'Panels');
  private readonly bottom = new Dock('bottom', 'Plots and messages', [this.fold]);
  private readonly work: HTMLElement;
  private readonly rightPanels: Panel[] = [];
  private readonly bottomPanels: Panel[] = [];

  constructor(bar: HTMLElement) {
    this.work = h('main', { class: 'work' }, this.stage, this.splitter('v'), this.right.element, this.splitter('h'), this.bottom.element);
    this.sizes();
    this.setBottom(settings.bottomOpen);
    document.getElementById('app')!.replaceChildren(bar, this.work);
  }

  mount(right: Panel[], bottom: Panel[]): void {
    this.rightPanels.push(...right);
    this.bottomPanels.push(...bottom);
    const media = narrow();
    const arrange = (): void => {
      this.right.clear();
      this.bottom.clear();
      document.body.classList.toggle('narrow', media.matches);
      if (media.matches) {
        this.right.setPanels([...this.rightPanels, ...this.bottomPanels]);
      } else {
        this.right.setPanels(this.rightPanels);
        this.bottom.setPanels(this.bottomPanels);
      }
    };
    media.addEventListener('change', arrange);
    arrange();
  }

  tick(dt: number): void {
    this.right.tick(dt);
    if (settings.bottomOpen) this.bottom.tick(dt);
  }

  // The tabs that apply to the twin may have changed.
  refresh(): void {
    this.right.refresh();
    this.bottom.refresh();
  }

  open(id: string): void {
    if (this.right.has(id)) this.right.open(id);
    else {
      this.setBottom(true);
      this.bottom.open(id);
    }
  }

  private setBottom(open: boolean): void {
    set('bottomOpen', open);
    this.work.classList.toggle('folded', !open);
    setIcon(this.fold, open ? 'down' : 'up');
    this.fold.title = open ? 'Fold the lower panels' : 'Show the lower panels';
    this.fold.setAttribute('aria-expanded', String(open));
  }

  private sizes(): void {
    this.work.style.setProperty('--right', `${settings.rightWidth}px`);
    this.work.style.setProperty('--bottom', `${settings.bottomHeight}px`);
    this.work.style.setProperty('--share', `${(settings.pictureShare * 100).toFixed(1)}%`);
  }

  private splitter(kind: 'v' | 'h'): HTMLElement {
    const change = (by: number): void => {
      if (kind === 'v') set('rightWidth', Math.min(innerWidth * 0.6, Math.max(280, settings.rightWidth - by)));
      else if (narrow().matches) set('pictureShare', Math.min(MAX_SHARE, Math.max(MIN_SHARE, settings.pictureShare + by / this.work.clientHeight)));
      else set('bottomHeight', Math.min(innerHeight * 0.6, Math.max(120, settings.bottomHeight - by)));
      this.sizes();
    };
    const bar = h('div', {
      class: `splitter ${kind}`, role: 'separator', tabIndex: 0, 'aria-orientation': kind === 'v' ? 'vertical' : 'horizontal',
      'aria-label': kind === 'v' ? 'Width of the panels' : 'Height of the panels below',
      onkeydown: (event: KeyboardEvent) => {
        const step = { ArrowLeft: -16, ArrowUp: -16, ArrowRight: 16, ArrowDown: 16 }[event.key];
        if (step === undefined) return;
        event.preventDefault();
        change(step);
      },
    });
    bar.addEventListener('pointerdown', (event) => {
      bar.setPointerCapture(event.pointerId);
      let last = kind === 'v' ? event.clientX : event.clientY;
      const move = (e: PointerEvent): void => {
        const at = kind === 'v' ? e.clientX : e.clientY;
        change(at - last);
        last = at;
      };
      bar.addEventListener('pointermove', move);
      bar.addEventListener('lostpointercapture', () => bar.removeEventListener('pointermove', move), { once: true });
    });
    return bar;
  }
}
