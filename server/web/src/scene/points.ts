/** All points of a model, moved at once: whatever is drawn hangs on them by index. */
import { norm } from '../algebra';
import type { PointShape, Pose } from '../geometry';

export class Points {
  /** Where the points are, three numbers each. The first ones are the nodes. */
  x = new Float64Array(0);
  private readonly nodes: number[] = [];
  private readonly offsets: number[] = [];

  constructor(private readonly nodeCount: number) {
    for (let node = 0; node < nodeCount; ++node) this.put(node, [0, 0, 0]);
  }

  /** Index of a point. */
  add(point: PointShape): number {
    if (point.node >= 0 && norm(point.offset) === 0) return point.node;
    return this.put(point.node, point.offset);
  }

  private put(node: number, offset: ArrayLike<number>): number {
    this.nodes.push(node);
    this.offsets.push(offset[0], offset[1], offset[2]);
    return this.nodes.length - 1;
  }

  /** Index of the node on which a point hangs; −1: it is fixed in space. */
  node(point: number): number {
    return this.nodes[point];
  }

  distance(one: number, other: number): number {
    const { x } = this;
    return Math.hypot(x[3 * one] - x[3 * other], x[3 * one + 1] - x[3 * other + 1], x[3 * one + 2] - x[3 * other + 2]);
  }

  update(pose: Pose): void {
    const count = this.nodes.length;
    if (this.x.length !== 3 * count) this.x = new Float64Array(3 * count);
    const { x, nodes, offsets } = this, R = pose.R;
    x.set(pose.x);
    for (let i = this.nodeCount; i < count; ++i) {
      const node = nodes[i], at = 3 * i, a = offsets[at], b = offsets[at + 1], c = offsets[at + 2];
      if (node < 0) {
        x[at] = a, x[at + 1] = b, x[at + 2] = c;
        continue;
      }
      for (let row = 0, r = 9 * node; row < 3; ++row, r += 3) x[at + row] = pose.x[3 * node + row] + R[r] * a + R[r + 1] * b + R[r + 2] * c;
    }
  }
}
