// Colours of curves in plots: Okabe and Ito's, which are distinguishable with colour blindness; after eight the dashes change.
const LIGHT = ['#0072b2', '#d55e00', '#009e73', '#cc79a7', '#b8860b', '#56b4e9', '#5d4a9c', '#444444'];
const DARK = ['#56b4e9', '#f0814a', '#35c296', '#e39cc8', '#f0d25a', '#8fd0ff', '#b3a3ee', '#d0d0d0'];

// Those of the present theme.
export function curveColours(): string[] {
  return document.documentElement.dataset['theme'] === 'dark' ? DARK : LIGHT;
}
