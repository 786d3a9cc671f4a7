/** Many things of one kind in one call to the graphics card, moved to where the nodes are. */
import * as THREE from 'three';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import { LineSegments2 } from 'three/examples/jsm/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/examples/jsm/lines/LineSegmentsGeometry.js';
import { norm, type Mat3, type Vec3 } from '../algebra';
import { deformedPoints, orientationAt, pointAt, type FlexibleBody, type PointShape, type Pose } from '../geometry';

/** Where the pieces of a batch belong: the identifier of each. */
export interface Batch {
  readonly object: THREE.Object3D;
  update(pose: Pose): void;
  /** What a hit of the mouse means. */
  idOf(hit: THREE.Intersection): string | undefined;
  highlight(id: string | undefined, colour: THREE.Color): void;
  dispose(): void;
}

export interface GlyphItem {
  id: string;
  point: PointShape;
  local: Mat3;
  size: Vec3;
}

/** The matrix of an object at x with orientation R and sizes s along its axes. */
export function placed(out: THREE.Matrix4, R: Mat3, x: Vec3, s: Vec3): THREE.Matrix4 {
  return out.set(
    R[0] * s[0], R[1] * s[1], R[2] * s[2], x[0],
    R[3] * s[0], R[4] * s[1], R[5] * s[2], x[1],
    R[6] * s[0], R[7] * s[1], R[8] * s[2], x[2],
    0, 0, 0, 1,
  );
}

export class GlyphBatch implements Batch {
  readonly object: THREE.InstancedMesh;
  private readonly matrix = new THREE.Matrix4();

  constructor(geometry: THREE.BufferGeometry, readonly items: GlyphItem[], private readonly colour: THREE.Color, opacity = 1) {
    const material = new THREE.MeshLambertMaterial({ transparent: opacity < 1, opacity });
    this.object = new THREE.InstancedMesh(geometry, material, items.length);
    this.object.frustumCulled = false;
    items.forEach((_, i) => this.object.setColorAt(i, colour));
  }

  update(pose: Pose): void {
    this.items.forEach((item, i) => {
      const R = orientationAt(pose, item.point, item.local);
      this.object.setMatrixAt(i, placed(this.matrix, R, pointAt(pose, item.point), item.size));
    });
    this.object.instanceMatrix.needsUpdate = true;
    this.object.boundingSphere = null;
  }

  idOf(hit: THREE.Intersection): string | undefined {
    return hit.instanceId === undefined ? undefined : this.items[hit.instanceId]?.id;
  }

  highlight(id: string | undefined, colour: THREE.Color): void {
    this.items.forEach((item, i) => this.object.setColorAt(i, item.id === id ? colour : this.colour));
    if (this.object.instanceColor) this.object.instanceColor.needsUpdate = true;
  }

  dispose(): void {
    (this.object.material as THREE.Material).dispose();
    this.object.dispose();
  }
}

/** A piece of a line: fills positions of its corners, three numbers each. */
export interface LineItem {
  id: string;
  corners: number;
  fill(pose: Pose, out: Float32Array, at: number): void;
}

/** Above so many pieces, lines are one pixel wide: without a graphics card, wide ones cost many times as much. */
const MANY_PIECES = 800;

export class LineBatch implements Batch {
  readonly object: LineSegments2 | THREE.LineSegments;
  private readonly corners: Float32Array;
  private readonly segments: Float32Array;
  private readonly owners: string[] = [];

  constructor(readonly items: LineItem[], private readonly colour: THREE.Color, width: number) {
    const count = items.reduce((sum, item) => sum + item.corners - 1, 0);
    this.corners = new Float32Array(3 * items.reduce((largest, item) => Math.max(largest, item.corners), 0));
    this.segments = new Float32Array(6 * count);
    for (const item of items) for (let i = 1; i < item.corners; ++i) this.owners.push(item.id);
    this.object = count > MANY_PIECES ? this.thin() : this.wide(width);
    this.object.frustumCulled = false;
    this.highlight(undefined, colour);
  }

  private wide(width: number): LineSegments2 {
    const geometry = new LineSegmentsGeometry();
    geometry.setPositions(this.segments);
    return new LineSegments2(geometry, new LineMaterial({ linewidth: width, vertexColors: true, worldUnits: false }));
  }

  private thin(): THREE.LineSegments {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(this.segments, 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(this.segments.length), 3));
    return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ vertexColors: true }));
  }

  update(pose: Pose): void {
    let at = 0;
    for (const item of this.items) {
      item.fill(pose, this.corners, 0);
      for (let i = 1; i < item.corners; ++i, at += 6) {
        this.segments.set(this.corners.subarray(3 * i - 3, 3 * i), at);
        this.segments.set(this.corners.subarray(3 * i, 3 * i + 3), at + 3);
      }
    }
    if (this.object instanceof LineSegments2) {
      const start = this.object.geometry.attributes.instanceStart as THREE.InterleavedBufferAttribute;
      (start.data.array as Float32Array).set(this.segments);
      start.data.needsUpdate = true;
    } else {
      this.object.geometry.attributes.position.needsUpdate = true;
    }
    this.object.geometry.boundingSphere = null;
    this.object.geometry.boundingBox = null;
  }

  idOf(hit: THREE.Intersection): string | undefined {
    const piece = this.object instanceof LineSegments2 ? hit.faceIndex : hit.index === undefined ? undefined : Math.floor(hit.index / 2);
    return piece === undefined || piece === null ? undefined : this.owners[piece];
  }

  highlight(id: string | undefined, selected: THREE.Color): void {
    const colours = new Float32Array(6 * this.owners.length);
    this.owners.forEach((owner, i) => {
      const colour = owner === id ? selected : this.colour;
      colour.toArray(colours, 6 * i);
      colour.toArray(colours, 6 * i + 3);
    });
    if (this.object instanceof LineSegments2) {
      this.object.geometry.setColors(colours);
    } else {
      const attribute = this.object.geometry.attributes.color as THREE.BufferAttribute;
      (attribute.array as Float32Array).set(colours);
      attribute.needsUpdate = true;
    }
  }

  dispose(): void {
    this.object.geometry.dispose();
    (this.object.material as THREE.Material).dispose();
  }
}

export interface FaceItem {
  id: string;
  points: PointShape[];
}

/** Faces, each a fan of triangles around its first corner. */
export class FaceBatch implements Batch {
  readonly object: THREE.Mesh;
  private readonly owners: string[] = [];

  constructor(private readonly items: FaceItem[], private readonly colour: THREE.Color) {
    for (const item of items) for (let i = 2; i < item.points.length; ++i) this.owners.push(item.id);
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(9 * this.owners.length), 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(9 * this.owners.length), 3));
    const material = new THREE.MeshLambertMaterial({ vertexColors: true, side: THREE.DoubleSide, flatShading: true });
    this.object = new THREE.Mesh(geometry, material);
    this.object.frustumCulled = false;
    this.highlight(undefined, colour);
  }

  update(pose: Pose): void {
    const position = this.object.geometry.attributes.position as THREE.BufferAttribute;
    let at = 0;
    for (const item of this.items) {
      const corners = item.points.map((point) => pointAt(pose, point));
      for (let i = 2; i < corners.length; ++i, at += 9) (position.array as Float32Array).set([...corners[0], ...corners[i - 1], ...corners[i]], at);
    }
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

export interface ArrowItem {
  id: string;
  point: PointShape;
  /** Of the variable with the arrow's components, global. */
  handle: number;
  /** First of its three numbers. */
  element: number;
  sign: number;
}

/** Arrows whose tips stand at their points; the longest seen so far has the length `reach`. */
export class ArrowBatch implements Batch {
  readonly object = new THREE.Group();
  private readonly shafts: THREE.InstancedMesh;
  private readonly heads: THREE.InstancedMesh;
  private largest = 0;
  private readonly matrix = new THREE.Matrix4();
  private readonly turn = new THREE.Quaternion();

  constructor(private readonly items: ArrowItem[], private readonly colour: THREE.Color, private readonly reach: number) {
    const material = new THREE.MeshLambertMaterial();
    this.shafts = new THREE.InstancedMesh(new THREE.CylinderGeometry(1, 1, 1, 12).translate(0, 0.5, 0), material, items.length);
    this.heads = new THREE.InstancedMesh(new THREE.ConeGeometry(1, 1, 16).translate(0, -0.5, 0), material, items.length);
    for (const mesh of [this.shafts, this.heads]) {
      mesh.frustumCulled = false;
      items.forEach((_, i) => mesh.setColorAt(i, colour));
      this.object.add(mesh);
    }
  }

  update(pose: Pose): void {
    const loads = this.items.map((item) => [0, 1, 2].map((k) => item.sign * (pose.value(item.handle, item.element + k) || 0)) as unknown as Vec3);
    for (const load of loads) this.largest = Math.max(this.largest, norm(load));
    this.items.forEach((item, i) => this.place(i, loads[i], pointAt(pose, item.point)));
    this.shafts.instanceMatrix.needsUpdate = true;
    this.heads.instanceMatrix.needsUpdate = true;
  }

  private place(i: number, load: Vec3, tip: Vec3): void {
    const size = norm(load);
    const length = this.largest > 0 && size > 0 ? (this.reach * size) / this.largest : 0;
    const direction = new THREE.Vector3(...load).normalize();
    this.turn.setFromUnitVectors(new THREE.Vector3(0, 1, 0), length > 0 ? direction : new THREE.Vector3(0, 1, 0));
    const width = this.reach * 0.022, head = Math.min(this.reach * 0.2, length);
    const end = new THREE.Vector3(...tip), start = end.clone().addScaledVector(direction, -length);
    this.shafts.setMatrixAt(i, this.matrix.compose(start, this.turn, new THREE.Vector3(width, Math.max(length - head, 0), width)));
    this.heads.setMatrixAt(i, this.matrix.compose(end, this.turn, new THREE.Vector3(head * 0.38, head, head * 0.38)));
  }

  idOf(hit: THREE.Intersection): string | undefined {
    return hit.instanceId === undefined ? undefined : this.items[hit.instanceId]?.id;
  }

  highlight(id: string | undefined, selected: THREE.Color): void {
    for (const mesh of [this.shafts, this.heads]) {
      this.items.forEach((item, i) => mesh.setColorAt(i, item.id === id ? selected : this.colour));
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
    }
  }

  dispose(): void {
    for (const mesh of [this.shafts, this.heads]) mesh.geometry.dispose(), mesh.dispose();
    (this.shafts.material as THREE.Material).dispose();
  }
}

export interface TubeItem {
  id: string;
  from: PointShape;
  to: PointShape;
  /** Where the tube begins and ends between the two points: lengths from the first; infinite: at the second. */
  start: number;
  end: number;
  radius: number;
}

/** Round bars between points, such as barrel and rod of an actuator. */
export class TubeBatch implements Batch {
  readonly object: THREE.InstancedMesh;
  private readonly matrix = new THREE.Matrix4();
  private readonly turn = new THREE.Quaternion();

  constructor(private readonly items: TubeItem[], private readonly colour: THREE.Color) {
    const material = new THREE.MeshLambertMaterial();
    this.object = new THREE.InstancedMesh(new THREE.CylinderGeometry(1, 1, 1, 24).translate(0, 0.5, 0), material, items.length);
    this.object.frustumCulled = false;
    items.forEach((_, i) => this.object.setColorAt(i, colour));
  }

  update(pose: Pose): void {
    this.items.forEach((item, i) => {
      const first = new THREE.Vector3(...pointAt(pose, item.from)), along = new THREE.Vector3(...pointAt(pose, item.to)).sub(first);
      const length = along.length();
      along.normalize();
      this.turn.setFromUnitVectors(new THREE.Vector3(0, 1, 0), length > 0 ? along : new THREE.Vector3(0, 1, 0));
      const start = Math.min(item.start, length), end = Math.min(item.end, length);
      const size = new THREE.Vector3(item.radius, Math.max(end - start, 0), item.radius);
      this.object.setMatrixAt(i, this.matrix.compose(first.addScaledVector(along, start), this.turn, size));
    });
    this.object.instanceMatrix.needsUpdate = true;
    this.object.boundingSphere = null;
  }

  idOf(hit: THREE.Intersection): string | undefined {
    return hit.instanceId === undefined ? undefined : this.items[hit.instanceId]?.id;
  }

  highlight(id: string | undefined, selected: THREE.Color): void {
    this.items.forEach((item, i) => this.object.setColorAt(i, item.id === id ? selected : this.colour));
    if (this.object.instanceColor) this.object.instanceColor.needsUpdate = true;
  }

  dispose(): void {
    this.object.geometry.dispose();
    (this.object.material as THREE.Material).dispose();
    this.object.dispose();
  }
}

/** The points of a flexible body, deformed. */
export class FlexibleBatch implements Batch {
  readonly object: THREE.Points;
  factor = 1;

  constructor(private readonly body: FlexibleBody, private readonly id: string, private readonly colour: THREE.Color) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(body.positions.length), 3));
    this.object = new THREE.Points(geometry, new THREE.PointsMaterial({ color: colour, size: 5, sizeAttenuation: false }));
    this.object.frustumCulled = false;
  }

  update(pose: Pose): void {
    const position = this.object.geometry.attributes.position as THREE.BufferAttribute;
    const amplitudes = this.body.amplitudes.map((handle) => pose.value(handle, 0) || 0);
    deformedPoints(this.body, pose, amplitudes, this.factor, position.array as Float32Array);
    position.needsUpdate = true;
    this.object.geometry.boundingSphere = null;
  }

  idOf(): string {
    return this.id;
  }

  highlight(id: string | undefined, selected: THREE.Color): void {
    (this.object.material as THREE.PointsMaterial).color.copy(id === this.id ? selected : this.colour);
  }

  dispose(): void {
    this.object.geometry.dispose();
    (this.object.material as THREE.Material).dispose();
  }
}
