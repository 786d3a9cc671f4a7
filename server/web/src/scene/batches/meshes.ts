/** Meshes out of files, as bodies. */
import * as THREE from 'three';
import { toCreasedNormals } from 'three/examples/jsm/utils/BufferGeometryUtils.js';
import type { Points } from '../points';
import { GlyphBatch, type GlyphItem } from './glyphs';

/** Faces that meet at less than this are one smooth surface, in radians. */
const CREASE = Math.PI / 6;
/** What was made of triangles, which do not change. */
const smooth = new WeakMap<Float32Array, THREE.BufferGeometry>();

function solidOf(triangles: Float32Array): THREE.BufferGeometry {
  let geometry = smooth.get(triangles);
  if (!geometry) {
    geometry = toCreasedNormals(new THREE.BufferGeometry().setAttribute('position', new THREE.BufferAttribute(triangles, 3)), CREASE);
    geometry.computeBoundingSphere();
    smooth.set(triangles, geometry);
  }
  return geometry;
}

/** Copies of one mesh in one colour. */
export class MeshBatch extends GlyphBatch {
  private readonly solid: THREE.BufferGeometry;

  constructor(triangles: Float32Array, items: GlyphItem[], points: Points, colour: THREE.Color) {
    super(solidOf(triangles), items, points, colour);
    this.solid = solidOf(triangles);
    (this.object.material as THREE.Material).side = THREE.DoubleSide;
  }

  /** A ball around each copy. */
  balls(): THREE.Sphere[] {
    const one = this.solid.boundingSphere ?? new THREE.Sphere();
    return Array.from({ length: this.matrices.length / 16 }, (_, i) => one.clone().applyMatrix4(new THREE.Matrix4().fromArray(this.matrices, 16 * i)));
  }

  dispose(): void {
    super.dispose();
    this.solid.dispose();
  }
}
