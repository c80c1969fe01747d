import { settings } from './settings';
import type { TreeJoint } from '../robot/tree';

const DEG = 180 / Math.PI;

export function isAngle(joint: TreeJoint): boolean {
  return joint.kind !== 'prismatic';
}
export function unitOf(joint: TreeJoint): string {
  return isAngle(joint) ? (settings.degrees ? '°' : 'rad') : 'mm';
}
export function shown(joint: TreeJoint, value: number): number {
  return isAngle(joint) ? (settings.degrees ? value * DEG : value) : value * 1000;
}
export function meant(joint: TreeJoint, value: number): number {
  return isAngle(joint) ? (settings.degrees ? value / DEG : value) : value / 1000;
}
export function digitsOf(joint: TreeJoint): number {
  return isAngle(joint) && !settings.degrees ? 3 : 1;
}
// Without a minus sign for zero.
export function fixed(value: number, digits: number): string {
  return Number.isFinite(value) ? value.toFixed(digits).replace(/^-(0\.?0*)$/, '$1') : '–';
}
export function format(joint: TreeJoint, value: number): string {
  return fixed(shown(joint, value), digitsOf(joint));
}
export function millimetres(metres: number): string {
  return fixed(metres * 1000, 1);
}
// The range of a slider: a joint without limits gets a turn to each side.
export function rangeOf(joint: TreeJoint): [number, number] {
  if (Number.isFinite(joint.lower) && Number.isFinite(joint.upper) && joint.upper > joint.lower) return [joint.lower, joint.upper];
  return isAngle(joint) ? [-Math.PI, Math.PI] : [-1, 1];
}
export function seconds(value: number): string {
  if (!Number.isFinite(value)) return '–';
  if (value < 600) return `${value.toFixed(2)} s`;
  const whole = Math.floor(value);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, '0')} min`;
}
