import { describe, expect, test } from 'vitest';
import type { Curve } from '../src/desk';
import { alone, columns, powerOf, traces, without } from '../src/panels/plots';
import { Layout, type Sample } from '../src/recording';

const variable = (handle: number) => ({ handle, size: 1, name: `v${handle}` }) as Curve['variable'];
const first = { variable: variable(1), element: 0 }, second = { variable: variable(2), element: 0 };
const few = new Layout([variable(1)]), all = new Layout([variable(1), variable(2)]);
const sample = (step: number, layout: Layout, ...values: number[]): Sample => ({ step, time: step / 10, layout, values: Float64Array.from(values) });
/** The second variable is followed from the third sample on. */
const samples = [sample(0, few, 1), sample(1, few, 0), sample(2, all, -1, 20), sample(3, all, 0, NaN), sample(4, all, 1, 40)];

describe('a curve', () => {
  test('has gaps where samples do not have its variable, or it is no number', () => {
    expect(columns(samples, { id: 1, curves: [first, second] })).toEqual([[0, 0.1, 0.2, 0.3, 0.4], [1, 0, -1, 0, 1], [null, null, 20, null, 40]]);
  });

  test('over another one goes to and fro in the order of time, where both are known', () => {
    expect(traces(samples, [first], second)).toEqual([[[20, null, 40], [-1, null, 1]]]);
    expect(traces(samples, [first, second], first)).toEqual([[[1, 0, -1], [1, 0, -1]], [[-1, null, 1], [20, null, 40]]]);
  });

  test('of very many samples has fewer points, and the newest', () => {
    const many = Array.from({ length: 10_000 }, (_, step) => sample(step, few, step)), [time, values] = columns(many, { id: 1, curves: [first] });
    expect(time.length).toBeLessThan(3500);
    expect([time.at(-1), values.at(-1)]).toEqual([999.9, 9999]);
  });

  test('of very many samples shows every peak, whatever their pace', () => {
    const many = Array.from({ length: 72_000 }, (_, step) => sample(step, all, Math.sin((2 * Math.PI * step) / 24), step === 50_001 ? 7 : 0));
    const [time, wave, once] = columns(many, { id: 1, curves: [first, second] }) as number[][];
    expect(time.length).toBeLessThan(3500);
    expect(time).toEqual([...time].sort((one, other) => one - other));
    for (let i = 0; i + 100 < wave.length; i += 100) {
      expect(Math.max(...wave.slice(i, i + 100))).toBe(1);
      expect(Math.min(...wave.slice(i, i + 100))).toBe(-1);
    }
    expect(Math.max(...once)).toBe(7);
  });

  test('from near by has all samples of that time, and those beside it', () => {
    const many = Array.from({ length: 100_000 }, (_, step) => sample(step, few, step));
    const [time] = columns(many, { id: 1, curves: [first] }, [500.05, 510]);
    expect([time.length, time[0], time.at(-1)]).toEqual([102, 500, 510.1]);
    expect(columns(many, { id: 1, curves: [first] }, [-2, -1])[0]).toEqual([0]);
  });

  test('has dots where no line joins its points', () => {
    const data: [number[], ...(number | null)[][]] = [[0, 1, 2, 3, 4], [7, null, 3, 4, null], [null, null, null, null, 1], [1, 2, 3, 4, 5]];
    expect([1, 2, 3].map((series) => alone({ data }, series))).toEqual([[0], [4], null]);
  });

  test('of very large or very small numbers has an axis that counts in a power of ten', () => {
    expect([[1, -5e15], [0, null], [1e15], [-3e-13, 1e-14], [1.7e308], [5e-324]].map((values) => powerOf([values]))).toEqual([15, 0, 0, -13, 308, -324]);
    expect([without(308, 1.7e308), without(-324, 5e-324), without(-13, -3e-13), without(0, 7)]).toEqual([1.7, 4.94, -3, 7].map((value) => expect.closeTo(value, 2)));
  });
});
