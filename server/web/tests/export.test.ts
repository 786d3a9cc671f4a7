import { describe, expect, test } from 'vitest';
import { csv, recordingPage, store, unstore } from '../src/export';
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

  test('cannot break out of its place in the page', () => {
    const page = recordingPage('<body><!-- recording --></body>', shown());
    expect(page.match(/<\/script>/g)).toHaveLength(1);
    expect(() => recordingPage('<body></body>', shown())).toThrow('no place');
  });

  test('of something else is refused', () => {
    expect(() => unstore('{"format": "other"}')).toThrow('no recording');
  });
});
