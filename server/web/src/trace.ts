/** A curve over another one: of very many points those that a picture of all of them needs. */

/** A point of a curve; null: the curve has a gap. One NaN, and uPlot finds no range for the whole curve. */
export type Value = number | null;

/** Parts of the width and of the height that a screen tells apart. */
const CELLS = 1024;
/** Lines of a curve are at most about so many: where there are more, it has filled its plot. */
const MOST = 6000;

/**
 * Points in the order of time. Those are left out that lie where the one before does, and lines between places that a line joins already; of
 * too many lines coarser ones are. The points farthest to each side are always there.
 */
export function trace(x: Float64Array, y: Float64Array, most = MOST): [Value[], Value[]] {
  const known = Array.from(x.keys()).filter((i) => Number.isFinite(x[i]) && Number.isFinite(y[i]));
  const ends = [x, y].map((values) => extremes(values, known));
  const farthest = new Set(ends.flat());
  for (let cells = CELLS; ; cells /= 2) {
    const places = ends.map(([least, greatest], k) => scaled([x, y][k], least, greatest, cells));
    const found = lines(known, (i) => places[0](i) * (cells + 1) + places[1](i), farthest, cells > 1 ? most : Infinity);
    if (found) return [x, y].map((values) => found.map((i) => (i < 0 ? null : values[i]))) as [Value[], Value[]];
  }
}

/** Indices of the least and of the greatest value. */
function extremes(values: Float64Array, known: readonly number[]): [number, number] {
  let least = known[0], greatest = known[0];
  for (const i of known) {
    if (values[i] < values[least]) least = i;
    if (values[i] > values[greatest]) greatest = i;
  }
  return [least, greatest];
}

/** Halves, since differences of the largest numbers are none. */
function scaled(values: Float64Array, least: number, greatest: number, cells: number): (i: number) => number {
  const from = values[least] / 2, span = values[greatest] / 2 - from;
  return (i) => (span > 0 ? Math.floor(((values[i] / 2 - from) / span) * cells) : 0);
}

/** Indices of the points that are joined; −1: a gap. Undefined: they are more than `most`. */
function lines(known: readonly number[], placeOf: (i: number) => number, farthest: ReadonlySet<number>, most: number): number[] | undefined {
  const found: number[] = [], joined = new Set<number>();
  let last = -2, at = -1, down = false;
  for (const [k, i] of known.entries()) {
    const place = placeOf(i), gap = k === 0 || known[k - 1] !== i - 1;
    if (gap) {
      if (found.length > 0) found.push(-1);
      found.push(i);
      down = true;
    } else if (place === at && !farthest.has(i)) continue;
    else {
      const line = Math.min(at, place) * 2 ** 26 + Math.max(at, place);
      if (joined.has(line) && !farthest.has(i)) down = false;
      else {
        if (!down) found.push(-1, last);
        found.push(i);
        down = true;
        joined.add(line);
      }
    }
    [last, at] = [i, place];
    if (found.length > most) return undefined;
  }
  return found;
}
