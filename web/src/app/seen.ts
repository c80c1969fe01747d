// Which of many elements are visible, so that only those are filled and updated.
export class Seen<T> {
  private readonly items = new Map<Element, T>();
  private readonly now = new Set<T>();
  private readonly observer: IntersectionObserver;

  constructor(private readonly appeared: (item: T) => void = () => {}) {
    this.observer = new IntersectionObserver((entries) => {
      for (const entry of entries) {
        const item = this.items.get(entry.target);
        if (item === undefined) continue;
        if (!entry.isIntersecting) this.now.delete(item);
        else if (!this.now.has(item)) {
          this.now.add(item);
          this.appeared(item);
        }
      }
    }, { rootMargin: '200px' });
  }

  watch(items: Iterable<[Element, T]>): void {
    this.observer.disconnect();
    this.items.clear();
    this.now.clear();
    for (const [element, item] of items) {
      this.items.set(element, item);
      this.observer.observe(element);
    }
  }

  [Symbol.iterator](): Iterator<T> {
    return this.now.values();
  }
}
