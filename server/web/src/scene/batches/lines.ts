/** Lines through points, straight or not. */
import * as THREE from 'three';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import type { Pose } from '../../geometry';
import { hasCard } from '../solids';
import type { Batch } from './batch';

/** A line: fills the positions of its corners, three numbers each. */
export interface LineItem {
  id: string;
  corners: number;
  fill(out: Float32Array, pose: Pose): void;
  /** Absent: that of the batch. */
  colour?: THREE.Color;
}

/** Above so many pieces, lines are one pixel wide; without a graphics card, wide ones cost much more. */
const MANY_PIECES = 4000, MANY_WITHOUT_CARD = 600;
/** Corners of a wide piece as `LineMaterial` wants them: across from −1 to 1, along from −1 to 2 with the round ends. */
const CORNERS = [[-1, 2], [1, 2], [-1, 1], [1, 1], [-1, 0], [1, 0], [-1, -1], [1, -1]];
const CORNERS_UV = [[-1, 2], [1, 2], [-1, 1], [1, 1], [-1, -1], [1, -1], [-1, -2], [1, -2]];
const TRIANGLES = [0, 2, 1, 2, 3, 1, 2, 4, 3, 4, 5, 3, 4, 6, 5, 6, 7, 5];

export class LineBatch implements Batch {
  readonly object: THREE.Mesh | THREE.LineSegments;
  /** Ends of the pieces, six numbers each. */
  private readonly segments: Float32Array;
  private readonly corners: Float32Array;
  private readonly owners: LineItem[] = [];
  /** What the mouse hits: it is as thin as a line. */
  private readonly skeleton: THREE.LineSegments;

  constructor(readonly items: LineItem[], private readonly colour: THREE.Color, width: number) {
    for (const item of items) for (let i = 1; i < item.corners; ++i) this.owners.push(item);
    this.corners = new Float32Array(3 * items.reduce((largest, item) => Math.max(largest, item.corners), 0));
    this.segments = new Float32Array(6 * this.owners.length);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(this.segments, 3).setUsage(THREE.DynamicDrawUsage));
    this.skeleton = new THREE.LineSegments(geometry);
    this.object = this.owners.length > (hasCard() ? MANY_PIECES : MANY_WITHOUT_CARD) ? this.thin() : this.wide(width);
    this.object.frustumCulled = false;
    this.object.raycast = (ray, hits) => this.skeleton.raycast(ray, hits);
    this.highlight(undefined, colour);
  }

  /** Pieces as rectangles that face the reader, all in one mesh. */
  private wide(width: number): THREE.Mesh {
    const count = this.owners.length, geometry = new THREE.BufferGeometry();
    const each = (make: (k: number) => number[]) => new Float32Array(Array.from({ length: 8 * count }, (_, i) => make(i % 8)).flat());
    geometry.setAttribute('position', new THREE.BufferAttribute(each((k) => [...CORNERS[k], 0]), 3));
    geometry.setAttribute('uv', new THREE.BufferAttribute(each((k) => CORNERS_UV[k]), 2));
    for (const name of ['instanceStart', 'instanceEnd']) geometry.setAttribute(name, new THREE.BufferAttribute(new Float32Array(24 * count), 3).setUsage(THREE.DynamicDrawUsage));
    for (const name of ['instanceColorStart', 'instanceColorEnd']) geometry.setAttribute(name, new THREE.BufferAttribute(new Float32Array(24 * count), 3));
    geometry.setIndex(Array.from({ length: count }, (_, i) => TRIANGLES.map((corner) => 8 * i + corner)).flat());
    return new THREE.Mesh(geometry, new LineMaterial({ linewidth: width, vertexColors: true, worldUnits: false }));
  }

  private thin(): THREE.LineSegments {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', this.skeleton.geometry.attributes.position);
    geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(this.segments.length), 3));
    return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: true }));
  }

  update(pose: Pose): void {
    const { corners, segments } = this;
    let at = 0;
    for (const item of this.items) {
      item.fill(corners, pose);
      for (let i = 3; i < 3 * item.corners; i += 3, at += 6)
        for (let k = 0; k < 3; ++k) segments[at + k] = corners[i - 3 + k], segments[at + 3 + k] = corners[i + k];
    }
    this.skeleton.geometry.attributes.position.needsUpdate = true;
    this.skeleton.geometry.boundingSphere = null;
    if (this.object instanceof THREE.Mesh) this.spread(segments, 'instanceStart', 'instanceEnd');
  }

  /** Gives six numbers of each piece to its eight corners: three to one attribute, three to the other. */
  private spread(numbers: Float32Array, first: string, second: string): void {
    const { attributes } = this.object.geometry;
    const one = attributes[first].array as Float32Array, two = attributes[second].array as Float32Array;
    for (let from = 0, to = 0; from < numbers.length; from += 6)
      for (let corner = 0; corner < 8; ++corner, to += 3)
        for (let k = 0; k < 3; ++k) one[to + k] = numbers[from + k], two[to + k] = numbers[from + 3 + k];
    attributes[first].needsUpdate = attributes[second].needsUpdate = true;
  }

  idOf(hit: THREE.Intersection): string | undefined {
    return hit.index === undefined ? undefined : this.owners[Math.floor(hit.index / 2)]?.id;
  }

  highlight(id: string | undefined, selected: THREE.Color): void {
    const colours = new Float32Array(6 * this.owners.length);
    this.owners.forEach((owner, i) => {
      const colour = owner.id === id ? selected : owner.colour ?? this.colour;
      colour.toArray(colours, 6 * i);
      colour.toArray(colours, 6 * i + 3);
    });
    if (this.object instanceof THREE.Mesh) return this.spread(colours, 'instanceColorStart', 'instanceColorEnd');
    const attribute = this.object.geometry.attributes.color as THREE.BufferAttribute;
    (attribute.array as Float32Array).set(colours);
    attribute.needsUpdate = true;
  }

  dispose(): void {
    this.object.geometry.dispose();
    this.skeleton.geometry.dispose();
    (this.object.material as THREE.Material).dispose();
  }
}
