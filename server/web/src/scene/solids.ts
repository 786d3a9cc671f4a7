/** Many copies of one solid in one call to the graphics card, each with its own matrix and colour. */
import * as THREE from 'three';
import { mergeVertices } from 'three/examples/jsm/utils/BufferGeometryUtils.js';

export interface Solids {
  readonly object: THREE.Mesh;
  /** Of the copies, 16 numbers by columns each; `moved` tells that they changed. */
  readonly matrices: Float32Array;
  moved(): void;
  paint(copy: number, colour: THREE.Color): void;
  /** Number of the copy that was hit. */
  copyOf(hit: THREE.Intersection): number | undefined;
  dispose(): void;
}

/** More copies than this are put into one mesh by the page where there is no graphics card: there, each instance costs about 20 µs. */
const INSTANCES_WITHOUT_CARD = 40;
let withCard = true;

/** Says what draws: a graphics card, or a program in place of one. */
export function drawnBy(card: boolean): void {
  withCard = card;
}

export function hasCard(): boolean {
  return withCard;
}

export function solids(geometry: THREE.BufferGeometry, count: number, opacity = 1): Solids {
  const made = withCard || count <= INSTANCES_WITHOUT_CARD ? new Instanced(geometry, count, opacity) : new Merged(geometry, count, opacity);
  made.object.frustumCulled = false;
  return made;
}

/** What one sees through hides nothing, not even another one at the same place. */
function seen(opacity: number) {
  return { opacity, transparent: opacity < 1, depthWrite: opacity >= 1 };
}

class Instanced implements Solids {
  readonly object: THREE.InstancedMesh;

  constructor(geometry: THREE.BufferGeometry, count: number, opacity: number) {
    this.object = new THREE.InstancedMesh(geometry, new THREE.MeshLambertMaterial(seen(opacity)), count);
    this.object.instanceMatrix.setUsage(THREE.DynamicDrawUsage);
  }

  get matrices(): Float32Array {
    return this.object.instanceMatrix.array as Float32Array;
  }

  moved(): void {
    this.object.instanceMatrix.needsUpdate = true;
    this.object.boundingSphere = null;
  }

  paint(copy: number, colour: THREE.Color): void {
    this.object.setColorAt(copy, colour);
    if (this.object.instanceColor) this.object.instanceColor.needsUpdate = true;
  }

  copyOf(hit: THREE.Intersection): number | undefined {
    return hit.instanceId;
  }

  dispose(): void {
    (this.object.material as THREE.Material).dispose();
    this.object.dispose();
  }
}

class Merged implements Solids {
  readonly object: THREE.Mesh;
  readonly matrices: Float32Array;
  /** Corners and triangles of one copy. */
  private readonly corners: ArrayLike<number>;
  private readonly triangles: number;

  constructor(geometry: THREE.BufferGeometry, count: number, opacity: number) {
    const bare = new THREE.BufferGeometry().setAttribute('position', geometry.attributes.position).setIndex(geometry.index);
    const one = mergeVertices(bare), index = one.index as THREE.BufferAttribute;
    this.matrices = new Float32Array(16 * count);
    this.corners = one.attributes.position.array;
    this.triangles = index.count / 3;
    const numbers = this.corners.length, all = new THREE.BufferGeometry();
    all.setAttribute('position', new THREE.BufferAttribute(new Float32Array(numbers * count), 3).setUsage(THREE.DynamicDrawUsage));
    all.setAttribute('color', new THREE.BufferAttribute(new Float32Array(numbers * count), 3));
    const indices = new Uint32Array(index.count * count);
    for (let copy = 0; copy < count; ++copy) for (let i = 0; i < index.count; ++i) indices[copy * index.count + i] = index.getX(i) + (copy * numbers) / 3;
    all.setIndex(new THREE.BufferAttribute(indices, 1));
    this.object = new THREE.Mesh(all, new THREE.MeshLambertMaterial({ vertexColors: true, flatShading: true, ...seen(opacity) }));
  }

  moved(): void {
    const { matrices: m, corners } = this, position = this.object.geometry.attributes.position, out = position.array as Float32Array;
    for (let at = 0, to = 0; at < m.length; at += 16)
      for (let i = 0; i < corners.length; i += 3) {
        const x = corners[i], y = corners[i + 1], z = corners[i + 2];
        out[to++] = m[at] * x + m[at + 4] * y + m[at + 8] * z + m[at + 12];
        out[to++] = m[at + 1] * x + m[at + 5] * y + m[at + 9] * z + m[at + 13];
        out[to++] = m[at + 2] * x + m[at + 6] * y + m[at + 10] * z + m[at + 14];
      }
    position.needsUpdate = true;
    this.object.geometry.boundingSphere = null;
  }

  paint(copy: number, colour: THREE.Color): void {
    const attribute = this.object.geometry.attributes.color, numbers = this.corners.length;
    for (let at = copy * numbers; at < (copy + 1) * numbers; at += 3) colour.toArray(attribute.array, at);
    attribute.needsUpdate = true;
  }

  copyOf(hit: THREE.Intersection): number | undefined {
    return hit.faceIndex === undefined || hit.faceIndex === null ? undefined : Math.floor(hit.faceIndex / this.triangles);
  }

  dispose(): void {
    this.object.geometry.dispose();
    (this.object.material as THREE.Material).dispose();
  }
}
