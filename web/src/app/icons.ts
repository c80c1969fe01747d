// Icons as paths, so that no font is needed.
const PATHS: Record<string, string> = {
  play: 'M4 2.5v11l9-5.5z',
  pause: 'M4 2.5h3v11H4zM9 2.5h3v11H9z',
  step: 'M3 2.5v11l7-5.5zM11 2.5h2v11h-2z',
  reset: 'M13 2.5v11l-7-5.5zM3 2.5h2v11H3z',
  theme: 'M8 1.5a6.5 6.5 0 1 0 0 13zM8 1.5a6.5 6.5 0 0 1 0 13v-1.4a5.1 5.1 0 0 0 0-10.2z',
  settings: 'M2 3.3h5.1a2 2 0 0 1 3.8 0H14v1.4h-3.1a2 2 0 0 1-3.8 0H2zM2 7.3h1.1a2 2 0 0 1 3.8 0H14v1.4H6.9a2 2 0 0 1-3.8 0H2zM2 11.3h6.1a2 2 0 0 1 3.8 0H14v1.4h-2.1a2 2 0 0 1-3.8 0H2z',
  close: 'M3.3 2.3 8 7l4.7-4.7 1 1L9 8l4.7 4.7-1 1L8 9l-4.7 4.7-1-1L7 8 2.3 3.3z',
  down: 'M3 5.5h10l-5 6z',
  up: 'M3 10.5h10l-5-6z',
  loop: 'M4 3.3h6.5a3.5 3.5 0 0 1 3.5 3.5v1h-1.5v-1a2 2 0 0 0-2-2H4v2.4L.8 4 4 .8zM12 12.7H5.5A3.5 3.5 0 0 1 2 9.2v-1h1.5v1a2 2 0 0 0 2 2H12V8.8l3.2 3.2-3.2 3.2z',
};

export function icon(name: string): SVGSVGElement {
  const svg = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  svg.setAttribute('viewBox', '0 0 16 16');
  svg.setAttribute('width', '14');
  svg.setAttribute('height', '14');
  svg.setAttribute('aria-hidden', 'true');
  const path = document.createElementNS('http://www.w3.org/2000/svg', 'path');
  path.setAttribute('d', PATHS[name] ?? '');
  path.setAttribute('fill', 'currentColor');
  svg.appendChild(path);
  svg.dataset['icon'] = name;
  return svg;
}

export function setIcon(button: HTMLElement, name: string): void {
  if ((button.firstElementChild as SVGElement | null)?.dataset['icon'] !== name) button.replaceChildren(icon(name));
}
