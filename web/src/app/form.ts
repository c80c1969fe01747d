// A form for a message of any type: editors write into the given message.
import { blank, isNumbers, type Message, type Value } from '../protocol/cdr';
import type { Constant, Field, MessageType } from '../protocol/schema';
import { button, fill, h } from './dom';
import { elements } from './parameters';

const RANGES: Record<string, [number, number]> = {
  int8: [-128, 127], uint8: [0, 255], int16: [-32768, 32767], uint16: [0, 65535], int32: [-2147483648, 2147483647], uint32: [0, 4294967295],
};

// The value of the text for a field of that type; throws an error that describes what is wrong.
export function valueOf(text: string, type: string): Value {
  const plain = text.trim();
  if (type === 'string' || type === 'wstring') return text;
  if (type === 'bool') {
    if (!/^(true|false|0|1)$/i.test(plain)) throw new Error("enter 'true' or 'false'");
    return /^(true|1)$/i.test(plain);
  }
  if (type === 'int64' || type === 'uint64') {
    if (!/^[-+]?\d+$/.test(plain)) throw new Error('enter an integer');
    const whole = BigInt(plain);
    if (BigInt[type === 'int64' ? 'asIntN' : 'asUintN'](64, whole) !== whole) throw new Error(`the value is out of range for ${type}`);
    return Number.isSafeInteger(Number(whole)) ? Number(whole) : whole;
  }
  const value = /^[-+]?\.?inf(inity)?$/i.test(plain) ? (plain.startsWith('-') ? -Infinity : Infinity) : /^\.?nan$/i.test(plain) ? NaN : Number(plain.replace(/^([-+]?\d+),(\d+)$/, '$1.$2'));
  if (plain === '' || (Number.isNaN(value) && !/nan$/i.test(plain))) throw new Error('enter a number');
  const range = RANGES[type];
  if (range && !(Number.isInteger(value) && value >= range[0] && value <= range[1])) throw new Error(`enter an integer from ${range[0]} to ${range[1]}`);
  return value;
}

export function listOf(text: string, field: Field): Value[] {
  const list = elements(text).map((one) => valueOf(one, field.type));
  if (field.arrayLength !== undefined && list.length !== field.arrayLength) throw new Error(`expected ${field.arrayLength} elements, not ${list.length}`);
  return list;
}

export function listText(value: Value | undefined): string {
  const list: Value[] = isNumbers(value) ? [...value] : Array.isArray(value) ? value : [];
  return list.map((one) => (typeof one === 'string' ? JSON.stringify(one) : String(one))).join(', ');
}

// Constants that a field may use: those of its type whose names start with the field's name first ("LEVEL_WARN" for
// level).
export function choicesOf(field: Field, constants: Constant[]): Constant[] {
  if (field.isArray || field.message || /^(bool|string|wstring|float)/.test(field.type)) return [];
  const same = constants.filter((one) => one.type === field.type);
  const own = same.filter((one) => one.name.toLowerCase().startsWith(`${field.name}_`));
  return own.length > 0 ? own : same;
}

function textInput(name: string, start: string, take: (text: string) => void, wide = false): HTMLInputElement {
  const input = h('input', { type: 'text', spellcheck: false, value: start, class: wide ? 'wide' : '', 'aria-label': name });
  input.addEventListener('input', () => {
    try {
      take(input.value);
      input.setCustomValidity('');
      input.title = '';
    } catch (problem) {
      input.setCustomValidity((problem as Error).message);
      input.title = (problem as Error).message;
    }
  });
  input.addEventListener('change', () => input.reportValidity());
  return input;
}

function single(field: Field, type: MessageType, value: Message): HTMLElement {
  if (field.type === 'bool') {
    const box = h('input', { type: 'checkbox', checked: value[field.name] === true, onchange: () => (value[field.name] = box.checked) });
    return box;
  }
  const input = textInput(field.name, String(value[field.name]), (text) => (value[field.name] = valueOf(text, field.type)));
  const choices = choicesOf(field, type.constants);
  if (choices.length === 0) return input;
  const select = h('select', { 'aria-label': `Constants for ${field.name}`, onchange: () => {
    if (select.value === '') return;
    input.value = select.value;
    input.dispatchEvent(new Event('input'));
  } }, h('option', { value: '' }, 'constants'), choices.map((one) => h('option', { value: one.value.trim(), selected: Number(one.value) === Number(value[field.name]) }, `${one.name} ${one.value}`)));
  input.addEventListener('input', () => (select.value = choices.some((one) => one.value.trim() === input.value.trim()) ? input.value.trim() : ''));
  return h('span', { class: 'with-constants' }, input, select);
}

// A list of messages: a box for each, with buttons to add and remove them.
function messageList(field: Field, value: Message): HTMLElement {
  const items = h('div', { class: 'form-items' });
  const list = (): Message[] => value[field.name] as Message[];
  const build = (): void => {
    fill(items, list().map((one, i) => h('fieldset', {},
      h('legend', {}, `${field.name}[${i}]`, field.arrayLength === undefined ? button('×', `Remove ${field.name}[${i}]`, () => {
        list().splice(i, 1);
        build();
      }, { class: 'icon small' }) : null),
      formFields(field.message!, one))));
  };
  build();
  return h('div', { class: 'form-list' }, h('div', { class: 'row' }, h('span', {}, field.name, h('small', { class: 'muted' }, ` ${field.type}[]`)), h('span', { class: 'spacer' }),
    field.arrayLength === undefined ? button('Add', `Add an element to ${field.name}`, () => {
      list().push(blank(field.message!));
      build();
    }) : null), items);
}

export function formFields(type: MessageType, value: Message): HTMLElement[] {
  if (type.fields.length === 0) return [h('p', { class: 'muted' }, 'It has no fields.')];
  return type.fields.map((field) => {
    if (field.message && field.isArray) return messageList(field, value);
    if (field.message) {
      const nested = h('details', { class: 'form-nested', open: !/^(header|stamp|layout)$/.test(field.name) }, h('summary', {}, field.name, h('small', { class: 'muted' }, ` ${field.type}`)));
      nested.append(...formFields(field.message, value[field.name] as Message));
      return nested;
    }
    const title = h('span', {}, field.name, h('small', { class: 'muted' }, ` ${field.type}${field.isArray ? `[${field.arrayLength ?? ''}]` : ''}`));
    if (!field.isArray) return h('label', {}, title, single(field, type, value));
    return h('label', {}, title, textInput(field.name, listText(value[field.name]), (text) => (value[field.name] = listOf(text, field)), true));
  });
}

// The elements of a form whose values cannot be sent.
export function invalid(form: HTMLElement): HTMLInputElement | null {
  return [...form.querySelectorAll('input')].find((one) => !one.checkValidity()) ?? null;
}
