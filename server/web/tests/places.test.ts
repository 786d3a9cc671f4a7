import { afterEach, beforeEach, describe, expect, test, vi } from 'vitest';
import { placeToFollow, takePlace } from '../src/places';

/** Locks of all tabs, as browsers have them. */
class Locks {
  private readonly held = new Set<string>();

  async request(name: string, _: object, use: (lock: object | null) => Promise<void>): Promise<void> {
    if (this.held.has(name)) return use(null);
    this.held.add(name);
    await use({ name });
    this.held.delete(name);
  }
}

const served = (protocol: string) => vi.spyOn(performance, 'getEntriesByType').mockReturnValue([{ nextHopProtocol: protocol } as unknown as PerformanceEntry]);
const take = (count: number) => Promise.all(Array.from({ length: count }, () => takePlace('samples')));

describe('places for streams', () => {
  beforeEach(() => {
    vi.stubGlobal('navigator', { locks: new Locks() });
    vi.stubGlobal('document', { hidden: false });
    served('http/1.1');
  });
  afterEach(() => {
    vi.unstubAllGlobals();
    vi.restoreAllMocks();
  });

  test('are few over HTTP 1.1, and come back', async () => {
    const places = await take(3);
    expect(places.filter((place) => place)).toHaveLength(2);
    expect(await takePlace('events')).toBeDefined();
    places.find((place) => place)?.release();
    await vi.waitFor(async () => expect(await takePlace('samples')).toBeDefined());
  });

  test.each(['h2', 'h3'])('are without number over %s', async (protocol) => {
    served(protocol);
    expect(await take(10)).not.toContain(undefined);
  });

  test('are without number where tabs have no locks', async () => {
    vi.stubGlobal('navigator', {});
    expect(await take(10)).not.toContain(undefined);
  });

  test('are left by a hidden tab to one that is seen, each kind by itself', async () => {
    const other = new BroadcastChannel('mbcosim places'), left: string[] = [];
    for (const kind of ['events', 'samples'] as const) await placeToFollow(kind, () => true, () => left.push(kind));
    other.postMessage('samples');
    await new Promise((later) => setTimeout(later, 50));
    expect(left).toEqual([]);
    vi.stubGlobal('document', { hidden: true });
    other.postMessage('samples');
    await vi.waitFor(() => expect(left).toEqual(['samples']));
    other.close();
  });

  test('are not waited for any more when nobody wants one', async () => {
    await take(2);
    let wanted = true, meanwhile = 0;
    const place = placeToFollow('samples', () => wanted, () => {}, async () => {
      meanwhile += 1;
      wanted = false;
    });
    expect([await place, meanwhile]).toEqual([undefined, 1]);
  });
});
