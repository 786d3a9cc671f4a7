/** A flexible body: its points, deformed, and thin lines between near ones. */
import * as THREE from 'three';
import { deformedPoints, type FlexibleBody, type Pose } from '../../geometry';
import { joins } from '../../nearest';
import type { Batch } from './batch';

export class FlexibleBatch implements Batch {
  readonly object = new THREE.Group();
  factor = 1;
  private readonly points: THREE.Points;
  private readonly lines: THREE.LineSegments;
  private readonly amplitudes: number[];
  private readonly straight: Float32Array;
  private readonly shades: Float32Array;
  private largest = 0;

  constructor(private readonly body: FlexibleBody, private readonly id: string, private readonly colour: THREE.Color, private readonly strained: THREE.Color) {
    const count = body.positions.length / 3;
    this.amplitudes = body.amplitudes.map(() => 0);
    this.straight = new Float32Array(3 * count);
    this.shades = new Float32Array(3 * count);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(3 * count), 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(this.shades, 3));
    const lines = geometry.clone();
    lines.setAttribute('position', geometry.attributes.position);
    lines.setAttribute('color', geometry.attributes.color);
    lines.setIndex(joins(body.positions).flat());
    this.points = new THREE.Points(geometry, new THREE.PointsMaterial({ vertexColors: true, size: 7, sizeAttenuation: false }));
    this.lines = new THREE.LineSegments(lines, new THREE.LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.7 }));
    for (const object of [this.points, this.lines]) {
      object.frustumCulled = false;
      this.object.add(object);
    }
  }

  update(pose: Pose): void {
    const position = this.points.geometry.attributes.position as THREE.BufferAttribute, out = position.array as Float32Array;
    this.body.amplitudes.forEach((handle, mode) => (this.amplitudes[mode] = pose.value(handle, 0) || 0));
    deformedPoints(this.body, pose, this.amplitudes, 0, this.straight);
    deformedPoints(this.body, pose, this.amplitudes, this.factor, out);
    position.needsUpdate = true;
    this.shade(out);
    for (const object of [this.points, this.lines]) object.geometry.boundingSphere = null;
  }

  /** From the colour of the body at rest to that of the largest displacement seen. */
  private shade(out: Float32Array): void {
    const { straight, shades, colour, strained } = this;
    const moved = (i: number) => Math.hypot(out[i] - straight[i], out[i + 1] - straight[i + 1], out[i + 2] - straight[i + 2]) / this.factor;
    for (let i = 0; i < out.length; i += 3) this.largest = Math.max(this.largest, moved(i));
    for (let i = 0; i < out.length; i += 3) {
      const part = this.largest > 0 ? moved(i) / this.largest : 0;
      shades[i] = colour.r + part * (strained.r - colour.r);
      shades[i + 1] = colour.g + part * (strained.g - colour.g);
      shades[i + 2] = colour.b + part * (strained.b - colour.b);
    }
    this.points.geometry.attributes.color.needsUpdate = true;
  }

  idOf(): string {
    return this.id;
  }

  highlight(id: string | undefined, selected: THREE.Color): void {
    for (const object of [this.points, this.lines]) {
      const material = object.material as THREE.PointsMaterial | THREE.LineBasicMaterial;
      material.vertexColors = id !== this.id;
      material.color.set(id === this.id ? selected : 0xffffff);
      material.needsUpdate = true;
    }
  }

  dispose(): void {
    for (const object of [this.points, this.lines]) {
      object.geometry.dispose();
      (object.material as THREE.Material).dispose();
    }
  }
}
