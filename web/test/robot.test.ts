import assert from 'node:assert/strict';
import { test } from 'node:test';
import { parseXml, XmlError } from '../src/robot/xml';
import { parseUrdf } from '../src/robot/urdf';
import { STRIDE, Tree } from '../src/robot/tree';

const link = (name: string): string => `<link name="${name}"/>`;
const joint = (name: string, type: string, parent: string, child: string, more: string): string =>
  `<joint name="${name}" type="${type}"><parent link="${parent}"/><child link="${child}"/>${more}</joint>`;
const limit = '<limit lower="-2.6" upper="2.6" effort="3" velocity="2"/>';
const ARM = `<?xml version="1.0"?><!-- an arm --><robot name="arm">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="base"><visual><geometry><box size="1 2 3"/></geometry><material name="red"/></visual></link>
  ${['a', 'b', 'c', 'd', 'e', 'tool', 'left', 'right'].map(link).join('')}
  ${joint('j1', 'revolute', 'base', 'a', `<origin xyz="0 0 0.1"/><axis xyz="0 0 1"/>${limit}`)}
  ${joint('j2', 'revolute', 'a', 'b', `<origin xyz="0 0 0.1"/><axis xyz="0 2 0"/>${limit}`)}
  ${joint('j3', 'revolute', 'b', 'c', `<origin xyz="0 0 0.4" rpy="0.1 0.2 0.3"/><axis xyz="0 1 0"/>${limit}`)}
  ${joint('j4', 'revolute', 'c', 'd', `<origin xyz="0 0 0.3"/><axis xyz="0 0 1"/>${limit}`)}
  ${joint('j5', 'revolute', 'd', 'e', `<origin xyz="0 0 0.1"/><axis xyz="0 1 0"/>${limit}`)}
  ${joint('j6', 'prismatic', 'e', 'tool', `<origin xyz="0 0 0.1"/><axis xyz="0 0 1"/><limit lower="0" upper="0.1" effort="1" velocity="1"/>`)}
  ${joint('f1', 'prismatic', 'tool', 'left', '<axis xyz="0 1 0"/><limit lower="0" upper="0.02" effort="1" velocity="1"/>')}
  ${joint('f2', 'prismatic', 'tool', 'right', '<axis xyz="0 1 0"/><limit lower="-0.02" upper="0" effort="1" velocity="1"/><mimic joint="f1" multiplier="-1" offset="0.001"/>')}
</robot>`;

test('XML: comments, entities, CDATA, lines, faults', () => {
  const root = parseXml('<?xml version="1.0"?>\n<a x="1 &lt; 2" y=\'>\'><!-- <b> -->\n<b/>t &amp; <![CDATA[<&>]]></a>');
  assert.deepEqual(root.attributes, { x: '1 < 2', y: '>' });
  assert.equal(root.children[0]!.line, 3);
  assert.equal(root.text.trim(), 't & <&>');
  assert.throws(() => parseXml('<a><b></a>'), XmlError);
  assert.throws(() => parseXml('<a>'), XmlError);
});

test('a URDF becomes links, joints, limits, materials', () => {
  const robot = parseUrdf(ARM);
  assert.deepEqual(robot.links.get('base')!.visuals[0]!.geometry, { kind: 'box', size: [1, 2, 3] });
  assert.deepEqual(robot.links.get('base')!.visuals[0]!.material!.color, [1, 0, 0, 1]);
  assert.deepEqual(robot.joints[1]!.axis, [0, 1, 0]);
  assert.deepEqual(robot.joints[7]!.mimic, { joint: 'f1', multiplier: -1, offset: 0.001 });
});

test('poses: parents first, the tool above the base at zero, mimics follow', () => {
  const tree = new Tree(parseUrdf(ARM.replace(' rpy="0.1 0.2 0.3"', '')));
  const q = tree.rest();
  q[tree.jointByName.get('f1')!.index] = 0.01;
  tree.follow(q);
  assert.ok(Math.abs(q[tree.jointByName.get('f2')!.index]! + 0.009) < 1e-12);
  const poses = tree.newPoses();
  tree.forward(q, poses);
  const tool = tree.linkIndex.get('tool')! * STRIDE;
  assert.ok(Math.abs(poses[tool + 2]! - 1.1) < 1e-12);
  assert.equal(tree.links[tree.toolLink()], 'tool');
  q[tree.jointByName.get('j2')!.index] = Math.PI / 2;
  tree.forward(q, poses);
  assert.ok(Math.abs(poses[tool]! - 0.9) < 1e-12 && Math.abs(poses[tool + 2]! - 0.2) < 1e-12);
});

test('the joints of a limb follow each other, in the order of the description', () => {
  const sides = ['left', 'right', 'waist'];
  const links = ['pelvis', ...sides.flatMap((side) => [`${side}_1`, `${side}_2`])];
  const joints = [1, 2].flatMap((row) => sides.map((side) => joint(`${side}_joint_${row}`, 'revolute', row === 1 ? 'pelvis' : `${side}_1`, `${side}_${row}`, limit)));
  const tree = new Tree(parseUrdf(`<robot name="humanoid">${links.map(link).join('')}${joints.join('')}</robot>`));
  assert.deepEqual(tree.moving.map(({ name }) => name), sides.flatMap((side) => [`${side}_joint_1`, `${side}_joint_2`]));
  assert.deepEqual(tree.moving.map(({ index }) => index), [0, 1, 2, 3, 4, 5]);
});
