import type { Browser, Page } from 'playwright-core';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { afterAll, beforeAll, describe, expect, test } from 'vitest';
import { atStep, launch, MODELS, placeOf, scene, shown, until, visit, withPage } from './bench';

let browser: Browser;
beforeAll(async () => {
  browser = await launch();
});
afterAll(() => browser?.close());

interface Drawn {
  id: string;
  /** 16 numbers by columns. */
  matrix: number[];
  triangles: number;
}

interface Inside {
  mbcosim: {
    desk: { shown: { value: { geometry: { meshes: { id: string; triangles: number }[]; triangles: Float32Array[] } } } };
    scene: { view: { drawn: { items: { meshes: { triangles: Float32Array; items: { id: string }[] }[] }; batches: { batch: { balls?: unknown; matrices: Float32Array } }[] } } };
  };
}

/** The meshes as the scene has them. */
async function meshes(page: Page): Promise<Drawn[]> {
  await scene(page);
  return page.evaluate(() => {
    const { batches, items } = (window as unknown as Inside).mbcosim.scene.view.drawn;
    return batches.filter(({ batch }) => batch.balls).flatMap(({ batch }, i) => items.meshes[i].items.map(({ id }, copy) => ({
      id, matrix: Array.from(batch.matrices.slice(16 * copy, 16 * copy + 16)), triangles: items.meshes[i].triangles.length / 9,
    })));
  });
}

/** Pendulum with files beside it. */
function folderWith(files: Record<string, string | Buffer>): string {
  const folder = mkdtempSync(join(tmpdir(), 'mbcosim-'));
  writeFileSync(join(folder, 'pendulum.mbd'), readFileSync(`${MODELS}/pendulum.mbd`));
  for (const [name, data] of Object.entries(files)) writeFileSync(join(folder, name), data);
  return folder;
}

const GLTF = JSON.stringify({
  asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }], meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
  accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] }],
  bufferViews: [{ buffer: 0, byteLength: 36 }], buffers: [{ byteLength: 36, uri: 'plate.bin' }],
});
const PLATE = Buffer.from(Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0).buffer);

describe('the meshes of a sidecar', () => {
  test('stand in place of the bodies, move with their nodes, and are picked as those', async () => {
    await withPage(browser, 'slider_crank.mbd', async ({ page }) => {
      expect((await meshes(page)).map(({ id }) => id)).toEqual(['body:1', 'body:2', 'body:3']);
      for (const step of [10, 20, 30]) await page.getByRole('button', { name: '+10' }).click().then(() => atStep(page, step));
      const { nodes } = await scene(page);
      for (const { id, matrix } of await meshes(page)) {
        const node = nodes[id.replace('body:', '')], size = Math.hypot(node[0], node[1], node[2]);
        for (let k = 0; k < 12; ++k) expect(matrix[k] / 0.001).toBeCloseTo(node[k] / size, 4);
        for (let k = 12; k < 15; ++k) expect(matrix[k]).toBeCloseTo(node[k], 6);
      }
      await page.keyboard.press('1');
      let piston = await placeOf(page, 3), before;
      do {  // until the camera has come to rest
        before = piston;
        await scene(page);
        piston = await placeOf(page, 3);
      } while (Math.hypot(piston.x - before.x, piston.y - before.y) > 0.1);
      await page.mouse.click(piston.x, piston.y - 12);
      await page.locator('.right .section').first().getByText('body 3').waitFor();
    });
  });

  test('are in a recording, too, which needs no file', async () => {
    await withPage(browser, 'slider_crank.mbd', async ({ page }) => {
      await page.getByRole('button', { name: '+10' }).click();
      await atStep(page, 10);
      const before = await meshes(page);
      const download = page.waitForEvent('download');
      await page.getByRole('button', { name: 'Export' }).click();
      await page.getByRole('button', { name: 'Recording (HTML)' }).click();
      const folder = mkdtempSync(join(tmpdir(), 'mbcosim-')), file = join(folder, 'recording.html');
      await (await download).saveAs(file);
      const again = await visit(browser, `file://${file}`);
      await shown(again.page);
      const replayed = await meshes(again.page);
      expect(replayed.map(({ id, triangles }) => [id, triangles])).toEqual(before.map(({ id, triangles }) => [id, triangles]));
      before.forEach(({ matrix }, i) => matrix.forEach((x, k) => expect(replayed[i].matrix[k]).toBeCloseTo(x, 5)));
      expect(again.faults).toEqual([]);
      await again.close();
      rmSync(folder, { recursive: true });
    });
  });

  test('may be glTF with its numbers in another file', async () => {
    const folder = folderWith({ 'pendulum.view.json': '{"meshes": [{"node": 2, "file": "plate.gltf", "scale": 0.5}, {"file": "plate.gltf"}]}', 'plate.gltf': GLTF, 'plate.bin': PLATE });
    await withPage(browser, join(folder, 'pendulum.mbd'), async ({ page }) => {
      expect((await meshes(page)).map(({ id, triangles }) => [id, triangles])).toEqual([['body:2', 1], ['', 1]]);
    });
    rmSync(folder, { recursive: true });
  });

  test.each([
    ['{"meshes": [{"node": 5, "file": "plate.gltf"}]}', 'pendulum.view.json: meshes[0].node: 5 is no label of a structural node'],
    ['{"meshes": [{"node": 2, "file": "lost.stl"}]}', 'pendulum.view.json: meshes[0].file: "lost.stl" is not there'],
    ['{"meshes": [}', 'this is no JSON: Unexpected token'],
  ])('that cannot be drawn are told, and the rest is drawn: %s', async (sidecar, told) => {
    const folder = folderWith({ 'pendulum.view.json': sidecar, 'plate.gltf': GLTF, 'plate.bin': PLATE });
    await withPage(browser, join(folder, 'pendulum.mbd'), async ({ page }) => {
      await page.getByRole('alert').getByText(told).waitFor();
      expect(await meshes(page)).toEqual([]);
      await page.getByRole('button', { name: 'One step (S)' }).click();
      await atStep(page, 1);
    });
    rmSync(folder, { recursive: true });
  });

  test('come with a deck from the disk', async () => {
    await withPage(browser, 'pendulum.mbd', async ({ page }, view) => {
      await page.getByRole('tab', { name: 'Simulations' }).click();
      await page.getByRole('button', { name: 'Load a deck' }).click();
      await page.getByLabel('Files of a deck').setInputFiles(['slider_crank.mbd', 'slider_crank.view.json', 'slider_crank_crank.obj', 'slider_crank_rod.obj', 'slider_crank_piston.obj'].map((name) => `${MODELS}/${name}`));
      await until(page, (name) => location.hash.includes('simulation=') && !location.hash.includes(encodeURIComponent(name)), view.simulation);
      await shown(page);
      expect((await meshes(page)).length).toBe(3);
    });
  });
});
