import { describe, expect, test } from 'vitest';
import { isSoftware, Quality } from '../src/scene/quality';

/** Pictures that take `cost` milliseconds, one after the other. */
function frames(quality: Quality, count: number, cost: number, from = 0): number {
  for (let i = 0; i < count; ++i) quality.took(from + i * cost, from + (i + 1) * cost);
  return from + count * cost;
}

describe('the fineness of the picture', () => {
  test('falls while frames are slow, to the coarsest, and no further', () => {
    const quality = new Quality([2, 1, 0.5], 2);
    expect(quality.ratio).toBe(2);
    frames(quality, 4, 50);
    expect(quality.ratio).toBe(1);
    frames(quality, 100, 50);
    expect(quality.ratio).toBe(0.5);
  });

  test('is not lowered by single slow frames', () => {
    const quality = new Quality([2, 1], 2);
    for (let i = 0; i < 20; ++i) frames(quality, 1, i % 3 ? 60 : 16);
    expect(quality.ratio).toBe(2);
  });

  test('rises again after many fast frames, later each time that it was too much', () => {
    const quality = new Quality([2, 1], 2);
    frames(quality, 4, 50);
    frames(quality, 179, 16);
    expect(quality.ratio).toBe(1);
    frames(quality, 1, 16);
    expect(quality.ratio).toBe(2);
    frames(quality, 4, 50);
    frames(quality, 359, 16);
    expect(quality.ratio).toBe(1);
  });

  test('is full once nothing has moved for a while', () => {
    const quality = new Quality([1], 2), last = frames(quality, 3, 16);
    expect(quality.rests(last + 100)).toBe(false);
    expect(quality.rests(last + 1000)).toBe(true);
  });
});

test('a program in place of a graphics card is known by its name', () => {
  expect(isSoftware('ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device (Subzero) (0x0000C0DE)), SwiftShader driver)')).toBe(true);
  expect(isSoftware('llvmpipe (LLVM 15.0.6, 256 bits)')).toBe(true);
  expect(isSoftware('ANGLE (Intel, Mesa Intel(R) UHD Graphics 620 (KBL GT2), OpenGL 4.6)')).toBe(false);
});
