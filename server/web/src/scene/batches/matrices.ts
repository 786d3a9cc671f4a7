/** Matrices of instances, 16 numbers by columns each, written in place. */
import type { Vec3 } from '../../algebra';

/** Columns a, b, c and the origin x. */
export function writeMatrix(out: Float32Array, at: number, a: Vec3 | number[], b: Vec3 | number[], c: Vec3 | number[], x: ArrayLike<number>, from = 0): void {
  for (let k = 0; k < 3; ++k) {
    out[at + k] = a[k];
    out[at + 4 + k] = b[k];
    out[at + 8 + k] = c[k];
    out[at + 12 + k] = x[from + k];
  }
  out[at + 15] = 1;
}

const side = [0, 0, 0], along = [0, 0, 0], other = [0, 0, 0];

/** Something round whose axis is y: `width` wide, `length` long, from x in the unit direction d. */
export function writeBar(out: Float32Array, at: number, x: ArrayLike<number>, d: ArrayLike<number>, length: number, width: number): void {
  const steep = Math.abs(d[2]) > 0.9;  // any direction that is not d gives the sides
  const px = steep ? 1 : 0, pz = steep ? 0 : 1;
  side[0] = d[1] * pz, side[1] = d[2] * px - d[0] * pz, side[2] = -d[1] * px;
  const size = Math.hypot(side[0], side[1], side[2]) || 1;
  for (let k = 0; k < 3; ++k) side[k] /= size;
  other[0] = side[1] * d[2] - side[2] * d[1], other[1] = side[2] * d[0] - side[0] * d[2], other[2] = side[0] * d[1] - side[1] * d[0];
  for (let k = 0; k < 3; ++k) {
    along[k] = d[k] * length;
    side[k] *= width;
    other[k] *= width;
  }
  writeMatrix(out, at, side, along, other, x);
}
