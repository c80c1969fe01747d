import assert from 'node:assert/strict';
import { test } from 'node:test';
import * as THREE from 'three';
import { partOf } from '../src/scene/looks';
import { attenuationOf, daylight } from '../src/scene/surroundings';
import { coverage, surfaceOf } from '../src/scene/terrain';

const TERRAIN = { columns: 3, rows: 2, size_x: 4, size_y: 2, heights: new Float32Array([0, 1, 2, 3, 4, 5]) };

test('points of a terrain are centred, and cells are divided from the least x and y to the greatest', () => {
  const { positions, uv, indices } = surfaceOf(TERRAIN);
  assert.deepEqual([...positions.slice(0, 3)], [-2, -1, 0]);
  assert.deepEqual([...positions.slice(15, 18)], [2, 1, 5]);
  assert.deepEqual([...uv.slice(10, 12)], [1, 1]);
  assert.deepEqual([...indices.slice(0, 6)], [0, 1, 4, 0, 4, 3]);
  assert.equal(indices.length, 12);
});

test('a texture begins at its height and is alone after its distance', () => {
  const { positions } = surfaceOf(TERRAIN);
  assert.deepEqual([...coverage(positions, 1, 2)], [0, 0, 0.5, 1, 1, 1]);
  assert.deepEqual([...coverage(positions, 3, 0)], [0, 0, 0, 1, 1, 1]);
});

test('light falls as in SDF at half the range', () => {
  const light = { range: 8, attenuation_constant: 0.5, attenuation_linear: 0.1, attenuation_quadratic: 0.01 };
  const { decay, factor } = attenuationOf(light);
  assert.equal(decay, 2);
  assert.ok(Math.abs(factor / 4 ** decay - 1 / (0.5 + 0.4 + 0.16)) < 1e-12);
  assert.equal(attenuationOf({ ...light, attenuation_quadratic: 0, attenuation_linear: 0 }).decay, 0);
});

test('the day begins at sunrise and ends at sunset', () => {
  assert.deepEqual([0, 6, 12, 20, 23].map((time) => daylight(time, 6, 20)), [0, 0.5, 1, 0.5, 0]);
});

test('a part of a mesh keeps its place, or is centred', () => {
  const whole = new THREE.Group(), arm = new THREE.Group();
  const part = new THREE.Mesh(new THREE.BoxGeometry(1, 1, 1).translate(3, 0, 0));
  part.name = 'Part';
  arm.position.set(0, 2, 0);
  whole.add(arm);
  arm.add(part);
  const middle = (made: THREE.Object3D | null): number[] => new THREE.Box3().setFromObject(made!).getCenter(new THREE.Vector3()).toArray();
  assert.deepEqual(middle(partOf(whole, 'file:///a.dae#Part')), [3, 2, 0]);
  assert.deepEqual(middle(partOf(whole, 'file:///a.dae#Part&center')), [0, 0, 0]);
  assert.equal(partOf(whole, 'file:///a.dae#Other'), null);
});
