// An event with listeners.
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

// A value with listeners: a new listener is called with the last value, after the code that subscribes has finished.
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
