import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Standing } from '../src/app/signal';
import { judgeLoad, readLoads, readStatus } from '../src/app/status';

test('who comes late to what stands is notified once, after the code that subscribes; who left is not', async () => {
  const signal = new Standing<number>();
  const heard: string[] = [];
  signal.on((v) => heard.push(`early ${v}`));
  signal.emit(1);
  signal.on((v) => heard.push(`late ${v}`));
  const end = signal.on(() => heard.push('gone'));
  end();
  assert.deepEqual(heard, ['early 1']);
  await Promise.resolve();
  assert.deepEqual(heard, ['early 1', 'late 1']);
  signal.on((v) => heard.push(`last ${v}`));
  signal.emit(2); // arrives before the one that was published late, which is outdated now
  await Promise.resolve();
  assert.deepEqual(heard.slice(2), ['early 2', 'late 2', 'last 2']);
});

test('a status is read; what a server does not tell is not a number', () => {
  const status = readStatus({ sim_time: 2, paused: true, speed: 0.5, real_time_factor: 0.4, time_physics: 300 });
  assert.equal(status.paused, true);
  assert.equal(status.times.physics, 300);
  assert.ok(Number.isNaN(status.times.idle));
});

test('friction makes the sag a range, and a joint on its limit takes nothing of its drive', () => {
  const message = { joint_names: ['a', 'b'], efforts: [1, 0], gravity_torques: [1, 3], sags: [0.01, 0], margins: [4, 5], effort_limits: [5, 5], least_sags: [0.004, 0], most_sags: [0.016, 0] };
  const loads = readLoads(message);
  assert.ok(Math.abs(loads[0]!.play - 0.006) < 1e-12);
  assert.deepEqual([loads[1]!.play, judgeLoad(loads[1]!).share], [0, 0]);
});

test('a load is judged by what gravity takes of the limit', () => {
  const message = { joint_names: ['a', 'b', 'c', 'd'], efforts: [1, 1, 1, 1], gravity_torques: [1, -4.5, 6, 1], sags: [0, 0, 0, 0], margins: [4, 0.5, -1, Infinity], effort_limits: [5, 5, 5, Infinity] };
  assert.deepEqual(readLoads(message).map((load) => judgeLoad(load).word), ['ample', 'tight', 'too much', 'free']);
  assert.deepEqual(readLoads(message).map((load) => +judgeLoad(load).share.toFixed(2)), [0.2, 0.9, 1.2, 0]);
});
