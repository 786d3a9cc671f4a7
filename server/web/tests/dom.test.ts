import { afterEach, expect, test, vi } from 'vitest';
import { oncePerFrame } from '../src/dom';

afterEach(() => vi.unstubAllGlobals());

test('what is drawn once per frame is drawn once, however often it is asked for, and again when it is asked for later', () => {
  const frames: (() => void)[] = [];
  vi.stubGlobal('requestAnimationFrame', (work: () => void) => frames.push(work));
  let drawn = 0;
  const draw = oncePerFrame(() => (drawn += 1));
  expect([draw(), draw(), draw(), drawn]).toEqual([true, false, false, 0]);
  frames.splice(0).forEach((work) => work());
  expect([drawn, frames.length, draw()]).toEqual([1, 0, true]);
  frames.splice(0).forEach((work) => work());
  expect([drawn, frames.length]).toEqual([2, 0]);
});
