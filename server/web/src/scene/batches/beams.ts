/** Beams as flat bars that bend and twist with their nodes. */
import * as THREE from 'three';
import type { BeamCurve } from '../../beam_curve';
import type { Pose } from '../../geometry';
import type { Points } from '../points';
import type { Batch } from './batch';

export interface BeamItem {
  id: string;
  curve: BeamCurve;
  /** Half sizes of the section along its two axes. */
  width: number;
  height: number;
}

/** Corners of the section, around it. */
const CORNERS = [[1, 1], [-1, 1], [-1, -1], [1, -1]];

export class BeamBatch implements Batch {
  readonly object: THREE.Mesh;
  /** Beam of each triangle. */
  private readonly owners: string[] = [];

  constructor(private readonly items: BeamItem[], private readonly points: Points, private readonly colour: THREE.Color) {
    const index: number[] = [];
    let first = 0;
    for (const { id, curve } of items) {
      const stations = curve.stations.length / 9;
      this.join(index, id, first, stations);
      first += 4 * stations;
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(3 * first), 3).setUsage(THREE.DynamicDrawUsage));
    geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(3 * first), 3));
    geometry.setIndex(index);
    this.object = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ vertexColors: true, flatShading: true, side: THREE.DoubleSide }));
    this.object.frustumCulled = false;
    this.highlight(undefined, colour);
  }

  /** Sides between stations, and the two ends. */
  private join(index: number[], id: string, first: number, stations: number): void {
    const quad = (a: number, b: number, c: number, d: number) => {
      index.push(a, b, c, a, c, d);
      this.owners.push(id, id);
    };
    for (let i = 1; i < stations; ++i)
      for (let k = 0; k < 4; ++k) {
        const a = first + 4 * (i - 1), b = first + 4 * i, next = (k + 1) % 4;
        quad(a + k, a + next, b + next, b + k);
      }
    const last = first + 4 * (stations - 1);
    quad(first, first + 1, first + 2, first + 3);
    quad(last, last + 1, last + 2, last + 3);
  }

  update(pose: Pose): void {
    const position = this.object.geometry.attributes.position as THREE.BufferAttribute, out = position.array as Float32Array;
    let at = 0;
    for (const { curve, width, height } of this.items) {
      curve.update(pose, this.points.x);
      const s = curve.stations;
      for (let i = 0; i < s.length; i += 9)
        for (const [a, b] of CORNERS)
          for (let k = 0; k < 3; ++k) out[at++] = s[i + k] + a * width * s[i + 3 + k] + b * height * s[i + 6 + k];
    }
    position.needsUpdate = true;
    this.object.geometry.boundingSphere = null;
  }

  idOf(hit: THREE.Intersection): string | undefined {
    return hit.faceIndex === undefined || hit.faceIndex === null ? undefined : this.owners[hit.faceIndex];
  }

  highlight(id: string | undefined, selected: THREE.Color): void {
    const colours = this.object.geometry.attributes.color as THREE.BufferAttribute;
    let at = 0;
    for (const { id: owner, curve } of this.items) {
      const colour = owner === id ? selected : this.colour;
      for (const end = at + (4 * curve.stations.length) / 9; at < end; ++at) colours.setXYZ(at, colour.r, colour.g, colour.b);
    }
    colours.needsUpdate = true;
  }

  dispose(): void {
    this.object.geometry.dispose();
    (this.object.material as THREE.Material).dispose();
  }
}
