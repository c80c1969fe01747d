// Phones: a narrow or a low window has one dock, list and detail as two pages, and larger controls. The styles use the same
// condition.
export const NARROW = matchMedia('(max-width: 820px), (max-height: 500px)');

// On phones a panel of a list and the detail of its choice shows one of them.
export function showPage(panel: HTMLElement, page: 'list' | 'detail'): void {
  panel.dataset['page'] = page;
}
