/** What batches of equal solids share. */
import type * as THREE from 'three';
import type { Pose } from '../../geometry';
import { solids, type Solids } from '../solids';
import type { Batch } from './batch';

export abstract class Instances implements Batch {
  readonly object: THREE.Mesh;
  protected readonly solids: Solids;

  constructor(geometry: THREE.BufferGeometry, private readonly ids: string[], protected readonly colour: THREE.Color, opacity = 1) {
    this.solids = solids(geometry, ids.length, opacity);
    this.object = this.solids.object;
    ids.forEach((_, i) => this.solids.paint(i, colour));
  }

  abstract update(pose: Pose): void;

  /** Matrices of the solids, 16 numbers by columns each. */
  get matrices(): Float32Array {
    return this.solids.matrices;
  }

  idOf(hit: THREE.Intersection): string | undefined {
    const copy = this.solids.copyOf(hit);
    return copy === undefined ? undefined : this.ids[copy];
  }

  highlight(id: string | undefined, selected: THREE.Color): void {
    this.ids.forEach((other, i) => this.solids.paint(i, other === id ? selected : this.colour));
  }

  dispose(): void {
    this.solids.dispose();
  }
}
