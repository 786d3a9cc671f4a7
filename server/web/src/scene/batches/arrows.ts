/** Arrows: loads, reactions, velocities. */
import * as THREE from 'three';
import type { Pose } from '../../geometry';
import type { Points } from '../points';
import { solids, type Solids } from '../solids';
import type { Batch } from './batch';
import { writeBar } from './matrices';

export interface ArrowItem {
  id: string;
  point: number;
  /** Handles of the variables that `read` needs. */
  handles: number[];
  /** Its global components at a pose. */
  read(pose: Pose, out: number[]): void;
}

const SHAFT = new THREE.CylinderGeometry(1, 1, 1, 12).translate(0, 0.5, 0);
const HEAD = new THREE.ConeGeometry(1, 1, 16).translate(0, -0.5, 0);
/** Parts of the longest arrow. */
const WIDTH = 0.022, HEAD_LENGTH = 0.2, HEAD_WIDTH = 0.38;

export interface ArrowLook {
  /** Length of the longest arrow seen so far. */
  reach: number;
  /** Loads push at their points with their tips; others begin there. */
  tipAtPoint: boolean;
  /** Moments have two heads, one behind the other. */
  heads: 1 | 2;
  /** Arrows of less than this are not drawn. */
  least?: () => number;
}

export class ArrowBatch implements Batch {
  readonly object = new THREE.Group();
  private readonly shafts: Solids;
  private readonly heads: Solids;
  private readonly vectors: number[][];
  /** Seen so far. */
  largest = 0;
  private readonly direction = [0, 0, 1];
  private readonly place = [0, 0, 0];

  constructor(readonly items: ArrowItem[], private readonly points: Points, private readonly colour: THREE.Color, private readonly look: ArrowLook) {
    this.shafts = solids(SHAFT, items.length);
    this.heads = solids(HEAD, items.length * look.heads);
    this.vectors = items.map(() => [0, 0, 0]);
    this.object.add(this.shafts.object, this.heads.object);
    this.highlight(undefined, colour);
  }

  update(pose: Pose): void {
    this.items.forEach((item, i) => {
      const vector = this.vectors[i];
      item.read(pose, vector);
      for (let k = 0; k < 3; ++k) if (!Number.isFinite(vector[k])) vector[k] = 0;
      this.largest = Math.max(this.largest, Math.hypot(vector[0], vector[1], vector[2]));
    });
    this.items.forEach((_, i) => this.write(i));
    this.shafts.moved();
    this.heads.moved();
  }

  private write(i: number): void {
    const { direction, place, vectors, points } = this, { reach, tipAtPoint, heads, least } = this.look;
    const size = Math.hypot(vectors[i][0], vectors[i][1], vectors[i][2]);
    const length = size > (least?.() ?? 0) ? (reach * size) / this.largest : 0;
    const head = Math.min(reach * HEAD_LENGTH, length), from = 3 * this.items[i].point;
    for (let k = 0; k < 3; ++k) direction[k] = size > 0 ? vectors[i][k] / size : Number(k === 2);
    const begin = tipAtPoint ? -length : 0;
    for (let k = 0; k < 3; ++k) place[k] = points.x[from + k] + begin * direction[k];
    writeBar(this.shafts.matrices, 16 * i, place, direction, Math.max(length - head, 0), length > 0 ? reach * WIDTH : 0);
    for (let k = 0; k < 3; ++k) place[k] += length * direction[k];
    for (let k = 0; k < heads; ++k) {
      writeBar(this.heads.matrices, 16 * (heads * i + k), place, direction, head, head * HEAD_WIDTH);
      for (let j = 0; j < 3; ++j) place[j] -= 0.7 * head * direction[j];
    }
  }

  idOf(hit: THREE.Intersection): string | undefined {
    const part = hit.object === this.heads.object ? this.heads : this.shafts, copy = part.copyOf(hit);
    return copy === undefined ? undefined : this.items[part === this.heads ? Math.floor(copy / this.look.heads) : copy]?.id;
  }

  highlight(id: string | undefined, selected: THREE.Color): void {
    this.items.forEach((item, i) => {
      const colour = item.id === id ? selected : this.colour;
      this.shafts.paint(i, colour);
      for (let k = 0; k < this.look.heads; ++k) this.heads.paint(this.look.heads * i + k, colour);
    });
  }

  dispose(): void {
    this.shafts.dispose();
    this.heads.dispose();
  }
}
