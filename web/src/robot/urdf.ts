// A URDF as a typed tree, as needed to draw and move it. The program reports faults; here every robot that can be drawn
// is drawn.

import { child, childrenOf, numbers, parseXml, type Element } from './xml';

export type Vec3 = [number, number, number];
export interface Pose {
  xyz: Vec3;
  rpy: Vec3;
}

export type Geometry =
  | { kind: 'box'; size: Vec3 }
  | { kind: 'cylinder'; radius: number; length: number }
  | { kind: 'capsule'; radius: number; length: number }
  | { kind: 'sphere'; radius: number }
  | { kind: 'mesh'; uri: string; scale: Vec3 };

export interface Material {
  name: string;
  color: [number, number, number, number] | null;
  texture: string | null;
}

export interface Shape {
  name: string;
  origin: Pose;
  geometry: Geometry;
  material: Material | null;
}

export interface Inertial {
  origin: Pose;
  mass: number;
  inertia: [number, number, number, number, number, number]; // xx xy xz yy yz zz
}

export interface Link {
  name: string;
  line: number;
  visuals: Shape[];
  collisions: Shape[];
  inertial: Inertial | null;
}

export type JointKind = 'revolute' | 'continuous' | 'prismatic' | 'fixed' | 'floating' | 'planar';

export interface Joint {
  name: string;
  line: number;
  kind: JointKind;
  parent: string;
  child: string;
  origin: Pose;
  axis: Vec3;
  lower: number;
  upper: number;
  velocity: number; // 0: not given
  effort: number; // 0: not given
  dynamics: { damping: number; friction: number }; // 0: not given
  mimic: { joint: string; multiplier: number; offset: number } | null;
}

export interface Robot {
  name: string;
  links: Map<string, Link>;
  joints: Joint[];
}

function pose(element: Element | undefined): Pose {
  return {
    xyz: numbers(element?.attributes['xyz'], [0, 0, 0]) as Vec3,
    rpy: numbers(element?.attributes['rpy'], [0, 0, 0]) as Vec3,
  };
}

function number(element: Element | undefined, name: string, otherwise = 0): number {
  const text = element?.attributes[name];
  const value = text === undefined ? otherwise : Number(text);
  return Number.isFinite(value) ? value : otherwise;
}

function geometry(element: Element | undefined): Geometry | null {
  const shape = element?.children[0];
  if (!shape) return null;
  switch (shape.name) {
    case 'box':
      return { kind: 'box', size: numbers(shape.attributes['size'], [0, 0, 0]) as Vec3 };
    case 'cylinder':
    case 'capsule':
      return { kind: shape.name, radius: number(shape, 'radius'), length: number(shape, 'length') };
    case 'sphere':
      return { kind: 'sphere', radius: number(shape, 'radius') };
    case 'mesh':
      return {
        kind: 'mesh',
        uri: shape.attributes['filename'] ?? '',
        scale: numbers(shape.attributes['scale'], [1, 1, 1]) as Vec3,
      };
    default:
      return null;
  }
}

function material(element: Element | undefined, known: Map<string, Material>): Material | null {
  if (!element) return null;
  const name = element.attributes['name'] ?? '';
  const rgba = child(element, 'color')?.attributes['rgba'];
  const texture = child(element, 'texture')?.attributes['filename'] ?? null;
  if (rgba === undefined && texture === null) return known.get(name) ?? null;
  const made: Material = {
    name,
    color: rgba === undefined ? null : (numbers(rgba, [0.7, 0.7, 0.7, 1]) as Material['color']),
    texture,
  };
  if (name && !known.has(name)) known.set(name, made);
  return made;
}

function shapes(link: Element, name: string, known: Map<string, Material>): Shape[] {
  const out: Shape[] = [];
  for (const element of childrenOf(link, name)) {
    const shape = geometry(child(element, 'geometry'));
    if (!shape) continue;
    out.push({
      name: element.attributes['name'] ?? '',
      origin: pose(child(element, 'origin')),
      geometry: shape,
      material: material(child(element, 'material'), known),
    });
  }
  return out;
}

function inertial(element: Element | undefined): Inertial | null {
  if (!element) return null;
  const i = child(element, 'inertia');
  return {
    origin: pose(child(element, 'origin')),
    mass: number(child(element, 'mass'), 'value'),
    inertia: [number(i, 'ixx'), number(i, 'ixy'), number(i, 'ixz'), number(i, 'iyy'), number(i, 'iyz'), number(i, 'izz')],
  };
}

function joint(element: Element): Joint {
  const limit = child(element, 'limit');
  const mimic = child(element, 'mimic');
  const kind = (element.attributes['type'] ?? 'fixed') as JointKind;
  const axis = numbers(child(element, 'axis')?.attributes['xyz'], [1, 0, 0]) as Vec3;
  const length = Math.hypot(...axis) || 1;
  const bounded = kind === 'revolute' || kind === 'prismatic';
  return {
    name: element.attributes['name'] ?? '',
    line: element.line,
    kind,
    parent: child(element, 'parent')?.attributes['link'] ?? '',
    child: child(element, 'child')?.attributes['link'] ?? '',
    origin: pose(child(element, 'origin')),
    axis: [axis[0] / length, axis[1] / length, axis[2] / length],
    lower: bounded ? number(limit, 'lower') : -Infinity,
    upper: bounded ? number(limit, 'upper') : Infinity,
    velocity: number(limit, 'velocity'),
    effort: number(limit, 'effort'),
    dynamics: { damping: number(child(element, 'dynamics'), 'damping'), friction: number(child(element, 'dynamics'), 'friction') },
    mimic: mimic
      ? {
          joint: mimic.attributes['joint'] ?? '',
          multiplier: number(mimic, 'multiplier', 1),
          offset: number(mimic, 'offset', 0),
        }
      : null,
  };
}

export function parseUrdf(source: string): Robot {
  const root = parseXml(source);
  if (root.name !== 'robot') throw new Error(`the description begins with <${root.name}> instead of <robot>`);
  const known = new Map<string, Material>();
  for (const element of childrenOf(root, 'material')) material(element, known);
  const links = new Map<string, Link>();
  for (const element of childrenOf(root, 'link')) {
    const name = element.attributes['name'] ?? '';
    links.set(name, {
      name,
      line: element.line,
      visuals: shapes(element, 'visual', known),
      collisions: shapes(element, 'collision', known),
      inertial: inertial(child(element, 'inertial')),
    });
  }
  const joints = childrenOf(root, 'joint')
    .map(joint)
    .filter((one) => links.has(one.parent) && links.has(one.child));
  return { name: root.attributes['name'] ?? '', links, joints };
}
