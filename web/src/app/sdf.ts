// An object that the page adds to the world, as SDF: a model of one link.

export type ObjectShape =
  | { kind: 'box'; size: [number, number, number] }
  | { kind: 'ball'; radius: number }
  | { kind: 'cylinder'; radius: number; length: number }
  | { kind: 'mesh'; uri: string; scale: number };

export interface ObjectSpec {
  name: string;
  shape: ObjectShape;
  mass: number; // kg; of an object that is not static
  fixed: boolean;
  colour: [number, number, number]; // sRGB, 0 to 1
}

const NAME = /^[A-Za-z0-9_][A-Za-z0-9_ .-]{0,63}$/;

// The problem of the object, as text for the user; '' if there is none.
export function objectProblem(spec: ObjectSpec): string {
  const { shape } = spec;
  const lengths = shape.kind === 'box' ? shape.size : shape.kind === 'ball' ? [shape.radius] : shape.kind === 'cylinder' ? [shape.radius, shape.length] : [shape.scale];
  if (!NAME.test(spec.name)) return 'The name must begin with a letter or digit, and may have spaces, dots and dashes after that.';
  if (!lengths.every((one) => Number.isFinite(one) && one > 0)) return 'Sizes must be above zero.';
  if (shape.kind === 'mesh' && shape.uri === '') return 'Choose a mesh.';
  if (!spec.fixed && !(Number.isFinite(spec.mass) && spec.mass > 0)) return 'The mass must be above zero, or the object fixed.';
  return '';
}

export function escapeXml(text: string): string {
  return text.replace(/[&<>"']/g, (c) => `&#${c.charCodeAt(0)};`);
}

function geometry(shape: ObjectShape): string {
  switch (shape.kind) {
    case 'box': return `<box><size>${shape.size.join(' ')}</size></box>`;
    case 'ball': return `<sphere><radius>${shape.radius}</radius></sphere>`;
    case 'cylinder': return `<cylinder><radius>${shape.radius}</radius><length>${shape.length}</length></cylinder>`;
    case 'mesh': return `<mesh><uri>${escapeXml(shape.uri)}</uri><scale>${shape.scale} ${shape.scale} ${shape.scale}</scale></mesh>`;
  }
}

export function objectSdf(spec: ObjectSpec): string {
  const form = `<geometry>${geometry(spec.shape)}</geometry>`;
  const rgba = [...spec.colour.map((part) => +part.toFixed(4)), 1].join(' ');
  return `<?xml version="1.0"?>\n<sdf version="1.7"><model name="${escapeXml(spec.name)}">` +
    (spec.fixed ? '<static>true</static>' : '') +
    '<link name="link">' + (spec.fixed ? '' : `<inertial><mass>${spec.mass}</mass></inertial>`) +
    `<collision name="collision">${form}</collision>` +
    `<visual name="visual">${form}<material><ambient>${rgba}</ambient><diffuse>${rgba}</diffuse></material></visual>` +
    '</link></model></sdf>\n';
}

// The height of its centre above the ground at rest; 0 if only the file defines it.
export function restHeight(shape: ObjectShape): number {
  switch (shape.kind) {
    case 'box': return shape.size[2] / 2;
    case 'ball': return shape.radius;
    case 'cylinder': return shape.length / 2;
    case 'mesh': return 0;
  }
}

export function freeName(kind: string, taken: Iterable<string>): string {
  const names = new Set(taken);
  for (let i = 1; ; i += 1) if (!names.has(`${kind}_${i}`)) return `${kind}_${i}`;
}

export function rgbOf(hex: string): [number, number, number] {
  const n = parseInt(hex.slice(1), 16);
  return [((n >> 16) & 255) / 255, ((n >> 8) & 255) / 255, (n & 255) / 255];
}
