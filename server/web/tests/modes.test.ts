import { expect, test } from 'vitest';
import type { FlexibleBody, NodeShape } from '../src/geometry';
import { initialPose, orientationOf, positionOf } from '../src/geometry';
import { amplitude, damping, frequency, modesOf, MovedPose, unknownsOfBody, unknownsOfNodes } from '../src/modes';

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
  const [mode, ...rest] = modesOf(eigen, names, { nodes, bodies: [] });
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

test('a flexible body moves by the amplitudes of the eigenvector, and is what the size counts for', () => {
  const bodyNames = ['joint 20 (modal, jib), unknown of: velocity of mode 1', 'joint 20 (modal, jib), unknown of: velocity of mode 2', 'joint 20 (modal, jib), unknown of: balance of mode 1', 'joint 2 (modal), unknown of: velocity of mode 1'];
  const body: FlexibleBody = {
    joint: 20, node: 0, fixedPosition: [0, 0, 0], fixedOrientation: [1, 0, 0, 0, 1, 0, 0, 0, 1], amplitudes: [71, 72],
    labels: ['1'], positions: [0, 0, 0], shapes: [0, 0, 0, 0, 1, 2],
  };
  expect(unknownsOfBody([...names, ...bodyNames], 20)).toEqual([names.length, names.length + 1]);
  const rows = names.length + bodyNames.length, columns = 1;
  const real = new Array(rows).fill(0), imaginary = new Array(rows).fill(0);
  real[names.length] = 0.3, real[names.length + 1] = -0.4, imaginary[names.length + 1] = 0.1;
  const eigen = { real: [-1], imaginary: [4], vectorsReal: { rows, columns, values: real }, vectorsImaginary: { rows, columns, values: imaginary } };
  const [mode] = modesOf(eigen, [...names, ...bodyNames], { nodes, bodies: [body] });
  expect(mode.deformation).toBeCloseTo(Math.hypot(0.3 - 0.8, 0.2), 12);
  expect(amplitude(mode, 0.1)).toBeCloseTo(0.1 / mode.deformation, 12);
  const base = { ...initialPose(nodes), value: (handle: number) => (handle === 71 ? 1 : 0) }, pose = new MovedPose(base);
  pose.move(base, mode, 0, 2);
  expect([pose.value(71, 0), pose.value(72, 0), pose.value(5, 0)]).toEqual([1 + 0.6, -0.8, 0]);
  pose.move(base, mode, Math.PI / 2, 2);
  expect(pose.value(72, 0)).toBeCloseTo(-0.2, 12);
});
