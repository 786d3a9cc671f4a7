import { describe, expect, test } from 'vitest';
import { Layout, Recording, valueOf, type Sample } from '../src/recording';

const layout = new Layout([{ handle: 7, size: 3 }, { handle: 2, size: 1 }, { handle: 7, size: 3 }]);

function sample(step: number, time = step / 10): Sample {
  return { step, time, layout, values: Float64Array.of(step, 2 * step, 3 * step, -step) };
}

describe('a layout', () => {
  test('tells where each variable stands, once', () => {
    expect(layout.handles).toEqual([7, 2]);
    expect(layout.width).toBe(4);
    expect(valueOf(sample(5), 7, 1)).toBe(10);
    expect(valueOf(sample(5), 2)).toBe(-5);
    expect(valueOf(sample(5), 99)).toBeNaN();
  });
});

describe('a recording', () => {
  test('finds the last sample at or before a time', () => {
    const recording = new Recording();
    expect(recording.indexAt(1)).toBe(-1);
    for (let step = 0; step < 50; ++step) recording.push(sample(step));
    expect(recording.indexAt(-1)).toBe(0);
    expect(recording.indexAt(1.05)).toBe(10);
    expect(recording.indexAt(1.1)).toBe(11);
    expect(recording.indexAt(99)).toBe(49);
  });

  test('forgets what an earlier step undoes', () => {
    const recording = new Recording();
    for (let step = 0; step <= 20; ++step) recording.push(sample(step));
    recording.push({ ...sample(5), values: Float64Array.of(1, 1, 1, 1) });
    expect(recording.samples.map((kept) => kept.step)).toEqual([0, 1, 2, 3, 4, 5]);
    expect(valueOf(recording.samples[5], 2)).toBe(1);
  });

  test('puts a late sample in its place', () => {
    const recording = new Recording();
    for (const step of [0, 4, 8]) recording.push(sample(step));
    recording.insert(sample(2));
    recording.insert(sample(9));
    recording.insert({ ...sample(4), values: Float64Array.of(7, 7, 7, 7) });
    expect(recording.samples.map((kept) => kept.step)).toEqual([0, 2, 4, 8, 9]);
    expect(valueOf(recording.samples[2], 2)).toBe(7);
  });

  test('keeps within its budget, evenly, with the first and the newest sample', () => {
    const recording = new Recording(100 * 272);
    for (let step = 0; step < 10_000; ++step) {
      recording.push(sample(step));
      expect(recording.samples.length).toBeLessThanOrEqual(100);
    }
    const steps = recording.samples.map((kept) => kept.step);
    expect(steps[0]).toBe(0);
    expect(steps[steps.length - 1]).toBe(9999);
    const gaps = steps.slice(1, -1).map((step, i) => step - steps[i]);
    expect(Math.max(...gaps) / Math.min(...gaps)).toBeLessThanOrEqual(2);
  });

  test('of hours, with very many small samples, keeps within its budget', () => {
    const recording = new Recording(), values = new Float64Array(4);
    let most = 0;
    for (let step = 0; step < 700_000; ++step) {
      recording.push({ step, time: step, layout, values });
      most = Math.max(most, recording.samples.length);
    }
    expect(most).toBeLessThan(600_000);
    const { samples } = recording;
    expect([samples[0].step, samples[1].step, samples.at(-1)?.step]).toEqual([0, 2, 699_999]);
  });
});
