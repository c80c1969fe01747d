// The legend over the picture: the meaning of its colours, arrows and lines.
import { gradient } from '../app/colour_map';
import { h, say } from '../app/dom';

export interface LegendEntry {
  key: 'colours' | 'arrow' | 'line';
  colour?: string; // of an arrow or a line, CSS
  label: string;
  value: string; // of the whole key: "0 … 5 m"
}

export function cssColour(colour: number): string {
  return `#${colour.toString(16).padStart(6, '0')}`;
}

// The value of a scale's end; NaN: nothing has been received.
export function endText(most: number, unit: string): string {
  return Number.isFinite(most) ? `${+most.toPrecision(3)}${unit ? ` ${unit}` : ''}` : 'no data yet';
}

export class Legend {
  readonly element = h('div', { class: 'stage-legend', role: 'group', 'aria-label': 'Legend', hidden: true });
  private readonly rows = new Map<string, { element: HTMLElement; label: HTMLElement; value: HTMLElement }>();

  // null: nothing of that name is drawn.
  show(name: string, entry: LegendEntry | null): void {
    let row = this.rows.get(name);
    if (!entry) {
      row?.element.remove();
      this.rows.delete(name);
    } else {
      if (!row) {
        row = { element: h('div', { class: 'legend-row' }), label: h('span', {}), value: h('span', { class: 'num' }) };
        row.element.append(h('i', { class: `legend-key ${entry.key}`, style: `--key: ${entry.key === 'colours' ? gradient() : entry.colour}` }), row.label, row.value);
        this.rows.set(name, row);
        this.element.append(row.element);
      }
      say(row.label, entry.label);
      say(row.value, entry.value);
    }
    this.element.hidden = this.rows.size === 0;
  }
}
