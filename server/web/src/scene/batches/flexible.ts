/** A flexible body: its points, deformed, and bars or thin lines between near ones. */
import * as THREE from 'three';
import { deformedPoints, type FlexibleBody, type Pose } from '../../geometry';
import { joins } from '../../nearest';
import { solids, type Solids } from '../solids';
import type { ValueScale } from '../value_colour';
import type { Batch } from './batch';
import { writeBar } from './matrices';

/** More joins than this are thin lines. */
const MOST_BARS = 400;
const BAR = new THREE.CylinderGeometry(1, 1, 1, 8).translate(0, 0.5, 0);
const tint = new THREE.Color(), from = [0, 0, 0], along = [0, 0, 0];

export class FlexibleBatch implements Batch {
  readonly object = new THREE.Group();
  factor = 1;
  private readonly points: THREE.Points;
  private readonly joins: [number, number][];
  private readonly bars?: Solids;
  private readonly amplitudes: number[];
  private readonly straight: Float32Array;
  private readonly shades: Float32Array;
  private selected?: THREE.Color;

  /** `radius`: of the bars. */
  constructor(private readonly body: FlexibleBody, private readonly id: string, private readonly scale: ValueScale, private readonly radius: number) {
    const count = body.positions.length / 3;
    this.amplitudes = body.amplitudes.map(() => 0);
    this.straight = new Float32Array(3 * count);
    this.shades = new Float32Array(3 * count);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(3 * count), 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(this.shades, 3));
    this.points = new THREE.Points(geometry, new THREE.PointsMaterial({ vertexColors: true, size: 7, sizeAttenuation: false }));
    this.add(this.points);
    this.joins = joins(body.positions);
    if (this.joins.length > MOST_BARS) this.add(this.lines(geometry));
    else if (this.joins.length > 0) this.object.add((this.bars = solids(BAR, this.joins.length)).object);
  }

  private add(object: THREE.Points | THREE.LineSegments): void {
    object.frustumCulled = false;
    this.object.add(object);
  }

  private lines({ attributes }: THREE.BufferGeometry): THREE.LineSegments {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', attributes.position);
    geometry.setAttribute('color', attributes.color);
    geometry.setIndex(this.joins.flat());
    return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.7 }));
  }

  update(pose: Pose): void {
    const position = this.points.geometry.attributes.position as THREE.BufferAttribute, out = position.array as Float32Array;
    this.body.amplitudes.forEach((handle, mode) => (this.amplitudes[mode] = pose.value(handle, 0) || 0));
    deformedPoints(this.body, pose, this.amplitudes, 0, this.straight);
    deformedPoints(this.body, pose, this.amplitudes, this.factor, out);
    position.needsUpdate = true;
    this.shade(out);
    this.stretch(out);
    for (const object of this.object.children) if (object instanceof THREE.Points || object instanceof THREE.LineSegments) object.geometry.boundingSphere = null;
  }

  /** From the colour of the body at rest to that of the largest displacement seen in any body. */
  private shade(out: Float32Array): void {
    const { straight, shades, scale } = this;
    const moved = (i: number) => Math.hypot(out[i] - straight[i], out[i + 1] - straight[i + 1], out[i + 2] - straight[i + 2]) / this.factor;
    scale.colour(0, tint);
    for (let i = 0; i < out.length; i += 3) scale.colour(moved(i), tint);
    for (let i = 0; i < out.length; i += 3) {
      if (this.selected) tint.copy(this.selected);
      else scale.colour(moved(i), tint);
      tint.toArray(shades, i);
    }
    this.points.geometry.attributes.color.needsUpdate = true;
  }

  /** Puts the bars between their points, in the colour between theirs. */
  private stretch(x: Float32Array): void {
    const { bars, shades } = this;
    if (!bars) return;
    this.joins.forEach(([a, b], i) => {
      for (let k = 0; k < 3; ++k) from[k] = x[3 * a + k], along[k] = x[3 * b + k] - from[k];
      const length = Math.hypot(along[0], along[1], along[2]);
      for (let k = 0; k < 3; ++k) along[k] = length > 0 ? along[k] / length : Number(k === 2);
      writeBar(bars.matrices, 16 * i, from, along, length, this.radius);
      const shade = (k: number) => (shades[3 * a + k] + shades[3 * b + k]) / 2;
      bars.paint(i, tint.setRGB(shade(0), shade(1), shade(2)));
    });
    bars.moved();
  }

  /** Where its points are drawn, three numbers each. */
  get where(): ArrayLike<number> {
    return this.points.geometry.attributes.position.array;
  }

  idOf(): string {
    return this.id;
  }

  highlight(id: string | undefined, selected: THREE.Color): void {
    this.selected = id === this.id ? selected : undefined;
    this.shade(this.where as Float32Array);
    this.stretch(this.where as Float32Array);
  }

  dispose(): void {
    this.bars?.dispose();
    for (const object of this.object.children)
      if (object instanceof THREE.Points || object instanceof THREE.LineSegments) {
        object.geometry.dispose();
        (object.material as THREE.Material).dispose();
      }
  }
}
