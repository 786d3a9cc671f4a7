import { expect, test } from 'vitest';
import type { NodeShape } from '../src/geometry';
import { initialPose, orientationOf, positionOf } from '../src/geometry';
import { amplitude, damping, frequency, modesOf, MovedPose, unknownsOfNodes } from '../src/modes';

const nodes: NodeShape[] = [
  { label: 1, kind: 'static', name: '', position: [0, 0, 0], orientation: [1, 0, 0, 0, 1, 0, 0, 0, 1], positionHandle: 0 },
  { label: 12, kind: 'dynamic', name: 'tip', position: [1, 0, 0], orientation: [1, 0, 0, 0, 1, 0, 0, 0, 1], positionHandle: 1 },
];
const names = [
  ...Array.from({ length: 6 }, (_, k) => `structural node 1, unknown of: force balance ${k}`),
  ...Array.from({ length: 12 }, (_, k) => `structural node 12 (tip), unknown of: row ${k}`),
  'joint 1 (clamp), unknown of: position constraint 1',
];

test('the first unknowns of a node are its displacement and rotation', () => {
  expect(unknownsOfNodes(names, nodes)).toEqual([0, 6]);
});

test('a mode has one frequency, damping and motion of a conjugate pair', () => {
  const rows = names.length, columns = 3;
  const real = new Array(rows * columns).fill(0), imaginary = new Array(rows * columns).fill(0);
  real[(6 + 2) * columns + 1] = 0.02;  // node 12 along z, in the second column
  imaginary[(6 + 3) * columns + 1] = 0.5;
  const eigen = { real: [-1, -0.3, -0.3], imaginary: [0, 4, -4], vectorsReal: { rows, columns, values: real }, vectorsImaginary: { rows, columns, values: imaginary } };
  const [mode, ...rest] = modesOf(eigen, names, nodes);
  expect(rest).toEqual([]);
  expect(frequency(mode)).toBeCloseTo(4 / (2 * Math.PI), 12);
  expect(damping(mode)).toBeCloseTo(0.3 / Math.hypot(0.3, 4), 12);
  expect(amplitude(mode, 0.01)).toBeCloseTo(0.5, 12);
  const base = initialPose(nodes), pose = new MovedPose(base);
  pose.move(base, mode, 0, 0.5);
  expect(positionOf(pose, 0)).toEqual([0, 0, 0]);
  expect(positionOf(pose, 1)).toEqual([1, 0, 0.01]);
  pose.move(base, mode, Math.PI / 2, 0.5);
  expect(positionOf(pose, 1)[2]).toBeCloseTo(0, 12);
  expect(orientationOf(pose, 1)[5]).toBeCloseTo(Math.sin(0.25), 12);  // turned about x by −0.25 rad
});
