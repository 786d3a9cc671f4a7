import { describe, expect, test } from 'vitest';
import { inertiaEllipsoid, multiply, onParabola, quaternionOf, rotate, rotationOf, type Mat3, type Vec3 } from '../src/algebra';

const AXES: Vec3[] = [[0.3, -0.7, 1.1], [3, 0.1, 0], [0, Math.PI, 0], [1e-10, 0, 0], [-2, 2, -0.5], [0, 0, 0]];

function ofQuaternion([x, y, z, w]: number[]): number[] {
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
    2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
    2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
  ];
}

describe('rotations', () => {
  test.each(AXES)('the matrix of (%f, %f, %f) is a rotation that leaves its axis', (...phi) => {
    const R = rotationOf(phi);
    const transposed = [0, 3, 6, 1, 4, 7, 2, 5, 8].map((i) => R[i]) as unknown as Mat3;
    multiply(R, transposed).forEach((value, i) => expect(value).toBeCloseTo(i % 4 === 0 ? 1 : 0, 12));
    rotate(R, phi).forEach((value, i) => expect(value).toBeCloseTo(phi[i], 12));
  });

  test.each(AXES)('the quaternion of (%f, %f, %f) is the same rotation', (...phi) => {
    const R = rotationOf(phi), q = quaternionOf(R);
    expect(Math.hypot(...q)).toBeCloseTo(1, 12);
    ofQuaternion(q).forEach((value, i) => expect(value).toBeCloseTo(R[i], 12));
  });
});

test('the ellipsoid has the moments that it was made from', () => {
  const mass = 3, axes: Vec3 = [0.2, 0.5, 0.9];
  const squares = axes.map((a) => a * a);
  const moments = [0, 1, 2].map((i) => (mass / 5) * (squares[0] + squares[1] + squares[2] - squares[i])) as unknown as Vec3;
  inertiaEllipsoid(mass, moments).forEach((axis, i) => expect(axis).toBeCloseTo(axes[i], 12));
  expect(inertiaEllipsoid(0, [1, 1, 1])).toEqual([0, 0, 0]);
});

test('the parabola goes through its three points', () => {
  const points: Vec3[] = [[0, 0, 0], [1, 2, 0.5], [2, 0, 3]];
  points.forEach((point, i) => expect(onParabola(points[0], points[1], points[2], i - 1)).toEqual(point));
  expect(onParabola([0, 0, 0], [1, 0, 0], [2, 0, 0], 0.5)).toEqual([1.5, 0, 0]);
});
