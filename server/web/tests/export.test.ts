import { describe, expect, test } from 'vitest';
import { csv, fileName, recordingPage, store, unstore } from '../src/export';
import { finish } from '../src/geometry';
import type { Model, VariableInfo } from '../src/model';
import { Layout, Recording, valueOf } from '../src/recording';
import { Signal } from '../src/signal';

const X: VariableInfo = { handle: 4, name: 'node.structural.2.X', size: 3, unit: 'm', frame: 'global', kind: 'state', description: '', owner: '' };
const E: VariableInfo = { handle: 9, name: 'body.2.E', size: 1, unit: 'J', frame: '', kind: 'output', description: '', owner: '' };
const model: Model = { title: '</script><b>', digest: 'ab', unknowns: 3, initialTime: 0, finalTime: Infinity, step: 0.1, nodes: [], elements: [], variables: [X, E], parameters: [] };

function shown() {
  const recording = new Recording();
  const first = new Layout([X]), both = new Layout([X, E]);
  recording.push({ step: 0, time: 0, layout: first, values: Float64Array.of(1, 2, 3) });
  recording.push({ step: 5, time: 0.5, layout: both, values: Float64Array.of(4, 5, 6, 0.25) });
  const geometry = finish([{ label: 2, kind: 'dynamic', name: '', position: [0, 0, 0], positionHandle: 4 }], [], []);
  return { title: 'a, b', model, geometry, recording, changed: new Signal(0) };
}

describe('a table', () => {
  test('has names, units and a gap where nothing was seen', () => {
    const plots = [{ id: 1, curves: [{ variable: X, element: 1 }, { variable: E, element: 0 }] }];
    expect(csv(shown().recording.samples, plots)).toBe('step,time [s],node.structural.2.X.y [m],body.2.E [J]\n0,0,2,\n5,0.5,5,0.25\n');
  });
});

test('a file has the name of what it shows, as far as names of files go', () => {
  expect([fileName('Träger <b>/1</b>.mbd', 'csv'), fileName('机械臂', 'png')]).toEqual(['Träger_b_1_b_.mbd.csv', '机械臂.png']);
});

describe('a recording in a file', () => {
  test('gives back what was seen', () => {
    const again = unstore(store(shown()));
    expect(again.title).toBe('a, b');
    expect(again.model.finalTime).toBe(Infinity);
    expect(again.geometry.nodes[0].label).toBe(2);
    expect(again.recording.samples.map((sample) => [sample.step, sample.time])).toEqual([[0, 0], [5, 0.5]]);
    expect(valueOf(again.recording.samples[1], 4, 2)).toBe(6);
    expect(valueOf(again.recording.samples[1], 9)).toBe(0.25);
    expect(valueOf(again.recording.samples[0], 9)).toBeNaN();
  });

  test('keeps small changes of large numbers, tiny and infinite ones, and names that look like them', () => {
    const recording = new Recording(), layout = new Layout([X, E]);
    const values = [[NaN, 4e5, 1e-300, Infinity], [1, 4e5 + 0.001, 2e-300, -1]];
    values.forEach((row, step) => recording.push({ step, time: 1e6 + step, layout, values: Float64Array.from(row) }));
    const { recording: again, title } = unstore(store({ ...shown(), title: '∞', recording }));
    expect(title).toBe('∞');
    expect(Array.from(again.samples[0].values)).toEqual(values[0]);
    expect(Array.from(again.samples[1].values)).toEqual(values[1]);
    expect(again.samples[1].time).toBe(1000001);
  });

  test('has fewer samples of very many, with the first and the newest', () => {
    const recording = new Recording(), layout = new Layout([X]);
    for (let step = 0; step < 1000; ++step) recording.push({ step, time: step, layout, values: Float64Array.of(step, 0, 0) });
    const { samples } = unstore(store({ ...shown(), recording }, 2400)).recording;
    expect(samples.length).toBeLessThan(105);
    expect(samples.map((sample) => valueOf(sample, 4))).toEqual(samples.map((sample) => sample.step));
    expect([samples[0].step, samples.at(-1)?.step]).toEqual([0, 999]);
  });

  test('cannot break out of its place in the page', () => {
    const page = recordingPage('<body><!-- recording --></body>', shown());
    expect(page.match(/<\/script>/g)).toHaveLength(1);
    expect(() => recordingPage('<body></body>', shown())).toThrow('no place');
  });

  test('of something else is refused', () => {
    expect(() => unstore('{"format": "other"}')).toThrow('no recording');
  });
});
