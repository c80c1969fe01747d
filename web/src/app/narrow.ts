// Phones: a narrow or a low window has one dock, list and detail as two pages, and larger controls. The styles use the same
// condition.
let query: MediaQueryList | null = null;

export function narrow(): MediaQueryList {
  query ??= matchMedia('(max-width: 820px), (max-height: 500px)');
  return query;
}

// On phones a panel of a list and the detail of its choice shows one of them.
export function showPage(panel: HTMLElement, page: 'list' | 'detail'): void {
  panel.dataset['page'] = page;
}
