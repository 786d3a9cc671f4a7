import type { Browser, Page } from 'playwright-core';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { afterAll, beforeAll, describe, expect, test } from 'vitest';
import { atStep, launch, placeOf, recorded, recordedPath, rested, scene, trails, until, withPage } from './bench';

let browser: Browser;
beforeAll(async () => {
  browser = await launch();
});
afterAll(() => browser?.close());

/** Bodies that fly through space, each in another direction. */
const FREE = `begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 10.; time step: 0.01; method: ms, 0.6; tolerance: 1.e-8; max iterations: 10; end: initial value;
begin: control data; structural nodes: 4; rigid bodies: 4; end: control data;
begin: nodes;
  structural: 1, dynamic, 0., 0., 0., eye, 0.1, 0., 0., 0., 0., 1.;
  structural: 2, dynamic, 1., 0.2, 0.5, eye, 0., 0.3, 0., 1., 0., 0.;
  structural: 3, dynamic, 0.3, 1., 0.7, eye, 0., 0., 0.2, 0., 2., 0.;
  structural: 4, dynamic, -0.5, 0.4, 1.1, eye, -0.2, 0., 0.1, 0., 0., 0.;
end: nodes;
begin: elements;
  body: 1, 1, 1., null, diag, .001, .002, .003; body: 2, 2, 1., null, diag, .001, .002, .003;
  body: 3, 3, 1., null, diag, .001, .002, .003; body: 4, 4, 1., null, diag, .001, .002, .003;
end: elements;
`;
let folder: string, free: string;
beforeAll(() => {
  folder = mkdtempSync(join(tmpdir(), 'mbcosim-'));
  free = join(folder, 'free.mbd');
  writeFileSync(free, FREE);
});
afterAll(() => rmSync(folder, { recursive: true }));

async function pick(page: Page, name: string): Promise<void> {
  await page.getByRole('treeitem', { name, exact: true }).click();
  await page.locator('.right .section').first().getByText(name).first().waitFor();
}

/** So many steps, one after the other, so that the page sees each. */
async function stepSlowly(page: Page, from: number, count: number): Promise<void> {
  for (let step = from + 1; step <= from + count; ++step) {
    await page.keyboard.press('s');
    await atStep(page, step);
  }
}

async function placesOf(page: Page, labels: number[]) {
  await scene(page);  // what was asked for is drawn
  return Promise.all(labels.map((label) => placeOf(page, label)));
}

describe('a trail', () => {
  test('is the path that the page has seen the node go, and goes with another touch of the key', async () => {
    await withPage(browser, 'pendulum.mbd', async ({ page }) => {
      await pick(page, 'dynamic node 2');
      await page.getByRole('button', { name: 'Trail' }).click();
      await stepSlowly(page, 0, 6);
      await scene(page);
      const path = await recordedPath(page, 'node.structural.2.X'), drawn = await trails(page);
      expect(path.length).toBeGreaterThanOrEqual(3 * 7);
      const pieces = Array.from({ length: path.length / 3 - 1 }, (_, i) => path.slice(3 * i, 3 * i + 6)).flat();
      expect(drawn.length).toBe(pieces.length);
      drawn.forEach((x, i) => expect(x).toBeCloseTo(pieces[i], 5));
      await page.keyboard.press('t');
      await scene(page);
      expect(await trails(page)).toEqual([]);
    });
  });
});

describe('a node that is followed', () => {
  test('stays where it is in the picture, and moves when it is followed no more', async () => {
    await withPage(browser, 'pendulum.mbd', async ({ page }) => {
      await pick(page, 'dynamic node 2');
      const follow = page.getByRole('button', { name: 'Follow the selected node (F)' });
      await page.keyboard.press('f');
      expect(await follow.getAttribute('aria-pressed')).toBe('true');
      const [before] = await placesOf(page, [2]);
      for (let ten = 1; ten <= 4; ++ten) await page.getByRole('button', { name: '+10' }).click().then(() => atStep(page, 10 * ten));
      const [after, fixed] = await placesOf(page, [2, 1]);
      expect(Math.hypot(after.x - before.x, after.y - before.y)).toBeLessThan(1);
      await follow.click();
      expect(await follow.getAttribute('aria-pressed')).toBe('false');
      await page.getByRole('button', { name: '+10' }).click();
      await atStep(page, 50);
      const [moved, stays] = await placesOf(page, [2, 1]);
      expect(Math.hypot(moved.x - after.x, moved.y - after.y)).toBeGreaterThan(5);
      expect(Math.hypot(stays.x - fixed.x, stays.y - fixed.y)).toBeLessThan(1);
    });
  });
});

describe('a parallel view along an axis', () => {
  test.each([
    { key: '1', across: 0, up: 2 },
    { key: '2', across: 1, up: 2 },
    { key: '3', across: 0, up: 1 },
  ])('$key shows lengths as they are', async ({ key, across, up }) => {
    await withPage(browser, free, async ({ page }) => {
      await page.keyboard.press(key);
      await page.keyboard.press('o');
      expect(await page.getByRole('button', { name: 'ortho' }).getAttribute('aria-pressed')).toBe('true');
      for (let ten = 1; ten <= 3; ++ten) await page.getByRole('button', { name: '+10' }).click().then(() => atStep(page, 10 * ten));
      const { nodes } = await scene(page), labels = Object.keys(nodes).map(Number);
      const places = await placesOf(page, labels), x = labels.map((label) => nodes[label].slice(12, 15));
      const first = 0, far = labels.findIndex((_, i) => Math.hypot(x[i][across] - x[first][across], x[i][up] - x[first][up]) > 0.1);
      expect(far).toBeGreaterThan(0);
      const scale = Math.hypot(places[far].x - places[first].x, places[far].y - places[first].y) / Math.hypot(x[far][across] - x[first][across], x[far][up] - x[first][up]);
      labels.forEach((_, i) => {
        expect(places[i].x - places[first].x).toBeCloseTo(scale * (x[i][across] - x[first][across]), 1);
        expect(places[first].y - places[i].y).toBeCloseTo(scale * (x[i][up] - x[first][up]), 1);
      });
    });
  });

  test('has the size of the other projection where the camera looks, also after zooming', async () => {
    await withPage(browser, 'pendulum.mbd', async ({ page }) => {
      await page.keyboard.press('1');
      await page.locator('.scene canvas').focus();
      for (let i = 0; i < 3; ++i) await page.keyboard.press('+');
      const gap = async () => {
        const [a, b] = await placesOf(page, [1, 2]);
        return Math.hypot(a.x - b.x, a.y - b.y);
      };
      const before = await gap();
      await page.getByRole('button', { name: 'ortho' }).click();
      expect((await gap()) / before).toBeCloseTo(1, 2);  // both nodes are in the plane through the target
      await page.locator('.scene canvas').focus();
      for (let i = 0; i < 2; ++i) await page.keyboard.press('-');
      const smaller = await gap();
      expect(smaller).toBeLessThan(0.8 * before);
      await page.getByRole('button', { name: 'ortho' }).click();
      expect((await gap()) / smaller).toBeCloseTo(1, 2);
    });
  });
});

describe('what is picked', () => {
  test.each(['perspective', 'parallel'])('is looked at from near by, in the middle of the picture: %s', async (projection) => {
    await withPage(browser, free, async ({ page }) => {
      if (projection === 'parallel') await page.keyboard.press('o');
      await page.keyboard.press('h');
      const labels = Object.keys((await scene(page)).nodes).map(Number), last = labels[labels.length - 1], before = labels[labels.length - 2];
      const [a, b] = await placesOf(page, [before, last]);
      await pick(page, `dynamic node ${last}`);
      await page.getByRole('button', { name: 'Look at it from near by (Z)' }).click();
      const [c, d] = await placesOf(page, [before, last]);
      expect(Math.abs(d.across) + Math.abs(d.up)).toBeLessThan(1e-3);
      expect(Math.hypot(c.x - d.x, c.y - d.y)).toBeGreaterThan(1.5 * Math.hypot(a.x - b.x, a.y - b.y));
      await page.keyboard.press('h');
      const [again] = await placesOf(page, [last]);
      expect(again.x).toBeCloseTo(b.x, 0);
    });
  });
});

describe('speed', () => {
  /** Wall clock and model's time, seconds, as the page has them. */
  const clocks = (page: Page) => page.evaluate(() => ({ wall: performance.now() / 1000, time: (window as unknown as { mbcosim: { desk: { sample: { time: number } } } }).mbcosim.desk.sample.time }));
  const reaches = (page: Page, time: number) =>
    until(page, (wanted) => (window as unknown as { mbcosim: { desk: { sample: { time: number } } } }).mbcosim.desk.sample.time >= wanted, time);

  test('is that of the wall clock times what was chosen, at most', async () => {
    await withPage(browser, 'chain.mbd', async ({ page }) => {
      for (const speed of [0.1, 1]) {
        await page.getByRole('combobox', { name: 'Speed' }).selectOption(String(speed));
        const from = await clocks(page);
        await page.getByRole('button', { name: 'Run (space)' }).click();
        await reaches(page, from.time + speed);
        const to = await clocks(page);
        await page.getByRole('button', { name: 'Pause (space)' }).click();
        await rested(page);
        expect(to.time - from.time).toBeLessThan(speed * (to.wall - from.wall) + 0.002);  // two steps
      }
    });
  });

  test('without a bound reaches the end before the wall clock does, and the page takes few of the steps', async () => {
    const end = 200, long = join(folder, 'long.mbd');
    writeFileSync(long, FREE.replace('final time: 10.', `final time: ${end}.`));
    await withPage(browser, long, async ({ page }, view) => {
      const start = performance.now();
      await page.getByRole('combobox', { name: 'Speed' }).selectOption('Infinity');
      await page.getByRole('button', { name: 'Run (space)' }).click();
      await page.locator('.chip', { hasText: 'finished' }).waitFor();
      const taken = (performance.now() - start) / 1000;
      expect(taken).toBeLessThan(end);
      expect((await view.read([])).time).toBeCloseTo(end, 6);
      await reaches(page, end - 1e-6);
      expect((await recorded(page)).length).toBeLessThan(120 * taken + 10);
      await page.getByRole('button', { name: 'Back to the start' }).click();
      await atStep(page, 0);
      await page.locator('.chip', { hasText: 'ready' }).waitFor();
      expect(await page.getByRole('button', { name: 'Run (space)' }).isEnabled()).toBe(true);
    });
  });
});
