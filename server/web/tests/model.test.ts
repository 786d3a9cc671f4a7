import { describe, expect, test } from 'vitest';
import { matches, partOf, shortName } from '../src/model';
import { bytes, curveName, number, seconds } from '../src/format';
import { Pace } from '../src/pace';
import { jointGlyph } from '../src/scene/glyphs';
import { marked } from '../src/panels/diagnostics';
import { timeSplit } from '../src/panels/solver';

describe('names of variables', () => {
  test.each([
    ['joint.7.Fx', 'joint:7', 'Fx'],
    ['node.structural.2.X', 'node.structural:2', 'X'],
    ['joint.10.x[1003,1]', 'joint:10', 'x[1003,1]'],
    ['time', '', 'time'],
    ['drive.-4.value', 'drive:-4', 'value'],
  ])('%s belongs to %s', (name, part, short) => {
    expect(partOf(name)).toBe(part);
    expect(shortName(name)).toBe(short);
  });

  test('are found by words in any order', () => {
    expect(matches('joint.7.Fx revolute hinge', 'HINGE fx')).toBe(true);
    expect(matches('joint.7.Fx revolute hinge', 'hinge fy')).toBe(false);
  });
});

describe('numbers', () => {
  test.each([[0, '0'], [1.5, '1.5'], [-2, '−2'], [1e-7, '1e−7'], [1234567, '1.2346e+6'], [NaN, '–'], [Infinity, '∞'], [0.1 + 0.2, '0.3'], [100, '100']])('%f is %s', (value, text) => {
    expect(number(value)).toBe(text);
  });

  test('have the unit that fits', () => {
    expect([seconds(2.5e-5), seconds(0.02), seconds(3)]).toEqual(['25 µs', '20 ms', '3 s']);
    expect([bytes(10), bytes(2048), bytes(5 * 1024 * 1024)]).toEqual(['10 B', '2 KiB', '5 MiB']);
    expect([curveName('X', 3, 1), curveName('E', 1, 0), curveName('q', 12, 4)]).toEqual(['X.y', 'E', 'q.5']);
  });
});

describe('the pace', () => {
  test('follows the wall clock at its speed', () => {
    const pace = new Pace(2, 100, 5);
    expect(pace.next(100, 5, 0.01)).toBeUndefined();
    expect(pace.next(100.02, 5, 0.01)).toBeCloseTo(5.04, 12);
  });

  test('steps at least once when a step is due', () => {
    const pace = new Pace(1, 0, 0);
    expect(pace.next(0.4, 0, 1)).toBeUndefined();
    expect(pace.next(0.6, 0, 1)).toBeCloseTo(1, 12);
  });

  test('does not chase a simulation that is too slow', () => {
    const pace = new Pace(1, 0, 0);
    expect(pace.next(10, 0, 0.01)).toBeCloseTo(0.1, 12);
    expect(pace.next(10.05, 0.1, 0.01)).toBeCloseTo(0.15, 12);
  });
});

test('joints are drawn by kind', () => {
  expect(['revolute hinge', 'spherical hinge', 'clamp', 'prismatic', 'total joint', 'cardano hinge', 'deformable hinge', 'drive hinge', 'something new'].map(jointGlyph))
    .toEqual(['hinge', 'ball', 'clamp', 'slider', 'octahedron', 'cross', 'spring', 'drive', 'octahedron']);
});

test('a mark in a line counts bytes, not letters', () => {
  expect(marked('joint: 2, sperical hinge,', 11, 14)).toEqual(['joint: 2, ', 'sperical hinge', ',']);
  expect(marked('# é; bad', 6, 3)).toEqual(['# é;', ' ba', 'd']);
  expect(marked('', 9, 3)).toEqual(['', '', '']);
});

test('the parts of the wall time sum to one', () => {
  const step = { step: 1, time: 0, iterations: 2, residual: 0, steps: 1 };
  expect(timeSplit([{ ...step, solver: 1, peers: 2, total: 4 }])).toEqual([0.25, 0.5, 0.25]);
  expect(timeSplit([])).toEqual([0, 0, 0]);
});
