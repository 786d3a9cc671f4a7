import { describe, expect, test } from 'vitest';
import { IDENTITY, rotationOf, type Mat3 } from '../src/algebra';
import { BeamCurve, weights } from '../src/beam_curve';
import type { Pose } from '../src/geometry';

function pose(x: number[], R: readonly Mat3[]): Pose {
  return { x: Float64Array.from(x), R: Float64Array.from(R.flat()), value: () => NaN };
}
const straight = [0, 0, 0, 1, 0, 0, 2, 0, 0];

function station(curve: BeamCurve, i: number): { x: number[]; a: number[]; b: number[] } {
  const at = (from: number) => Array.from(curve.stations.subarray(9 * i + from, 9 * i + from + 3));
  return { x: at(0), a: at(3), b: at(6) };
}

function close(a: number[], b: number[]) {
  a.forEach((value, k) => expect(value).toBeCloseTo(b[k], 12));
}

describe('a beam of three nodes', () => {
  const curve = new BeamCurve([0, 1, 2], [0, 1, 2], straight, () => IDENTITY, 5);

  test('has weights that sum to one and pass through its points', () => {
    for (const xi of [-1, -0.3, 0, 0.8, 1]) expect(weights(3, xi).reduce((sum, weight) => sum + weight, 0)).toBeCloseTo(1, 12);
    close(weights(3, 0), [0, 1, 0]);
    close(weights(2, 1), [0, 1]);
  });

  test('lies on the parabola through them', () => {
    const x = [0, 0, 0, 1, 0, 0.5, 2, 0, 0];
    curve.update(pose(x, [IDENTITY, IDENTITY, IDENTITY]), x);
    close(station(curve, 0).x, [0, 0, 0]);
    close(station(curve, 1).x, [0.5, 0, 0.375]);
    close(station(curve, 2).x, [1, 0, 0.5]);
    close(station(curve, 4).x, [2, 0, 0]);
  });

  test('has sections across the line that twist with the nodes', () => {
    const twist = rotationOf([0.5, 0, 0]);
    curve.update(pose(straight, [IDENTITY, IDENTITY, twist]), straight);
    close(station(curve, 0).a, [0, 1, 0]);
    close(station(curve, 0).b, [0, 0, 1]);
    close(station(curve, 4).a, [0, Math.cos(0.5), Math.sin(0.5)]);
  });

  test('keeps its sections across a line that bends', () => {
    const x = [0, 0, 0, 1, 0.3, 0.5, 2, 0.1, 0];
    curve.update(pose(x, [IDENTITY, rotationOf([0.2, 0.1, -0.3]), rotationOf([0.4, -0.2, 0])]), x);
    for (let i = 0; i < 5; ++i) {
      const { a, b } = station(curve, i);
      expect(Math.hypot(...a)).toBeCloseTo(1, 12);
      expect(Math.hypot(...b)).toBeCloseTo(1, 12);
      expect(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]).toBeCloseTo(0, 12);
    }
  });
});
