import { describe, expect, test } from 'vitest';
import { rotationOf, type Mat3 } from '../src/algebra';
import { deformedPoints, finish, initialPose, orientationOf, pointAt, PoseReader, positionOf, type ElementShape, type FlexibleBody, type NodeShape } from '../src/geometry';
import { Layout } from '../src/recording';

const R = rotationOf([0, 0, Math.PI / 2]);
const nodes: NodeShape[] = [
  { label: 1, kind: 'static', name: '', position: [1, 0, 0], orientation: R, positionHandle: 0, orientationHandle: 1 },
  { label: 2, kind: 'dynamic', name: '', position: [3, 4, 0], positionHandle: 2 },
];

function close(a: ArrayLike<number>, b: ArrayLike<number>) {
  expect(a.length).toBe(b.length);
  for (let i = 0; i < a.length; ++i) expect(a[i]).toBeCloseTo(b[i], 6);
}

describe('points', () => {
  test('turn with their node', () => {
    close(pointAt(initialPose(nodes), { name: '', node: 0, offset: [2, 0, 0] }), [1, 2, 0]);
    close(pointAt(initialPose(nodes), { name: '', node: -1, offset: [2, 0, 5] }), [2, 0, 5]);
  });

  test('follow a sample, and stay where the sample says nothing', () => {
    const layout = new Layout([{ handle: 5, size: 1 }, { handle: 0, size: 3 }]);
    const reader = new PoseReader(nodes), pose = reader.read({ step: 1, time: 0, layout, values: Float64Array.of(9, 5, 6, 7) });
    close(positionOf(pose, 0), [5, 6, 7]);
    close(orientationOf(pose, 0), R);
    close(positionOf(pose, 1), [3, 4, 0]);
    expect(pose.value(0, 2)).toBe(7);
    const wider = new Layout([{ handle: 2, size: 3 }, { handle: 0, size: 3 }]);
    expect(reader.read({ step: 2, time: 1, layout: wider, values: Float64Array.of(1, 2, 3, 4, 5, 6) })).toBe(pose);
    close(positionOf(pose, 0), [4, 5, 6]);
    close(positionOf(pose, 1), [1, 2, 3]);
    expect(pose.value(8, 0)).toBeNaN();
  });
});

test('a flexible body is x + R (f + factor Σ U q)', () => {
  const body: FlexibleBody = {
    joint: 1, node: 0, fixedPosition: [0, 0, 0], fixedOrientation: [1, 0, 0, 0, 1, 0, 0, 0, 1] as Mat3, amplitudes: [10, 11], labels: ['a', 'b'],
    positions: [1, 0, 0, 2, 0, 0],
    shapes: [0, 0, 1, 0, 0, 0.5, 0, 0, 2, 0, 0, 1],
  };
  const out = new Float32Array(6);
  deformedPoints(body, initialPose(nodes), [0.1, 0.2], 10, out);
  // local: (1, 1, 1) and (2, 2, 2), turned by a quarter about z and moved by x = 1
  close(out, [1 - 1, 1, 1, 1 - 2, 2, 2]);
});

test('the extent is that of all points', () => {
  const geometry = finish(nodes, [], []);
  close(geometry.centre, [2, 2, 0]);
  expect(geometry.extent).toBeCloseTo(Math.hypot(2, 4), 12);
  expect(finish([], [], []).extent).toBe(1);
});

describe('ellipsoids of inertia', () => {
  const body = (label: number, J: number): ElementShape => ({
    id: `body:${label}`, family: 'body', type: '', label, name: '', points: [{ name: '', node: 0, offset: [0, 0, 0] }], frames: [], lines: [], surfaces: [], arrows: [],
    masses: [{ point: 0, mass: 1, moments: [J, J, J], axes: [1, 0, 0, 0, 1, 0, 0, 0, 1] }],
  });

  test('are smaller than the model, all by the same factor', () => {
    const axis = Math.sqrt(5 * 10 / 2), { bodyScale, extent } = finish(nodes, [body(1, 10), body(2, 0.01)], []);
    expect(bodyScale * axis).toBeCloseTo((0.34 * extent) / Math.SQRT2, 9);
    expect(finish(nodes, [body(1, 0.001)], []).bodyScale).toBe(1);
  });

  test('of a single node make the extent', () => {
    const { bodyScale, extent } = finish(nodes.slice(0, 1), [body(1, 10)], []);
    expect(extent).toBeCloseTo(3 * Math.sqrt(25), 9);
    expect(bodyScale).toBe(1);
  });
});
