import assert from 'node:assert/strict';
import { test } from 'node:test';
import { creasedNormals } from '../src/robot/normals';

const close = (a: ArrayLike<number>, b: number[]): void => b.forEach((v, i) => assert.ok(Math.abs(a[i]! - v) < 1e-5, `${[...Array.from(a)]} against ${b}`));

test('a sharp edge stays sharp, a flat one is smoothed; millimetres as well as metres', () => {
  for (const scale of [1e-3, 1, 1000]) {
    const right = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1], (v) => v * scale);
    const sharp = creasedNormals(right, 0.6);
    close(sharp.subarray(0, 3), [0, 0, 1]);
    close(sharp.subarray(9, 12), [1, 0, 0]);
  }
  const s = Math.sin(0.2), c = Math.cos(0.2);
  const bent = Float32Array.from([-1, 0, 0, 0, -1, 0, 0, 1, 0, c, 0, s, 0, 1, -0, -0, -1, 0]);
  const smooth = creasedNormals(bent, 0.6);
  const first = smooth.subarray(3, 6), second = smooth.subarray(15, 18);
  close(first, Array.from(second));
  assert.ok(first[0]! < -0.05 && first[2]! > 0.9);
});

test('triangles without area have no say, and give no NaN', () => {
  const normals = creasedNormals(Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]), 0.6);
  assert.ok(normals.every(Number.isFinite));
  close(normals.subarray(0, 3), [0, 0, 1]);
});
