import { describe, expect, test } from 'vitest';
import { evenly, matches, namedIn, otherParts, partOf, shortName, variableNamed, variablesByPart, type Model } from '../src/model';
import { bytes, clock, curveName, editable, number, numberOf, seconds, ticks, unitOf } from '../src/format';
import { Pace } from '../src/pace';
import { jointGlyph } from '../src/scene/glyphs';
import { linesAround, marked } from '../src/panels/diagnostics';
import { timeSplit } from '../src/panels/solver';

describe('names of variables', () => {
  test.each([
    ['joint.7.Fx', 'joint:7', 'Fx'],
    ['node.structural.2.X', 'node.structural:2', 'X'],
    ['joint.10.x[1003,1]', 'joint:10', 'x[1003,1]'],
    ['time', '', 'time'],
    ['drive.-4.value', 'drive:-4', 'value'],
    ['node.abstract.12', 'node.abstract:12', ''],
    ['plugin.v2.3a', '', 'plugin.v2.3a'],
  ])('%s belongs to %s', (name, part, short) => {
    expect(partOf(name)).toBe(part);
    expect(shortName(name)).toBe(short);
  });

  test('are found by words in any order', () => {
    expect(matches('joint.7.Fx revolute hinge', 'HINGE fx')).toBe(true);
    expect(matches('joint.7.Fx revolute hinge', 'hinge fy')).toBe(false);
  });
});

describe('a card of the deck', () => {
  test('is shown without the indentation of its file', () => {
    expect(evenly('body: 3, 1,\n      2., null,\n\n    eye;', 3)).toBe('body: 3, 1,\n    2., null,\n\n  eye;');
    expect(evenly('body: 3,\n 1;', 5)).toBe('body: 3,\n1;');
    expect(evenly('body: 3;', 9)).toBe('body: 3;');
  });

  test('names variables of the deck, not those in comments and strings', () => {
    const parameters = ['L', 'm', 'EJ', 'x'].map((name) => ({ name, value: '1' }));
    const card = { place: 'a.mbd:1:1', text: 'body: 3, 1, 2*m, /* EJ */ reference, node, L/2., # x\n "string, x", eye;', cut: false };
    expect(namedIn(card, parameters).map(({ name }) => name)).toEqual(['L', 'm']);
  });
});

test('drives stand in the tree, since variables belong to them', () => {
  const variable = (name: string) => ({ handle: 0, name, size: 1, unit: '', frame: '', kind: 'output' as const, description: '', owner: '' });
  const part = { id: 'joint:7', family: 'joint', type: 'clamp', label: 7, name: '' };
  const model = { nodes: [], elements: [part], variables: ['time', 'joint.7.Fx', 'drive.4.value'].map(variable) } as unknown as Model;
  expect(otherParts(model)).toEqual([{ id: 'drive:4', family: 'drive', type: 'drive caller', label: 4, name: '' }]);
  expect([...variablesByPart(model.variables).keys()]).toEqual(['', 'joint:7', 'drive:4']);
  expect(['joint.7.Fx', 'time', 'joint.7.Fy', 'joint.8.Fx'].map((name) => variableNamed(model.variables, name)?.name)).toEqual(['joint.7.Fx', 'time', undefined, undefined]);
  expect(variablesByPart(model.variables)).toBe(variablesByPart(model.variables));  // those of a large model are sorted once
});

describe('numbers', () => {
  test.each([[0, '0'], [1.5, '1.5'], [-2, '−2'], [1e-7, '1e−7'], [1234567, '1.2346e+6'], [NaN, '–'], [Infinity, '∞'], [0.1 + 0.2, '0.3'], [100, '100']])('%f is %s', (value, text) => {
    expect(number(value)).toBe(text);
  });

  test.each([['1.5', 1.5], [' -2e-3 ', -0.002], ['−4', -4], ['.5', 0.5], ['+7.', 7], ['1E3', 1000]])('are read from %s', (text, value) => {
    expect(numberOf(text)).toBe(value);
    expect(numberOf(editable(value, 6))).toBe(value);
  });

  test.each(['1,5', '1 000', '1.5.5', '0x10', '1e400', '', '-', 'abc', 'Infinity'])('are not guessed from "%s"', (text) => expect(numberOf(text)).toBeNaN());

  test('of forces and moments have their own units', () => {
    const load = { unit: 'N, N m', size: 6 };
    expect([0, 2, 3, 5].map((element) => unitOf(load, element))).toEqual(['N', 'N', 'N m', 'N m']);
    expect([unitOf({ unit: 'm', size: 3 }, 2), unitOf({ unit: '', size: 1 }, 0)]).toEqual(['m', '']);
  });

  test('beside an axis differ, however far from zero they are', () => {
    expect(ticks([1000.001, 1000.002, 1000.003], 0.001)).toEqual(['1000.001', '1000.002', '1000.003']);
    expect(ticks([1234567.25, 1234567.5], 0.25)).toEqual(['1234567.25', '1234567.5']);
    expect(ticks([0, 0.2, 0.4], 0.2)).toEqual(['0', '0.2', '0.4']);
    expect(ticks([0, 2e-300], 2e-300)).toEqual(['0', '2e−300']);
    expect(ticks([0, 5e9], 5e9)).toEqual(['0', '5e+9']);
    expect(ticks([-2, 0, 0.5, 20], 0.5, 308)).toEqual(['−2e+308', '0', '5e+307', '2e+309']);
    expect(ticks([9.5, 10, 10.5], 0.5, -18)).toEqual(['9.5e−18', '1e−17', '1.05e−17']);
  });

  test('of time differ from step to step', () => {
    expect([clock(123456.789, 0.001), clock(1234567.001, 0.001), clock(0.1 + 0.2, 0.01), clock(3e-9, 1e-9), clock(0, 0.1)]).toEqual(['123456.789 s', '1234567.001 s', '0.3 s', '3e−9 s', '0 s']);
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

test('lines around a place are those of the deck, as far as there are any', () => {
  expect(linesAround(['a', 'b', 'c', 'd', 'e', 'f'], 2)).toEqual({ before: [[1, 'a']], after: [[3, 'c'], [4, 'd'], [5, 'e']] });
  expect(linesAround(['a', 'b'], 2)).toEqual({ before: [[1, 'a']], after: [] });
});

test('the parts of the wall time sum to one', () => {
  const step = { step: 1, time: 0, iterations: 2, residual: 0, steps: 1 };
  expect(timeSplit([{ ...step, solver: 1, peers: 2, total: 4, elapsed: 8 }])).toEqual([0.125, 0.25, 0.125, 0.5]);
  expect(timeSplit([])).toEqual([0, 0, 0, 0]);
});
