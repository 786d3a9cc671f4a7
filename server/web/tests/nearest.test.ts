import { expect, test } from 'vitest';
import { joins } from '../src/nearest';

test('points in a row are joined one after the other', () => {
  const pairs = joins([0, 0, 0, 1, 0, 0, 2, 0, 0, 3.1, 0, 0]);
  for (const pair of [[0, 1], [1, 2], [2, 3]]) expect(pairs).toContainEqual(pair);
  expect(pairs).not.toContainEqual([0, 3]);
});

test('two heaps of points hang together by one line', () => {
  const heap = (x: number) => [x, 0, 0, x + 1, 0, 0, x, 1, 0, x + 1, 1, 0];
  const between = joins([...heap(0), ...heap(50)]).filter(([a, b]) => a < 4 !== b < 4);
  expect(between.length).toBe(1);
});

test('nothing is joined where there is one point, or too many', () => {
  expect(joins([1, 2, 3])).toEqual([]);
  expect(joins(new Float64Array(30), 9)).toEqual([]);
});
