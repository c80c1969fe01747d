// Colours of distances and other scalars, and scales whose ends do not flicker.

// The turbo map as a polynomial of degree 5. Source: A. Mikhailov, R. Du, "Turbo, an improved rainbow colormap", 2019.
const RED = [0.13572138, 4.6153926, -42.66032258, 132.13108234, -152.94239396, 59.28637943];
const GREEN = [0.09140261, 2.19418839, 4.84296658, -14.18503333, 4.27729857, 2.82956604];
const BLUE = [0.1066733, 12.64194608, -60.58204836, 110.36276771, -89.90310912, 27.34824973];

// 0 to 1 each, sRGB, of a value from 0 to 1.
export function turbo(value: number): [number, number, number] {
  const of = (c: number[]): number => Math.min(1, Math.max(0, c.reduceRight((sum, one) => sum * value + one, 0)));
  return [of(RED), of(GREEN), of(BLUE)];
}

export const COLOURS = 256;
const MARGIN = 0.06; // of either end, which is too dark before a dark background

// Red, green and blue of each of COLOURS steps, 0 to 255, sRGB.
export const COLOUR_MAP = Uint8Array.from({ length: COLOURS * 3 }, (_, i) => {
  const share = MARGIN + (1 - 2 * MARGIN) * Math.floor(i / 3) / (COLOURS - 1);
  return Math.round(turbo(share)[i % 3]! * 255);
});

// The step of a value on a scale from 0 to `most`.
export function colourStep(value: number, most: number): number {
  const step = most > 0 ? (value / most) * (COLOURS - 1) : 0;
  return step <= 0 ? 0 : step >= COLOURS - 1 ? COLOURS - 1 : Math.round(step);
}

export function gradient(): string {
  const stops = [0, 1, 2, 3, 4, 5, 6, 7, 8].map((i) => Math.round((i / 8) * (COLOURS - 1)) * 3);
  return `linear-gradient(90deg, ${stops.map((o) => `rgb(${COLOUR_MAP[o]}, ${COLOUR_MAP[o + 1]}, ${COLOUR_MAP[o + 2]})`).join(', ')})`;
}

// The least of 1, 2, 5 x 10^n that is not below the value.
export function roundAbove(value: number): number {
  if (!(value > 0) || !Number.isFinite(value)) return 0;
  const power = 10 ** Math.floor(Math.log10(value));
  for (const factor of [1, 2, 5]) if (value <= factor * power * (1 + 1e-9)) return factor * power;
  return 10 * power;
}

const HOLD_TIME = 3000; // ms for which smaller values must last before a scale shrinks

// The upper end of a scale from 0: it grows at once and shrinks late, so that colours and arrows keep their meaning.
export class SteadyScale {
  most = NaN; // before the first value
  private needed = 0; // ms, when this end was last needed

  take(value: number, now = performance.now()): number {
    const end = roundAbove(value);
    if (!(end < this.most) || now - this.needed > HOLD_TIME) {
      this.most = end;
      this.needed = now;
    }
    return this.most;
  }
}
