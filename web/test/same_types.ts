// Compares the page's parser of schemas with the Foxglove one, which reads times as its own primitives.
import type { MessageDefinition } from '@foxglove/message-definition';
import assert from 'node:assert/strict';
import { parseSchema, shortName } from '../src/protocol/schema';

const TIMES: Record<string, string> = { 'builtin_interfaces/Time': 'time', 'builtin_interfaces/Duration': 'duration' };

export function sameTypes(name: string, schema: string, theirs: MessageDefinition[]): void {
  const types = parseSchema(name, schema);
  for (const { name: within = name, definitions } of theirs) {
    const ours = types.get(shortName(within))!;
    assert.deepEqual(
      ours.fields.map((one) => [one.name, TIMES[shortName(one.type)] ?? one.type, one.isComplex && !TIMES[shortName(one.type)], one.isArray, one.arrayLength, one.defaultValue]),
      definitions.filter((one) => !one.isConstant).map((one) => [one.name, one.type, one.isComplex, one.isArray, one.arrayLength, one.defaultValue]), within);
    assert.deepEqual(ours.constants.map((one) => [one.name, one.type, one.value.trim()]),
      definitions.filter((one) => one.isConstant).map((one) => [one.name, one.type, one.valueText]), within);
  }
}
