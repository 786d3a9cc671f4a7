/** Stations along a beam's reference line, with the section's axes: enough to draw it as a bar that bends and twists. */
import type { Mat3, Vec3 } from './algebra';
import type { Pose } from './geometry';

/** Weights of the nodes' points at ξ from −1 to 1: the parabola through three, the straight line through two. */
export function weights(points: number, xi: number): number[] {
  return points === 3 ? [(xi * (xi - 1)) / 2, 1 - xi * xi, (xi * (xi + 1)) / 2] : [(1 - xi) / 2, (1 + xi) / 2];
}

/** Slopes of the weights. */
function slopes(points: number, xi: number): number[] {
  return points === 3 ? [xi - 0.5, -2 * xi, xi + 0.5] : [-0.5, 0.5];
}

export class BeamCurve {
  /** x, then the two axes of the section (unit, across the line), nine numbers a station. */
  readonly stations: Float64Array;
  private readonly weights: number[][];
  private readonly slopes: number[][];
  /** An axis of the section in the frame of each node: the same direction in the pose where the beam is described. */
  private readonly axes: Vec3[];

  constructor(private readonly points: number[], private readonly nodes: number[], x: ArrayLike<number>, R: (node: number) => Mat3, count: number) {
    const parts = Array.from({ length: count }, (_, i) => -1 + (2 * i) / (count - 1));
    this.weights = parts.map((xi) => weights(points.length, xi));
    this.slopes = parts.map((xi) => slopes(points.length, xi));
    this.stations = new Float64Array(9 * count);
    const last = points[points.length - 1], along = [0, 1, 2].map((k) => x[3 * last + k] - x[3 * points[0] + k]);
    this.axes = nodes.map((node) => inFrame(R(node), across(R(nodes[0]), along)));
  }

  update(pose: Pose, x: ArrayLike<number>): void {
    const { points, nodes, axes, stations } = this, R = pose.R;
    for (let i = 0; i < this.weights.length; ++i) {
      const at = 9 * i;
      let tx = 0, ty = 0, tz = 0, ax = 0, ay = 0, az = 0;
      stations.fill(0, at, at + 3);
      for (let k = 0; k < points.length; ++k) {
        const from = 3 * points[k], r = 9 * nodes[k], w = this.weights[i][k], s = this.slopes[i][k], a = axes[k];
        for (let j = 0; j < 3; ++j) stations[at + j] += w * x[from + j];
        tx += s * x[from], ty += s * x[from + 1], tz += s * x[from + 2];
        ax += w * (R[r] * a[0] + R[r + 1] * a[1] + R[r + 2] * a[2]);
        ay += w * (R[r + 3] * a[0] + R[r + 4] * a[1] + R[r + 5] * a[2]);
        az += w * (R[r + 6] * a[0] + R[r + 7] * a[1] + R[r + 8] * a[2]);
      }
      const t = Math.hypot(tx, ty, tz) || 1;
      tx /= t, ty /= t, tz /= t;
      const part = ax * tx + ay * ty + az * tz;
      ax -= part * tx, ay -= part * ty, az -= part * tz;
      const a = Math.hypot(ax, ay, az) || 1;
      ax /= a, ay /= a, az /= a;
      stations[at + 3] = ax, stations[at + 4] = ay, stations[at + 5] = az;
      stations[at + 6] = ty * az - tz * ay, stations[at + 7] = tz * ax - tx * az, stations[at + 8] = tx * ay - ty * ax;
    }
  }
}

/** The axis 2 or 3 of a node's frame (or 1) that lies most across a direction, global. */
function across(R: Mat3, along: number[]): Vec3 {
  const size = Math.hypot(...along) || 1;
  const axes = [1, 2, 0].map((k): Vec3 => [R[k], R[3 + k], R[6 + k]]);
  const part = (axis: Vec3) => Math.abs(axis[0] * along[0] + axis[1] * along[1] + axis[2] * along[2]) / size;
  return axes.reduce((best, axis) => (part(axis) < part(best) - 1e-6 ? axis : best));
}

/** Rᵀ v. */
function inFrame(R: Mat3, v: Vec3): Vec3 {
  return [R[0] * v[0] + R[3] * v[1] + R[6] * v[2], R[1] * v[0] + R[4] * v[1] + R[7] * v[2], R[2] * v[0] + R[5] * v[1] + R[8] * v[2]];
}
