import { expect, test } from 'vitest';
import { Pace } from '../src/pace';

test('steps are due by the wall clock', () => {
  const pace = new Pace(2, 100, 1);
  expect(pace.next(100.01, 1, 0.1)).toBeUndefined();
  expect(pace.next(100.05, 1, 0.1)).toBeCloseTo(1.1, 12);
});

test('a simulation that is too slow is not chased', () => {
  const pace = new Pace(1, 0, 0);
  expect(pace.next(10, 0.5, 0.01)).toBeCloseTo(0.6, 12);
  expect(pace.next(10.05, 0.6, 0.01)).toBeCloseTo(0.65, 12);
});

test('a tab that the browser held up makes up for it, but not for the sleep of a machine', () => {
  const pace = new Pace(2, 0, 0);
  expect(pace.next(1, 0, 0.01, 1)).toBeCloseTo(2, 12);
  expect(pace.next(61, 2, 0.01, 60)).toBeCloseTo(122, 12);
  expect(pace.next(7261, 122, 0.01, 7200)).toBeCloseTo(122 + 122, 12);
});

test('one that others took on goes on from there', () => {
  const pace = new Pace(1, 0, 0);
  expect(pace.next(0.1, 50, 0.01)).toBeUndefined();
  expect(pace.next(0.2, 50, 0.01)).toBeCloseTo(50.1, 12);
});
