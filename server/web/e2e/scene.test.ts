import type { Browser, Page } from 'playwright-core';
import { afterAll, beforeAll, describe, expect, test } from 'vitest';
import { atStep, create, decks, flexiblePoints, inView, launch, picture, scene, turnTo, withPage } from './bench';

let browser: Browser;
beforeAll(async () => {
  browser = await launch();
});
afterAll(() => browser?.close());

type Picture = Awaited<ReturnType<typeof picture>>;

/** The first picture that is as wanted; after some seconds, whatever there is. */
async function settled(page: Page, wanted: (seen: Picture) => boolean): Promise<Picture> {
  const end = Date.now() + 20_000;
  let seen = await picture(page);
  while (!wanted(seen) && Date.now() < end) seen = await picture(page);
  return seen;
}

describe('the first view', () => {
  test('shows every example deck whole', async () => {
    await withPage(browser, 'pendulum.mbd', async ({ page }, view) => {
      for (const deck of decks()) {
        const simulation = await create(view, deck);
        await turnTo(page, simulation);
        expect(await inView(page), deck).toBe(true);
        await turnTo(page, view.simulation);
        await view.call('Simulations/DeleteSimulation', { simulation });
      }
    });
  });
});

describe('another simulation in the same picture', () => {
  test('is named, lies over nothing else, and goes when it is told to', async () => {
    await withPage(browser, 'pendulum.mbd', async ({ page }, view) => {
      const { simulation } = await view.call<{ simulation: { name: string } }>('Simulations/ForkSimulation', { simulation: view.simulation, options: { displayName: 'other' } });
      await view.call('Simulations/Step', { simulation: simulation.name, steps: 60 });
      const alone = await picture(page);
      await page.getByRole('tab', { name: 'Simulations' }).click();
      await page.getByRole('button', { name: 'Compare with other' }).click();
      await page.getByText('pale: other').waitFor();
      const both = await settled(page, ({ covered }) => covered > alone.covered);
      expect(both.covered).toBeGreaterThan(alone.covered);
      expect(both.covered).toBeLessThan(1.5 * alone.covered + 0.05);
      await page.getByRole('button', { name: 'Compare no more' }).click();
      expect(await settled(page, ({ covered }) => covered === alone.covered)).toEqual(alone);
    });
  });
});

describe('a flexible body', () => {
  test('is drawn with its deformation as many times as large as it is asked for, and says what its colours mean', async () => {
    await withPage(browser, 'modal_body.mbd', async ({ page }) => {
      const straight = await flexiblePoints(page);
      for (let k = 0; k < 3; ++k) await page.getByRole('button', { name: '+10' }).click().then(() => atStep(page, 10 * (k + 1)));
      await scene(page);
      const once = await flexiblePoints(page);
      await page.getByRole('button', { name: 'Show' }).click();
      await page.getByRole('slider', { name: 'Deformation scale' }).fill('1');
      await scene(page);
      const tenfold = await flexiblePoints(page), size = Math.max(...once.map((x, i) => Math.abs(x - straight[i])));
      expect(size).toBeGreaterThan(1e-4);
      const reached = Math.max(...tenfold.map((x, i) => Math.abs(x - straight[i])));
      expect(reached / size).toBeGreaterThan(5);
      await page.locator('.hud .scale', { hasText: /^deformation0[\d.e−]+$/ }).waitFor();
    });
  });
});

describe('pressures', () => {
  test('are colours whose ends are told', async () => {
    await withPage(browser, 'actuated_beam.mbd', async ({ page }) => {
      await page.getByRole('button', { name: '+10' }).click();
      await atStep(page, 10);
      const scale = page.locator('.hud .scale', { hasText: 'pressure' });
      await scale.waitFor();
      const [, low, high] = /^pressure(101\d{3})(101\d{3})$/.exec((await scale.textContent()) ?? '') ?? [];
      expect(Number(low)).toBeLessThan(Number(high));
    });
  });
});
