import type { Browser } from 'playwright-core';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { afterAll, beforeAll, describe, expect, test } from 'vitest';
import { flexiblePoints, launch, MODELS, placeOf, scene, shown, visit, withPage } from './bench';

let browser: Browser;
beforeAll(async () => {
  browser = await launch();
});
afterAll(() => browser?.close());

/** The card that begins with these words in a deck, and its place. */
function cardIn(deck: string, words: string): { text: string; place: string } {
  const whole = readFileSync(`${MODELS}/${deck}`, 'utf8'), at = whole.indexOf(words);
  const before = whole.slice(0, at).split('\n');
  return { text: whole.slice(at, whole.indexOf(';', at) + 1), place: `${deck}:${before.length}:${before[before.length - 1].length + 1}` };
}

const lines = (text: string | null) => text?.split('\n').map((line) => line.trim());

describe('what is picked', () => {
  test('in the tree shows its card as it is written, with file and line, the parameters that it names, and its variables', async () => {
    await withPage(browser, 'heavy_top.mbd', async ({ page }) => {
      await page.getByRole('treeitem', { name: 'body 1', exact: true }).click();
      const written = page.locator('.written'), card = cardIn('heavy_top.mbd', 'body:');
      await written.getByText(card.place, { exact: true }).waitFor();
      expect(lines(await written.locator('pre').textContent())).toEqual(lines(card.text));
      const parameters = await written.getByRole('row').allTextContents();
      expect(parameters).toContain('m1');
      expect(parameters.map((row) => row.slice(0, 1)).sort()).toEqual([...new Set(card.text.match(/\b[mlACI]\b/g))].sort());
      expect(await page.getByRole('table', { name: 'Variables' }).textContent()).toContain('E energy');
    });
  });

  test('in an included file names that file', async () => {
    await withPage(browser, 'cantilever_dead_load.mbd', async ({ page }) => {
      await page.getByRole('treeitem', { name: 'clamp 1', exact: true }).click();
      await page.locator('.written').getByText(/^cantilever\.inc:\d+:\d+$/).waitFor();
      expect(await page.locator('.written pre').textContent()).toMatch(/^joint: .*clamp[\s\S]*;$/);
    });
  });

  test('in the scene is what was under the pointer', async () => {
    await withPage(browser, 'heavy_top.mbd', async ({ page }) => {
      const hinge = await placeOf(page, 1);
      await page.mouse.click(hinge.x, hinge.y);
      await page.locator('.written').getByText(/^heavy_top\.mbd:/).waitFor();
      expect(await page.locator('.section .name').first().textContent()).toMatch(/^(spherical pin|dynamic node) 1/);
      expect(await page.locator('.written pre').textContent()).toMatch(/^(joint: 1, spherical pin|structural: 1, dynamic)/);
    });
  });

  test('is known in a recording, too', async () => {
    await withPage(browser, 'heavy_top.mbd', async ({ page }) => {
      const download = page.waitForEvent('download');
      await page.getByRole('button', { name: 'Export' }).click();
      await page.getByRole('button', { name: 'Recording (HTML)' }).click();
      const file = join(mkdtempSync(join(tmpdir(), 'mbcosim-')), 'recording.html');
      await (await download).saveAs(file);
      const again = await visit(browser, `file://${file}`);
      await shown(again.page);
      await again.page.getByRole('treeitem', { name: 'body 1', exact: true }).click();
      expect(lines(await again.page.locator('.written pre').textContent())).toEqual(lines(cardIn('heavy_top.mbd', 'body:').text));
      expect(again.faults).toEqual([]);
      await again.close();
      rmSync(dirname(file), { recursive: true });
    });
  });
});

describe('a flexible body', () => {
  test('moves in its eigenmodes, as far as the model is asked to', async () => {
    await withPage(browser, 'modal_crane.mbd', async ({ page }) => {
      const still = await flexiblePoints(page);
      await page.locator('summary', { hasText: 'Eigenmodes' }).click();
      await page.getByRole('textbox', { name: 'Nearest to this frequency, in hertz' }).fill('5');
      await page.getByRole('button', { name: 'Compute' }).click();
      const mode = page.getByRole('button', { name: /Hz damping/ }).last();
      await mode.click();
      const extent = await page.evaluate(() => (window as unknown as { mbcosim: { desk: { shown: { value: { geometry: { extent: number } } } } } }).mbcosim.desk.shown.value.geometry.extent);
      let largest = 0;
      while (largest < 0.005 * extent) {
        await scene(page);  // the next picture
        const moved = await flexiblePoints(page);
        for (let i = 0; i < still.length; i += 3) largest = Math.max(largest, Math.hypot(moved[i] - still[i], moved[i + 1] - still[i + 1], moved[i + 2] - still[i + 2]));
      }
      expect(largest).toBeLessThan(0.36 * extent);
      await mode.click();
      await scene(page);
      expect(await flexiblePoints(page)).toEqual(still);
    });
  });
});
