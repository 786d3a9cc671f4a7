/** Faces, each a fan of triangles around its first corner. */
import * as THREE from 'three';
import type { Points } from '../points';
import type { Batch } from './batch';

export interface FaceItem {
  id: string;
  points: number[];
}

export class FaceBatch implements Batch {
  readonly object: THREE.Mesh;
  private readonly owners: string[] = [];
  /** Points of the triangles, three each. */
  private readonly corners: number[] = [];

  constructor(items: FaceItem[], private readonly points: Points, private readonly colour: THREE.Color) {
    for (const item of items)
      for (let i = 2; i < item.points.length; ++i) {
        this.owners.push(item.id);
        this.corners.push(item.points[0], item.points[i - 1], item.points[i]);
      }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(3 * this.corners.length), 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(3 * this.corners.length), 3));
    const material = new THREE.MeshLambertMaterial({ vertexColors: true, side: THREE.DoubleSide, flatShading: true });
    this.object = new THREE.Mesh(geometry, material);
    this.object.frustumCulled = false;
    this.highlight(undefined, colour);
  }

  update(): void {
    const position = this.object.geometry.attributes.position as THREE.BufferAttribute, x = this.points.x;
    this.corners.forEach((point, i) => position.setXYZ(i, x[3 * point], x[3 * point + 1], x[3 * point + 2]));
    position.needsUpdate = true;
    this.object.geometry.boundingSphere = null;
  }

  idOf(hit: THREE.Intersection): string | undefined {
    return hit.faceIndex === undefined || hit.faceIndex === null ? undefined : this.owners[hit.faceIndex];
  }

  highlight(id: string | undefined, selected: THREE.Color): void {
    const colours = this.object.geometry.attributes.color as THREE.BufferAttribute;
    this.owners.forEach((owner, i) => {
      const colour = owner === id ? selected : this.colour;
      for (let k = 0; k < 3; ++k) colours.setXYZ(3 * i + k, colour.r, colour.g, colour.b);
    });
    colours.needsUpdate = true;
  }

  dispose(): void {
    this.object.geometry.dispose();
    (this.object.material as THREE.Material).dispose();
  }
}
