/** Lines of several forms between points. */
import * as THREE from 'three';
import type { Mat3 } from '../algebra';
import type { BeamItem } from './batches/beams';
import type { LineItem } from './batches/lines';
import type { Points } from './points';

const COILS = 8, CORNERS_OF_A_COIL = 12;
/** Ends of a spring that are straight, as parts of its length. */
const STRAIGHT = 0.12;

export function straight(id: string, points: number[], table: Points): LineItem {
  return {
    id,
    corners: points.length,
    fill(out) {
      for (let i = 0; i < points.length; ++i) for (let k = 0; k < 3; ++k) out[3 * i + k] = table.x[3 * points[i] + k];
    },
  };
}

/** A helix between two points: it is seen to lengthen. */
export function coil(id: string, [from, to]: number[], radius: number, table: Points): LineItem {
  const turns = COILS * CORNERS_OF_A_COIL, corners = turns + 3;
  const ring = Array.from({ length: CORNERS_OF_A_COIL }, (_, i) => [Math.cos((2 * Math.PI * i) / CORNERS_OF_A_COIL), Math.sin((2 * Math.PI * i) / CORNERS_OF_A_COIL)]);
  return {
    id,
    corners,
    fill(out) {
      const x = table.x, a = 3 * from, b = 3 * to;
      const dx = x[b] - x[a], dy = x[b + 1] - x[a + 1], dz = x[b + 2] - x[a + 2], length = Math.hypot(dx, dy, dz) || 1;
      // u and v: across the line, of unit length
      const flat = Math.abs(dx) < 0.9 * length;
      let ux = flat ? 0 : dz, uy = flat ? -dz : 0, uz = flat ? dy : -dx;
      const size = Math.hypot(ux, uy, uz) || 1;
      ux /= size, uy /= size, uz /= size;
      const vx = (dy * uz - dz * uy) / length, vy = (dz * ux - dx * uz) / length, vz = (dx * uy - dy * ux) / length;
      for (let k = 0; k < 3; ++k) out[k] = x[a + k], out[3 * (corners - 1) + k] = x[b + k];
      for (let i = 0; i <= turns; ++i) {
        const part = STRAIGHT + ((1 - 2 * STRAIGHT) * i) / turns, [cos, sin] = ring[i % CORNERS_OF_A_COIL], at = 3 * (i + 1);
        out[at] = x[a] + part * dx + radius * (cos * ux + sin * vx);
        out[at + 1] = x[a + 1] + part * dy + radius * (cos * uy + sin * vy);
        out[at + 2] = x[a + 2] + part * dz + radius * (cos * uz + sin * vz);
      }
    },
  };
}

/** The three axes of a frame at a point, in three colours. */
export function axes(id: string, point: number, local: Mat3, length: number, table: Points, colours: string[]): LineItem[] {
  const node = table.node(point);
  return colours.map((colour, axis): LineItem => ({
    id,
    corners: 2,
    colour: new THREE.Color(colour),
    fill(out, { R }) {
      for (let row = 0, r = 9 * node; row < 3; ++row, r += 3) {
        const d = node < 0 ? local[3 * row + axis] : R[r] * local[axis] + R[r + 1] * local[3 + axis] + R[r + 2] * local[6 + axis];
        out[row] = table.x[3 * point + row];
        out[3 + row] = out[row] + length * d;
      }
    },
  }));
}

/** The rim of a beam's section at a station, `wider` than the beam. The beam itself is moved before. */
export function section({ id, curve, width, height }: BeamItem, station: number, wider: number): LineItem {
  const at = 9 * station, a = wider * width, b = wider * height;
  const corners = [[a, b], [-a, b], [-a, -b], [a, -b], [a, b]];
  return {
    id,
    corners: corners.length,
    fill(out) {
      const s = curve.stations;
      corners.forEach(([u, v], i) => {
        for (let k = 0; k < 3; ++k) out[3 * i + k] = s[at + k] + u * s[at + 3 + k] + v * s[at + 6 + k];
      });
    },
  };
}
