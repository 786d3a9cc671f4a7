/** Lines that join near points, so that a cloud of points is seen as a body. */

/** Pairs of indices of a shortest tree over points (three numbers each), and of the two nearest neighbours of each point; none for more than `most`. */
export function joins(positions: ArrayLike<number>, most = 1500): [number, number][] {
  const count = positions.length / 3;
  if (count < 2 || count > most) return [];
  const distance = (a: number, b: number) =>
    (positions[3 * a] - positions[3 * b]) ** 2 + (positions[3 * a + 1] - positions[3 * b + 1]) ** 2 + (positions[3 * a + 2] - positions[3 * b + 2]) ** 2;
  const found = new Map<number, [number, number]>();
  const add = (a: number, b: number) => found.set(Math.min(a, b) * count + Math.max(a, b), [Math.min(a, b), Math.max(a, b)]);
  tree(count, distance, add);
  for (let a = 0; a < count; ++a) for (const b of twoNearest(a, count, distance)) add(a, b);
  return [...found.values()];
}

/** Prim's algorithm. */
function tree(count: number, distance: (a: number, b: number) => number, add: (a: number, b: number) => void): void {
  const near = new Float64Array(count).fill(Infinity), from = new Int32Array(count), done = new Uint8Array(count);
  let next = 0;
  for (let step = 1; step < count; ++step) {
    done[next] = 1;
    let nearest = -1;
    for (let other = 0; other < count; ++other) {
      if (done[other]) continue;
      const d = distance(next, other);
      if (d < near[other]) near[other] = d, from[other] = next;
      if (nearest < 0 || near[other] < near[nearest]) nearest = other;
    }
    add(from[nearest], nearest);
    next = nearest;
  }
}

function twoNearest(a: number, count: number, distance: (a: number, b: number) => number): number[] {
  let first = -1, second = -1;
  for (let b = 0; b < count; ++b) {
    if (b === a) continue;
    if (first < 0 || distance(a, b) < distance(a, first)) second = first, first = b;
    else if (second < 0 || distance(a, b) < distance(a, second)) second = b;
  }
  return [first, second].filter((b) => b >= 0);
}
