// Something that others can listen to.
export class Signal<T = void> {
  private readonly listeners = new Set<(value: T) => void>();

  on(listener: (value: T) => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  emit(value: T): void {
    for (const listener of this.listeners) listener(value);
  }
}

// Something that others can listen to and that stands: who comes later is told the last value, once the code that
// subscribes has run to its end.
export class Standing<T> extends Signal<T> {
  private last: { value: T } | null = null;

  override on(listener: (value: T) => void): () => void {
    const end = super.on(listener);
    let ended = false;
    const { last } = this;
    if (last) queueMicrotask(() => !ended && this.last === last && listener(last.value));
    return () => {
      ended = true;
      end();
    };
  }

  override emit(value: T): void {
    this.last = { value };
    super.emit(value);
  }
}
