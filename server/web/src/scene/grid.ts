/** The ground: lines at round distances that fade out, in one call. */
import * as THREE from 'three';
import { inertiaEllipsoid } from '../algebra';
import { initialPose, orientationAt, pointAt, type Geometry } from '../geometry';
import type { Palette } from './palette';

/** Parts of a cell between its lines. */
const PARTS = 5;
/** Pieces of each line: it fades from piece to piece. */
const PIECES = 12;
const FAINT = 0.45, STRONG = 1;

/** The model is at least so many cells long. */
const CELLS = 3;

/** The largest of 1, 2, 5, 10, … times a power of ten that is no more than this. */
export function roundBelow(length: number): number {
  const power = 10 ** Math.floor(Math.log10(length) + 1e-9);
  return power * ([5, 2].find((part) => part * power <= length * (1 + 1e-9)) ?? 1);
}

export class Grid {
  readonly object: THREE.LineSegments<THREE.BufferGeometry, THREE.Material>;
  /** Length of a cell. */
  readonly cell: number;

  constructor(geometry: Geometry, palette: Palette) {
    this.cell = roundBelow(geometry.extent / CELLS);
    const reach = Math.ceil((1.2 * geometry.extent) / this.cell) * this.cell;
    const lines = this.lines(reach, new THREE.Color(palette.grid), new THREE.Color(palette.background));
    this.object = new THREE.LineSegments(lines, new THREE.LineBasicMaterial({ vertexColors: true }));
    const lowest = lowestOf(geometry);
    const [x, y] = geometry.centre.map((value) => Math.round(value / this.cell) * this.cell);
    this.object.position.set(x, y, lowest - 0.02 * geometry.extent);
    this.object.renderOrder = -1;
  }

  private lines(reach: number, line: THREE.Color, ground: THREE.Color): THREE.BufferGeometry {
    const positions: number[] = [], colours: number[] = [], colour = new THREE.Color();
    const corner = (x: number, y: number, strength: number) => {
      const part = Math.max(0, 1 - Math.hypot(x, y) / reach);
      positions.push(x, y, 0);
      colours.push(...colour.lerpColors(ground, line, strength * Math.min(1, 1.8 * part)).toArray());
    };
    const step = this.cell / PARTS, count = Math.round(reach / step);
    for (let i = -count; i <= count; ++i) {
      const at = i * step, strength = i % PARTS === 0 ? STRONG : FAINT, half = Math.sqrt(Math.max(reach ** 2 - at ** 2, 0));
      for (let piece = 0; piece < PIECES; ++piece) {
        const from = -half + (2 * half * piece) / PIECES, to = -half + (2 * half * (piece + 1)) / PIECES;
        corner(from, at, strength), corner(to, at, strength);
        corner(at, from, strength), corner(at, to, strength);
      }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
    geometry.setAttribute('color', new THREE.Float32BufferAttribute(colours, 3));
    return geometry;
  }
}

/** Height of the lowest node or ellipsoid; at most 0. */
function lowestOf({ nodes, elements, bodyScale }: Geometry): number {
  const pose = initialPose(nodes);
  let lowest = nodes.reduce((least, node) => Math.min(least, node.position[2]), 0);
  for (const { masses, points } of elements)
    for (const { point, mass, moments, axes } of masses) {
      const R = orientationAt(pose, points[point], axes), sizes = inertiaEllipsoid(mass, moments);
      lowest = Math.min(lowest, pointAt(pose, points[point])[2] - bodyScale * Math.hypot(R[6] * sizes[0], R[7] * sizes[1], R[8] * sizes[2]));
    }
  return lowest;
}
