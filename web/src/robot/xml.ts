// A small XML reader, sufficient for URDF: no DTDs, no namespaces.

export interface Element {
  name: string;
  attributes: Record<string, string>;
  children: Element[];
  text: string;
  line: number;
}

export class XmlError extends Error {}

const ENTITIES: Record<string, string> = { lt: '<', gt: '>', amp: '&', quot: '"', apos: "'" };

function plain(text: string): string {
  return text.replace(/&(#x[0-9a-fA-F]+|#\d+|\w+);/g, (whole, name: string) => {
    if (name.startsWith('#x')) return String.fromCodePoint(parseInt(name.slice(2), 16));
    if (name.startsWith('#')) return String.fromCodePoint(parseInt(name.slice(1), 10));
    return ENTITIES[name] ?? whole;
  });
}

const TOKEN = /<!--[\s\S]*?-->|<!\[CDATA\[([\s\S]*?)\]\]>|<\?[\s\S]*?\?>|<![^>]*>|<\/\s*([^\s>]+)\s*>|<([^\s/>]+)((?:[^>"']|"[^"]*"|'[^']*')*?)(\/?)>|([^<]+)/g;
const ATTRIBUTE = /([^\s=]+)\s*=\s*(?:"([^"]*)"|'([^']*)')/g;

export function parseXml(source: string): Element {
  const root: Element = { name: '', attributes: {}, children: [], text: '', line: 1 };
  const open: Element[] = [root];
  let line = 1;
  let seen = 0;
  TOKEN.lastIndex = 0;
  for (let match = TOKEN.exec(source); match; match = TOKEN.exec(source)) {
    for (; seen < match.index; seen += 1) if (source.charCodeAt(seen) === 10) line += 1;
    const top = open[open.length - 1]!;
    if (match[2] !== undefined) {
      if (open.length < 2 || top.name !== match[2]) throw new XmlError(`line ${line}: </${match[2]}> closes nothing`);
      open.pop();
    } else if (match[3] !== undefined) {
      const element: Element = { name: match[3], attributes: {}, children: [], text: '', line };
      for (const attribute of (match[4] ?? '').matchAll(ATTRIBUTE)) {
        element.attributes[attribute[1]!] = plain(attribute[2] ?? attribute[3] ?? '');
      }
      top.children.push(element);
      if (match[5] !== '/') open.push(element);
    } else if (match[1] !== undefined) {
      top.text += match[1];
    } else if (match[6] !== undefined) {
      top.text += plain(match[6]);
    }
  }
  if (open.length !== 1) throw new XmlError(`<${open[open.length - 1]!.name}> is never closed`);
  const first = root.children[0];
  if (!first) throw new XmlError('the file contains no element');
  return first;
}

export function child(element: Element, name: string): Element | undefined {
  return element.children.find((one) => one.name === name);
}

export function childrenOf(element: Element, name: string): Element[] {
  return element.children.filter((one) => one.name === name);
}

export function numbers(text: string | undefined, otherwise: number[]): number[] {
  if (text === undefined) return otherwise;
  const out = text.trim().split(/\s+/).map(Number);
  return out.length === otherwise.length && out.every((n) => Number.isFinite(n)) ? out : otherwise;
}
