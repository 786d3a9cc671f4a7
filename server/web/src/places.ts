/**
 * Places for streams. Over HTTP 1.1 a browser keeps six connections to a server, for all tabs that show it, and a stream has one of them as
 * long as it lives: three tabs would leave none for calls. Behind a proxy that speaks HTTP 2 there is a place for each stream, and in browsers
 * without locks between tabs (for a page from another machine without TLS).
 */

/** At once in all tabs: streams of samples and of events, and runs without regard to the wall clock. One connection is left for calls. */
const MOST = { samples: 2, events: 1, run: 2 };
type Kind = keyof typeof MOST;
const AGAIN_MILLISECONDS = 500;
/** Until a tab that nobody sees asks, so that one that is seen goes first. */
const HIDDEN_MILLISECONDS = 2000;

/** Ends with its tab, too. */
export interface Place {
  release(): void;
}

function lock(name: string): Promise<Place | undefined> {
  return new Promise((resolve) => {
    const hold = (lock: Lock | null) => (lock ? new Promise<void>((release) => resolve({ release })) : resolve(undefined));
    navigator.locks.request(name, { ifAvailable: true }, hold).catch(() => resolve({ release: () => {} }));
  });
}

function isUnlimited(): boolean {
  const [page] = performance.getEntriesByType('navigation') as PerformanceNavigationTiming[];
  return !navigator.locks || /^h[23]/.test(page?.nextHopProtocol ?? '');
}

/** Nothing: all are taken. */
export async function takePlace(kind: Kind): Promise<Place | undefined> {
  if (isUnlimited()) return { release: () => {} };
  for (let k = 0; k < MOST[kind]; ++k) {
    const place = await lock(`mbcosim ${kind} ${k}`);
    if (place) return place;
  }
  return undefined;
}

let channel: BroadcastChannel | undefined;

/** Waits for a place for a stream, as long as it is `wanted`; does something else `meanwhile`. When the tab is hidden and one that is seen wants the place, `leave` is called. */
export async function placeToFollow(kind: Kind, wanted: () => boolean, leave: () => void, meanwhile = async () => {}): Promise<Place | undefined> {
  const others = (channel ??= new BroadcastChannel('mbcosim places'));
  if (document.hidden) await pause(HIDDEN_MILLISECONDS);
  for (; wanted(); await pause(AGAIN_MILLISECONDS)) {
    const place = await takePlace(kind);
    if (!place) {
      if (!document.hidden) others.postMessage(kind);
      await meanwhile();
      continue;
    }
    if (!wanted()) return place.release(), undefined;
    const hear = ({ data }: MessageEvent) => data === kind && document.hidden && leave();
    others.addEventListener('message', hear);
    return {
      release() {
        others.removeEventListener('message', hear);
        place.release();
      },
    };
  }
  return undefined;
}

export function pause(milliseconds: number): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve, milliseconds));
}
