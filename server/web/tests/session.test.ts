import { describe, expect, test, vi } from 'vitest';
import { StepOutcome } from '../src/gen/mbcosim/v1/simulations_pb';
import { Session } from '../src/session';

/** Streams of samples and of events that were begun; places that are held. */
const begun: AbortSignal[] = [];
let held = 0, given = 0, refused = false, othersRun = 0, close = () => {};

async function* stream(_: object, { signal }: { signal: AbortSignal }): AsyncGenerator<never> {
  begun.push(signal);
  if (refused) throw new Error('too many streams');
  await new Promise((_, reject) => signal.addEventListener('abort', reject));
}

async function* reachTheEnd() {
  yield { content: { case: 'done', value: { outcome: StepOutcome.FINISHED, stepsDone: 0n, step: 7n, time: 1 } } };
}

/** Steps that are reached, one after the other. */
const reached: bigint[] = [];
const takeStep = async () => ({ outcome: StepOutcome.ACCEPTED, stepsDone: 1n, step: reached.shift() ?? 0n, time: 0 });

vi.mock('../src/api', () => ({
  failureOf: () => ({ message: '', reason: '', metadata: {}, diagnostics: [], cancelled: true }),
  simulations: { run: reachTheEnd, step: () => takeStep(), readVariables: async () => ({ step: 0n, time: 0, values: [] }), listSnapshots: async () => ({ snapshots: [] }) },
  telemetry: { subscribe: stream },
  events: { watchEvents: stream },
}));
vi.mock('../src/questions', () => ({
  look: async (name: string) => ({ name, state: 0, step: 0n, time: 0, waits: [] }),
  describe: async () => ({ title: '', nodes: [], elements: [], variables: [], symbols: [] }),
}));
vi.mock('../src/model', () => ({ modelOf: () => ({ title: '', variables: [] }) }));
vi.mock('../src/load_geometry', () => ({ loadGeometry: async () => ({ geometry: { nodes: [], elements: [], bodies: [] }, cards: new Map() }) }));
vi.mock('../src/places', () => ({
  pause: (milliseconds: number) => new Promise<void>((later) => milliseconds < 400 && setTimeout(later)),  // what is done again later never is
  takePlace: async () => (othersRun-- > 0 ? undefined : { release: () => --held, held: ++held }),
  placeToFollow: async (_: string, wanted: () => boolean) => {
    await new Promise((later) => setTimeout(later));
    if (!wanted()) return undefined;
    ++held;
    ++given;
    close();
    return { release: () => --held };
  },
}));

describe('a simulation on the screen', () => {
  test('has a place for each of its streams until it is closed', async () => {
    const session = await Session.open('simulations/1');
    await vi.waitFor(() => expect([held, begun.length]).toEqual([2, 2]));
    session.close();
    await vi.waitFor(() => expect(held).toBe(0));
    expect(begun.splice(0).every((signal) => signal.aborted)).toBe(true);
  });

  test('that is closed in the moment in which it gets a place holds none and begins no stream', async () => {
    const session = await Session.open('simulations/1');
    given = 0;
    close = () => session.close();
    await vi.waitFor(() => expect([given, held]).toEqual([1, 0]));
    expect(begun).toEqual([]);
    close = () => {};
  });

  test('leaves a place to others while its stream is refused', async () => {
    refused = true;
    const session = await Session.open('simulations/1');
    await vi.waitFor(() => expect([held, begun.length]).toEqual([0, 2]));
    session.close();
  });

  test('runs when those in other tabs have ended, and says so meanwhile', async () => {
    refused = false;
    othersRun = 3;
    const session = await Session.open('simulations/1');
    await session.runUntil(1);
    expect(session.log.value.map(({ text }) => text)).toEqual(['waits until a run in another tab ends']);
    expect([session.playing.value, Number(session.info.value.step), othersRun]).toEqual(['no', 7, -1]);
    session.close();
    await vi.waitFor(() => expect(held).toBe(0));
  });

  test('says nothing more of what failed when something else is asked for', async () => {
    const session = await Session.open('simulations/1'), failed = { message: 'no', reason: '', metadata: {}, diagnostics: [], cancelled: false };
    othersRun = 0;
    for (const ask of [() => session.step(1), () => session.runUntil(1)]) {
      session.failure.value = failed;
      void ask();
      expect(session.failure.value).toBeUndefined();
    }
    session.close();
    await vi.waitFor(() => expect(held).toBe(0));
  });

  test('forgets what the solver did in steps that are undone', async () => {
    const session = await Session.open('simulations/1');
    reached.push(10n, 20n, 15n, 16n);
    for (let asked = 0; asked < 4; ++asked) await session.step(1);
    expect(session.steps.value.map(({ step }) => step)).toEqual([10, 15, 16]);
    session.close();
    await vi.waitFor(() => expect(held).toBe(0));
  });

  test('that is closed while its run waits for others does not run', async () => {
    othersRun = Infinity;
    const session = await Session.open('simulations/1'), run = session.runUntil(1);
    await vi.waitFor(() => expect(session.log.value).toHaveLength(1));
    session.close();
    await run;
    expect(Number(session.info.value.step)).toBe(0);
    await vi.waitFor(() => expect(held).toBe(0));
  });
});
