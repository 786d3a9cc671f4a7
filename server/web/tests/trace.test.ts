import { describe, expect, test } from 'vitest';
import { trace, type Value } from '../src/trace';

const points = (count: number, at: (i: number) => number) => Float64Array.from({ length: count }, (_, i) => at(i));
/** Distance of a point from the lines that are drawn. */
function distance([xs, ys]: [Value[], Value[]], x: number, y: number): number {
  let least = Infinity;
  for (let k = 0; k + 1 < xs.length; ++k) {
    const [ax, ay, bx, by] = [xs[k], ys[k], xs[k + 1], ys[k + 1]];
    if (ax === null || ay === null || bx === null || by === null) continue;
    const length = (bx - ax) ** 2 + (by - ay) ** 2, along = length > 0 ? Math.min(Math.max(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length, 0), 1) : 0;
    least = Math.min(least, Math.hypot(x - ax - along * (bx - ax), y - ay - along * (by - ay)));
  }
  return least;
}

describe('a curve over another one', () => {
  test('of few points has all of them', () => {
    expect(trace(Float64Array.of(0, 1, 0.5), Float64Array.of(0, 1, 3))).toEqual([[0, 1, 0.5], [0, 1, 3]]);
  });

  test('has gaps where either is no number, and none where nothing is known', () => {
    expect(trace(Float64Array.of(NaN, 0, 1, NaN, 3, 4), Float64Array.of(0, 0, 1, 2, 3, Infinity))).toEqual([[0, 1, null, 3], [0, 1, null, 3]]);
    expect(trace(Float64Array.of(NaN), Float64Array.of(1))).toEqual([[], []]);
    expect(trace(new Float64Array(0), new Float64Array(0))).toEqual([[], []]);
  });

  test('that goes round the same loop many times is drawn once, whole', () => {
    const angle = (i: number) => (2 * Math.PI * i) / 24;
    const drawn = trace(points(100_000, (i) => Math.cos(angle(i))), points(100_000, (i) => Math.sin(angle(i))));
    expect(drawn[0].length).toBeLessThan(100);
    for (let i = 0; i < 24; ++i) expect(distance(drawn, Math.cos(angle(i)), Math.sin(angle(i)))).toBeLessThan(2e-3);
  });

  test('keeps a single far point, and both ends of a fast wave', () => {
    const x = points(50_000, (i) => (i === 33_333 ? 9 : i / 50_000)), y = points(50_000, (i) => Math.sin(0.3 * i) + (i === 7_777 ? 5 : 0));
    const drawn = trace(x, y), [xs, ys] = drawn.map((values) => values.filter((value) => value !== null));
    expect(xs.length).toBeLessThan(6100);
    expect([Math.max(...xs), Math.max(...ys), Math.min(...ys)]).toEqual([9, Math.max(...y), Math.min(...y)]);
  });

  test('of a slow loop lies where all of its points do', () => {
    const x = points(60_000, (i) => Math.sin(i / 3000)), y = points(60_000, (i) => Math.sin(i / 2000 + 1) * Math.exp(-i / 60_000));
    const drawn = trace(x, y);
    expect(drawn[0].length).toBeLessThan(6100);
    for (let i = 0; i < x.length; i += 501) expect(distance(drawn, x[i], y[i])).toBeLessThan(4e-3);
  });

  test('that fills its plot has no more lines than are seen', () => {
    const x = points(100_000, (i) => Math.sin(1.234 * i)), y = points(100_000, (i) => Math.sin(2.7183 * i));
    const drawn = trace(x, y);
    expect(drawn[0].length).toBeLessThan(6100);
    expect(drawn[0].length).toBeGreaterThan(500);
    for (let i = 0; i < x.length; i += 997) expect(distance(drawn, x[i], y[i])).toBeLessThan(0.1);
  });

  test('of the largest numbers is drawn, too', () => {
    expect(trace(Float64Array.of(-1.7e308, 1.7e308, 0), Float64Array.of(1e-320, 0, 2e-320))).toEqual([[-1.7e308, 1.7e308, 0], [1e-320, 0, 2e-320]]);
  });
});
