// The box with the values of the selected link and its joint, and their locations in the sources.
import { STRIDE, type TreeJoint } from '../robot/tree';
import type { Inertial } from '../robot/urdf';
import type { App } from './app';
import { button, fill, h, say, type Child } from './dom';
import { icon } from './icons';
import { placeLabel } from './place_label';
import type { Place } from './sources';
import { format, millimetres, unitOf } from './units';

type Row = [string, Child];

// Three significant digits.
export function short(value: number): string {
  if (value === 0) return '0';
  return Math.abs(value) < 0.001 ? value.toExponential(2).replace(/\.?0+e/, 'e') : Number(value.toPrecision(3)).toString();
}

export function inertiaText(inertial: Inertial): string {
  const [xx, xy, xz, yy, yz, zz] = inertial.inertia;
  const diagonal = `${short(xx)}  ${short(yy)}  ${short(zz)} kg m²`;
  return [xy, xz, yz].every((v) => v === 0) ? diagonal : `${diagonal}\nxy ${short(xy)}  xz ${short(xz)}  yz ${short(yz)}`;
}

function axisText(axis: readonly number[]): string {
  const at = axis.findIndex((v) => Math.abs(Math.abs(v) - 1) < 1e-6);
  return at >= 0 ? `${axis[at]! < 0 ? '−' : '+'}${'xyz'[at]}` : axis.map((v) => v.toFixed(3)).join('  ');
}

export function makeDetails(app: App): { element: HTMLElement; update: () => void } {
  const { twin, world, sources } = app;
  const element = h('section', { class: 'details', hidden: true, 'aria-label': 'What is selected' });
  const position = h('span', { class: 'num' });
  const at = h('span', { class: 'num' });

  const place = (where: Place | undefined, line: number): Child => (where ? placeLabel(where) : `line ${line} of /robot_description`);

  function jointRows(joint: TreeJoint): Row[] {
    const slides = joint.kind === 'prismatic';
    const rows: Row[] = [['type', `${joint.kind}, on ${joint.parent}`]];
    if (joint.index >= 0) {
      rows.push(['position', position], ['axis', axisText(joint.axis)]);
      rows.push(['limits', Number.isFinite(joint.lower) ? `${format(joint, joint.lower)} … ${format(joint, joint.upper)} ${unitOf(joint)}` : 'none']);
      const most = [joint.velocity > 0 ? `${format(joint, joint.velocity)} ${unitOf(joint)}/s` : '', joint.effort > 0 ? `${short(joint.effort)} ${slides ? 'N' : 'N m'}` : ''].filter(Boolean);
      if (most.length > 0) rows.push(['maximum', most.join(', ')]);
      const { damping, friction } = joint.dynamics;
      if (damping > 0 || friction > 0) {
        rows.push(['dynamics', `damping ${short(damping)} ${slides ? 'N s/m' : 'N m s/rad'}, friction ${short(friction)} ${slides ? 'N' : 'N m'}`]);
      }
      if (joint.mimic) rows.push(['follows', `${short(joint.mimic.multiplier)} × ${joint.mimic.joint}${joint.mimic.offset === 0 ? '' : ` + ${short(joint.mimic.offset)}`}`]);
    }
    rows.push(['written in', place(sources.joints.get(joint.name), joint.line)]);
    return rows;
  }

  const list = (rows: Row[]): HTMLElement => h('dl', {}, rows.map(([key, value]) => [h('dt', {}, key), h('dd', {}, value)]));

  function describe(): void {
    const { selection } = app;
    const { tree } = twin;
    element.hidden = !selection || !tree;
    if (!selection || !tree) return;
    const name = tree.links[selection.link]!;
    const link = tree.robot.links.get(name)!;
    const joint = tree.parentJoint[selection.link];
    const rows: Row[] = [['at', at]];
    if (link.inertial) {
      const { mass, origin } = link.inertial;
      rows.push(['mass', mass < 1 ? `${(mass * 1000).toFixed(1)} g` : `${mass.toFixed(3)} kg`]);
      rows.push(['centre', origin.xyz.map(millimetres).join('  ') + ' mm']);
      rows.push(['inertia', h('span', { class: 'num' }, inertiaText(link.inertial))]);
    } else {
      rows.push(['mass', 'none']);
    }
    rows.push(['shapes', `${link.visuals.length} visual, ${link.collisions.length} collision`], ['written in', place(sources.links.get(name), link.line)]);
    fill(element,
      h('div', { class: 'details-head' }, h('strong', {}, name), button(icon('close'), 'Close', () => app.select(null), { class: 'icon' })),
      list(rows), joint ? [h('strong', { class: 'details-joint' }, joint.name), list(jointRows(joint))] : null,
      h('div', { class: 'row' }, button('Use as tool', 'Drag and trace this link', () => world.setTool(selection.link))));
    update();
  }

  function update(): void {
    if (!app.selection || !twin.tree) return;
    const o = app.selection.link * STRIDE;
    say(at, [0, 1, 2].map((i) => millimetres(twin.poses[o + i]!)).join('  ') + ' mm');
    const joint = twin.tree.parentJoint[app.selection.link];
    if (joint && joint.index >= 0) say(position, `${format(joint, twin.q[joint.index]!)} ${unitOf(joint)}`);
  }

  app.selected.on((selection) => {
    world.highlight(selection ? selection.link : -1);
    describe();
  });
  sources.changed.on(describe);
  world.built.on(() => app.select(null));
  return { element, update };
}
