/** Solids fixed to points: nodes, joints, ellipsoids of inertia. */
import type * as THREE from 'three';
import type { Mat3, Vec3 } from '../../algebra';
import type { Pose } from '../../geometry';
import type { Points } from '../points';
import { Instances } from './instances';

export interface GlyphItem {
  id: string;
  /** Index of the point that it sits on. */
  point: number;
  /** Its axes in the frame of the point's node; of a fixed point: global. */
  local: Mat3;
  size: Vec3;
}

export class GlyphBatch extends Instances {
  /** Axes times sizes, by rows. */
  private readonly axes: Float64Array;

  constructor(geometry: THREE.BufferGeometry, private readonly items: GlyphItem[], private readonly points: Points, colour: THREE.Color, opacity = 1) {
    super(geometry, items.map((item) => item.id), colour, opacity);
    this.axes = new Float64Array(9 * items.length);
    items.forEach(({ local, size }, i) => local.forEach((value, k) => (this.axes[9 * i + k] = value * size[k % 3])));
  }

  update(pose: Pose): void {
    const { axes, items, points, matrices } = this, R = pose.R;
    for (let i = 0; i < items.length; ++i) {
      const point = items[i].point, node = points.node(point), a = 9 * i, at = 16 * i;
      for (let row = 0; row < 3; ++row) {
        for (let column = 0; column < 3; ++column) {
          const r = 9 * node + 3 * row, c = a + column;
          matrices[at + 4 * column + row] = node < 0 ? axes[c + 3 * row] : R[r] * axes[c] + R[r + 1] * axes[c + 3] + R[r + 2] * axes[c + 6];
        }
        matrices[at + 12 + row] = points.x[3 * point + row];
      }
      matrices[at + 15] = 1;
    }
    this.solids.moved();
  }
}
