// Objects of the world: adding, moving with the handle or by numbers, removing.
import * as THREE from 'three';
import type { App, Panel } from '../app/app';
import { button, fill, h, say, toast } from '../app/dom';
import { freeName, objectProblem, objectSdf, restHeight, rgbOf, type ObjectShape } from '../app/sdf';
import type { ObjectLayer } from '../scene/objects';

type Kind = ObjectShape['kind'];
const SIZES: Record<Kind, [string, string][]> = { // label, value in mm; the scale of a mesh is a factor
  box: [['x', '50'], ['y', '50'], ['z', '50']],
  ball: [['radius', '25']],
  cylinder: [['radius', '25'], ['length', '80']],
  mesh: [['scale', '1']],
};
const POSE: [string, string][] = [['x', 'mm'], ['y', 'mm'], ['z', 'mm'], ['roll', '°'], ['pitch', '°'], ['yaw', '°']];
const DEG = 180 / Math.PI;

const numberOf = (input: HTMLInputElement): number => (input.value.trim() === '' ? NaN : Number(input.value.replace(',', '.')));

export function objectsPanel(app: App, layer: ObjectLayer): Panel {
  const { twin } = app;
  let kind: Kind = 'box';
  const missing = h('p', { class: 'empty' });
  const list = h('ul', { class: 'object-list', role: 'listbox', 'aria-label': 'Objects' });
  const name = h('input', { type: 'text', spellcheck: false, 'aria-label': 'Name of the object', id: 'object-name' });
  const sizes = h('div', { class: 'row' });
  let sizeInputs: HTMLInputElement[] = [];
  const mesh = h('select', { 'aria-label': 'Mesh of the robot’s packages', id: 'object-mesh' });
  const meshRow = h('label', { class: 'setting' }, h('span', {}, 'Mesh'), mesh);
  const mass = h('input', { type: 'text', class: 'num short', inputMode: 'decimal', value: '100', 'aria-label': 'Mass in grams', id: 'object-mass' });
  const fixed = h('input', { type: 'checkbox', onchange: () => (mass.disabled = fixed.checked), id: 'object-fixed' });
  const colour = h('input', { type: 'color', value: '#2a9d8f', 'aria-label': 'Colour', id: 'object-colour' });
  const problem = h('p', { class: 'error', role: 'alert', hidden: true });
  const place = button('Place in the view', 'The next click on the ground places it', () => {
    if (layer.placing) layer.place(null);
    else if (check()) layer.place((at) => void add(at.x, at.y));
  }, { id: 'object-place', 'aria-pressed': 'false' });
  const atX = h('input', { type: 'text', class: 'num short', inputMode: 'decimal', value: '200', 'aria-label': 'x in millimetres' });
  const atY = h('input', { type: 'text', class: 'num short', inputMode: 'decimal', value: '0', 'aria-label': 'y in millimetres' });
  const chosen = h('div', { hidden: true });
  const title = h('h3', {});
  const pose = POSE.map(([axis, unit]) => h('input', { type: 'text', class: 'num', inputMode: 'decimal', 'aria-label': `${axis} in ${unit}`, id: `object-${axis}` }));

  function spec(): { shape: ObjectShape; name: string; mass: number; fixed: boolean; colour: [number, number, number] } {
    const [a = NaN, b = NaN, c = NaN] = sizeInputs.map((input) => numberOf(input) * (kind === 'mesh' ? 1 : 0.001));
    const shape: ObjectShape = kind === 'box' ? { kind, size: [a, b, c] } : kind === 'ball' ? { kind, radius: a } : kind === 'cylinder' ? { kind, radius: a, length: b } : { kind, uri: mesh.value, scale: a };
    return { shape, name: name.value.trim(), mass: numberOf(mass) / 1000, fixed: fixed.checked, colour: rgbOf(colour.value) };
  }

  function check(): boolean {
    const wanted = spec();
    const text = layer.objects.has(wanted.name) ? `There is already an object '${wanted.name}'.` : objectProblem(wanted);
    say(problem, text);
    problem.hidden = text === '';
    return text === '';
  }

  async function add(x: number, y: number): Promise<void> {
    if (!Number.isFinite(x) || !Number.isFinite(y)) {
      toast('Enter a number for x and for y.', 'warning');
      return;
    }
    if (!check()) return;
    const wanted = spec();
    if (!(await layer.add(wanted.name, objectSdf(wanted), new THREE.Vector3(x, y, app.world.stage.ground.height + restHeight(wanted.shape))))) return;
    toast(`${wanted.name} is in the world.`);
    propose();
  }

  function propose(): void {
    if (name.value === '' || layer.objects.has(name.value) || /^(box|ball|cylinder|mesh)_\d+$/.test(name.value)) name.value = freeName(kind, layer.objects.keys());
  }

  function choose(next: Kind): void {
    kind = next;
    sizeInputs = SIZES[kind].map(([label, value]) => h('input', { type: 'text', class: 'num short', inputMode: 'decimal', value, 'aria-label': `${label}${kind === 'mesh' ? '' : ' in millimetres'}` }));
    fill(sizes, SIZES[kind].map(([label], i) => h('label', { class: 'field' }, h('span', { class: 'muted' }, label), sizeInputs[i]!)), kind === 'mesh' ? null : h('span', { class: 'muted' }, 'mm'));
    meshRow.hidden = kind !== 'mesh';
    for (const b of kinds.children) b.setAttribute('aria-pressed', String((b as HTMLElement).dataset['kind'] === kind));
    propose();
  }

  const kinds = h('div', { class: 'segments', role: 'group', 'aria-label': 'Shape' }, (['box', 'ball', 'cylinder', 'mesh'] as const).map((one) =>
    button(one[0]!.toUpperCase() + one.slice(1), `A ${one}`, () => choose(one), { 'aria-pressed': 'false' })));
  [...kinds.children].forEach((b, i) => ((b as HTMLElement).dataset['kind'] = (['box', 'ball', 'cylinder', 'mesh'] as const)[i]!));

  function build(): void {
    const lacking = twin.client.phase === 'open' && twin.client.channels.size > 0 ? layer.missing : '';
    say(missing, lacking);
    missing.hidden = lacking === '';
    form.hidden = lacking !== '';
    list.hidden = lacking !== '' && layer.objects.size === 0;
    fill(list, layer.objects.size === 0 ? h('li', { class: 'empty' }, 'No objects yet; add one below.') : [...layer.objects.keys()].sort().map((one) => h('li', {},
      h('button', { type: 'button', role: 'option', class: 'plain object', 'aria-selected': String(one === layer.selected), onclick: () => {
        app.select(null);
        layer.select(one);
      } }, one), button('Remove', `Remove ${one}`, () => void layer.remove(one), { disabled: lacking !== '' }))));
    show();
  }

  function show(): void {
    chosen.hidden = layer.selected === null || layer.missing !== '';
    say(title, layer.selected ?? '');
    for (const item of list.querySelectorAll('.object')) item.setAttribute('aria-selected', String(item.textContent === layer.selected));
  }

  function numbers(): void {
    const object = layer.objects.get(layer.selected ?? '');
    if (!object || pose.includes(document.activeElement as HTMLInputElement)) return;
    const { position: p, quaternion } = object.holder;
    const e = new THREE.Euler().setFromQuaternion(quaternion, 'ZYX');
    [p.x * 1000, p.y * 1000, p.z * 1000, e.x * DEG, e.y * DEG, e.z * DEG].forEach((value, i) => {
      const text = value.toFixed(1).replace(/^-(0\.0)$/, '$1');
      if (pose[i]!.value !== text) pose[i]!.value = text;
    });
  }

  function moveByNumbers(): void {
    const [x, y, z, roll, pitch, yaw] = pose.map(numberOf) as [number, number, number, number, number, number];
    if (![x, y, z, roll, pitch, yaw].every(Number.isFinite) || layer.selected === null) {
      toast('Enter a number in each of the six fields.', 'warning');
      return;
    }
    void layer.move(layer.selected, new THREE.Vector3(x, y, z).divideScalar(1000), new THREE.Quaternion().setFromEuler(new THREE.Euler(roll / DEG, pitch / DEG, yaw / DEG, 'ZYX')));
  }
  for (const input of pose) input.addEventListener('change', moveByNumbers);

  const mode = (which: 'translate' | 'rotate', label: string): HTMLButtonElement => button(label, `${label} by the handle`, () => {
    layer.showMode(which);
    for (const b of modes) b.setAttribute('aria-pressed', String(b === (which === 'translate' ? modes[0] : modes[1])));
  }, { 'aria-pressed': String(which === 'translate') });
  const modes = [mode('translate', 'Move'), mode('rotate', 'Turn')];
  fill(chosen, title, h('div', { class: 'row' }, modes), h('div', { class: 'pose-fields' }, POSE.map(([axis, unit], i) => h('label', { class: 'field' }, h('span', { class: 'muted' }, `${axis} ${unit}`), pose[i]!))));

  const form = h('div', {},
    h('h3', {}, 'Add'), kinds,
    h('label', { class: 'setting' }, h('span', {}, 'Name'), name), meshRow,
    h('div', { class: 'setting' }, h('span', {}, 'Size'), sizes),
    h('div', { class: 'setting' }, h('span', {}, 'Mass'), h('div', { class: 'row' }, h('label', { class: 'toggle' }, fixed, h('span', {}, 'fixed')), mass, h('span', { class: 'muted' }, 'g'))),
    h('label', { class: 'setting' }, h('span', {}, 'Colour'), colour),
    problem,
    h('div', { class: 'row place-row' }, place),
    h('div', { class: 'row' }, h('span', { class: 'muted' }, 'or at'), h('label', { class: 'field' }, h('span', { class: 'muted' }, 'x'), atX), h('label', { class: 'field' }, h('span', { class: 'muted' }, 'y'), atY), h('span', { class: 'muted' }, 'mm'),
      button('Add', 'Add it at these coordinates', () => void add(numberOf(atX) / 1000, numberOf(atY) / 1000), { id: 'object-add' })));

  twin.robotChanged.on((tree) => {
    const uris = new Set<string>();
    for (const link of tree.robot.links.values()) {
      for (const shape of [...link.visuals, ...link.collisions]) if (shape.geometry.kind === 'mesh') uris.add(shape.geometry.uri);
    }
    fill(mesh, [...uris].sort().map((uri) => h('option', { value: uri }, uri.replace(/^(package|file):\/\//, ''))));
    const scaled = [...tree.robot.links.values()].flatMap((link) => link.visuals).find((shape) => shape.geometry.kind === 'mesh');
    SIZES.mesh[0]![1] = scaled?.geometry.kind === 'mesh' ? String(scaled.geometry.scale[0]) : '1';
    choose(kind);
  });
  layer.listChanged.on(() => {
    build();
    propose();
  });
  layer.selectedChanged.on(() => {
    show();
    numbers();
  });
  layer.placingChanged.on((on) => {
    place.setAttribute('aria-pressed', String(on));
    say(place, on ? 'Click on the ground…' : 'Place in the view');
    document.body.classList.toggle('placing', on);
  });
  twin.graphChanged.on(build);
  choose('box');
  build();
  return {
    id: 'objects', title: 'Objects', rate: 8,
    applies: () => layer.objects.size > 0 || (!app.commander.viewing && !twin.isReadOnly), update: numbers, hidden: () => layer.place(null),
    element: h('div', { class: 'padded objects' }, missing, list, chosen, form),
  };
}
