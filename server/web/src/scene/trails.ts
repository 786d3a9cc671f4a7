/** The paths that chosen nodes have gone. */
import * as THREE from 'three';
import type { Vec3 } from '../algebra';

export class Trails {
  readonly object: THREE.LineSegments<THREE.BufferGeometry, THREE.Material>;

  constructor(colour: THREE.Color) {
    this.object = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: colour }));
    this.object.frustumCulled = false;
  }

  set(paths: Vec3[][]): void {
    const segments: number[] = [];
    for (const path of paths) for (let i = 1; i < path.length; ++i) segments.push(...path[i - 1], ...path[i]);
    this.object.geometry.dispose();
    this.object.geometry = new THREE.BufferGeometry();
    this.object.geometry.setAttribute('position', new THREE.Float32BufferAttribute(segments, 3));
  }
}
