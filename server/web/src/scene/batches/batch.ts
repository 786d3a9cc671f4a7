/** Many things of one kind in one call to the graphics card, moved to where the nodes are. */
import type * as THREE from 'three';
import type { Pose } from '../../geometry';

export interface Batch {
  readonly object: THREE.Object3D;
  /** Moves all; the points that it hangs on have been moved before. */
  update(pose: Pose): void;
  /** What a hit of the mouse means. */
  idOf(hit: THREE.Intersection): string | undefined;
  highlight(id: string | undefined, colour: THREE.Color): void;
  dispose(): void;
}
