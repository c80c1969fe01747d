// How far two curves are apart.
export interface Residual {
  largest: number; // with its sign
  time: number; // of the largest, s
  rms: number;
  count: number; // samples that both recordings have
}

export function residualOf(times: ArrayLike<number>, differences: ArrayLike<number>): Residual {
  let largest = NaN,
    time = NaN,
    sum = 0,
    count = 0;
  for (let i = 0; i < times.length; i += 1) {
    const value = differences[i]!;
    if (!Number.isFinite(value)) continue;
    count += 1;
    sum += value * value;
    if (!(Math.abs(value) <= Math.abs(largest))) [largest, time] = [value, times[i]!];
  }
  return { largest, time, rms: count > 0 ? Math.sqrt(sum / count) : NaN, count };
}
