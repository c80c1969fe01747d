// Parameters of the twin's nodes: their current values, and the values of texts that a user types.
import type { Parameter, ParameterValue } from '@foxglove/ws-protocol';
import type { Client } from '../protocol/client';
import type { Message } from '../protocol/cdr';
import { Signal } from './signal';

export type Kind = 'bool' | 'int' | 'double' | 'string' | 'bool[]' | 'int[]' | 'double[]' | 'string[]' | 'not set';

export interface Descriptor {
  description: string;
  constraints: string;
  readOnly: boolean;
  from: number; // of a range; -Infinity, Infinity without
  to: number;
  kind: Kind | null; // null: the node does not report it
}

const KINDS: Record<number, Kind> = { 1: 'bool', 2: 'int', 3: 'double', 4: 'string', 6: 'bool[]', 7: 'int[]', 8: 'double[]', 9: 'string[]' }; // rcl_interfaces/ParameterType

export function splitName(full: string): { node: string; name: string } {
  const dot = full.indexOf('.');
  return dot < 0 ? { node: '', name: full } : { node: full.slice(0, dot), name: full.slice(dot + 1) };
}

export function kindOf({ value, type }: Parameter): Kind {
  if (value === undefined || value === null) return 'not set';
  if (Array.isArray(value)) {
    if (type === 'float64_array') return 'double[]';
    if (value.length === 0 || typeof value[0] === 'string') return 'string[]';
    return typeof value[0] === 'boolean' ? 'bool[]' : value.every((v) => Number.isInteger(v)) ? 'int[]' : 'double[]';
  }
  if (typeof value === 'number') return type === 'float64' || !Number.isInteger(value) ? 'double' : 'int';
  return typeof value === 'boolean' ? 'bool' : 'string';
}

export function textOf(value: ParameterValue | undefined): string {
  if (value === undefined || value === null) return '';
  return Array.isArray(value) ? value.map((v) => (typeof v === 'string' ? JSON.stringify(v) : String(v))).join(', ') : String(value);
}

function number(text: string, whole: boolean): number {
  const value = Number(text.trim().replace(/^([-+]?\d+),(\d+)$/, '$1.$2'));
  if (text.trim() === '' || Number.isNaN(value)) throw new Error(`'${text.trim()}' is not a number`);
  if (whole && !Number.isSafeInteger(value)) throw new Error(`${text.trim()} is not an integer`);
  return value;
}

function truth(text: string): boolean {
  if (!/^(true|false)$/.test(text.trim())) throw new Error("enter 'true' or 'false'");
  return text.trim() === 'true';
}

// Elements between commas, optionally with brackets around the list and quotes around each.
export function elements(text: string): string[] {
  const inner = text.trim().replace(/^\[([\s\S]*)\]$/, '$1');
  return [...inner.matchAll(/\s*(?:"((?:[^"\\]|\\.)*)"|'([^']*)'|([^,\s][^,]*))\s*(?:,|$)/g)].map((m) => m[1]?.replace(/\\(.)/g, '$1') ?? m[2] ?? m[3]!.trim());
}

// Throws an error that describes what is wrong with the text.
export function valueFrom(text: string, kind: Kind): { value: ParameterValue; type?: Parameter['type'] } {
  switch (kind) {
    case 'bool': return { value: truth(text) };
    case 'int': return { value: number(text, true) };
    case 'double': return { value: number(text, false), type: 'float64' };
    case 'bool[]': return { value: elements(text).map(truth) };
    case 'int[]': return { value: elements(text).map((one) => number(one, true)) };
    case 'double[]': return { value: elements(text).map((one) => number(one, false)), type: 'float64_array' };
    case 'string[]': return { value: elements(text) };
    default: return { value: text };
  }
}

export class Parameters {
  readonly values = new Map<string, Parameter>(); // by "/node.parameter"
  readonly changed = new Signal<string[]>(); // names
  private readonly descriptors = new Map<string, Promise<Map<string, Descriptor>>>();
  private watchers = 0;

  constructor(private readonly client: Client) {
    client.onparameters = (values) => {
      for (const one of values) {
        if (one.value === undefined) this.values.delete(one.name);
        else this.values.set(one.name, one);
      }
      this.changed.emit(values.map((one) => one.name));
    };
  }

  // Keeps the values up to date until the returned function is called.
  watch(): () => void {
    this.watchers += 1;
    this.client.watchParameters(true);
    this.ask();
    return () => {
      this.watchers -= 1;
      if (this.watchers === 0) this.client.watchParameters(false);
    };
  }

  // After a restart, or when nodes have been added or removed.
  refresh(): void {
    this.values.clear();
    this.descriptors.clear();
    if (this.watchers > 0) this.ask();
  }

  private ask(): void {
    this.client.getParameters().catch(() => {}); // without a connection; requested again with the next one
  }

  number(name: string): number {
    const value = this.values.get(name)?.value;
    return typeof value === 'number' ? value : NaN;
  }

  async set(name: string, text: string, kind: Kind): Promise<void> {
    await this.client.setParameter({ name, ...valueFrom(text, kind) });
  }

  describe(node: string): Promise<Map<string, Descriptor>> {
    let known = this.descriptors.get(node);
    if (!known) {
      known = this.askDescriptors(node).catch(() => new Map<string, Descriptor>());
      this.descriptors.set(node, known);
    }
    return known;
  }

  private async askDescriptors(node: string): Promise<Map<string, Descriptor>> {
    const names = [...this.values.keys()].map(splitName).filter((one) => one.node === node).map((one) => one.name);
    const answer = await this.client.call(`${node}/describe_parameters`, { names });
    const out = new Map<string, Descriptor>();
    for (const raw of answer['descriptors'] as Message[]) {
      const range = ([...(raw['floating_point_range'] as Message[]), ...(raw['integer_range'] as Message[])])[0];
      out.set(String(raw['name']), {
        description: String(raw['description'] ?? ''), constraints: String(raw['additional_constraints'] ?? ''), readOnly: raw['read_only'] === true,
        from: range ? Number(range['from_value']) : -Infinity, to: range ? Number(range['to_value']) : Infinity, kind: KINDS[Number(raw['type'])] ?? null,
      });
    }
    return out;
  }
}
