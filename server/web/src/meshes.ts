/** Triangles out of mesh files, and where a sidecar puts them. */
import * as THREE from 'three';
import { GLTFLoader } from 'three/examples/jsm/loaders/GLTFLoader.js';
import { OBJLoader } from 'three/examples/jsm/loaders/OBJLoader.js';
import { STLLoader } from 'three/examples/jsm/loaders/STLLoader.js';
import type { ElementShape, MeshShape, NodeShape } from './geometry';
import { readSidecar, SidecarError, type Placement } from './sidecar';

/** By path, as the service names them. */
export type Attachments = ReadonlyMap<string, Uint8Array>;

export interface Meshes {
  meshes: MeshShape[];
  triangles: Float32Array[];
}

/** What the sidecar among the attachments puts into the scene; none without one. Throws SidecarError. */
export async function meshesOf(attachments: Attachments, nodes: readonly NodeShape[], elements: readonly ElementShape[]): Promise<Meshes> {
  const path = [...attachments.keys()].find((name) => name.endsWith('.view.json'));
  const found: Meshes = { meshes: [], triangles: [] };
  if (path === undefined) return found;
  const indices = new Map(nodes.map((node, i) => [node.label, i])), known = new Map<string, number>();
  const placements = readSidecar(path, new TextDecoder().decode(attachments.get(path)), new Set(indices.keys()));
  for (const [i, placement] of placements.entries()) {
    const file = besides(path, placement.file);
    if (!known.has(file)) {
      known.set(file, found.triangles.length);
      found.triangles.push(await trianglesOf(file, attachments).catch((thrown: unknown) => {
        throw new SidecarError(`${path}: meshes[${i}].file: ${thrown instanceof Error ? thrown.message : String(thrown)}`);
      }));
    }
    found.meshes.push(shapeOf(placement, indices, elements, known.get(file) as number));
  }
  return found;
}

function shapeOf(placement: Placement, indices: ReadonlyMap<number, number>, elements: readonly ElementShape[], triangles: number): MeshShape {
  const { offset, orientation, scale, colour, node: label } = placement;
  const node = label === undefined ? -1 : indices.get(label) ?? -1;
  const bodies = elements.filter(({ points, masses }) => masses.some((mass) => points[mass.point].node === node));
  const id = node < 0 ? '' : bodies.length === 1 ? bodies[0].id : `node.structural:${label}`;
  return { id, point: { name: 'mesh', node, offset }, orientation, scale, colour, triangles };
}

/** The path of a file that is named relative to the folder of another. */
function besides(path: string, name: string): string {
  const parts = path.split('/').slice(0, -1);
  for (const part of name.split('/')) {
    if (part === '..') parts.pop();
    else if (part !== '.' && part !== '') parts.push(part);
  }
  return parts.join('/');
}

async function trianglesOf(path: string, attachments: Attachments): Promise<Float32Array> {
  const data = attachments.get(path), ending = /\.[^.]*$/.exec(path)?.[0].toLowerCase();
  if (!data) throw new Error(`"${path}" is not there`);
  const bytes = data.slice().buffer;
  switch (ending) {
    case '.stl': return flat(new THREE.Mesh(new STLLoader().parse(bytes)), path);
    case '.obj': return flat(new OBJLoader().parse(new TextDecoder().decode(data)), path);
    case '.glb':
    case '.gltf': return flat(await readGltf(path, bytes, attachments), path);
    default: throw new Error(`"${path}" must be an .obj, .stl, .glb or .gltf file`);
  }
}

/** Other files that it names are among the attachments. */
async function readGltf(path: string, bytes: ArrayBuffer, attachments: Attachments): Promise<THREE.Object3D> {
  const manager = new THREE.LoadingManager(), addresses: string[] = [];
  manager.setURLModifier((name) => {
    const data = attachments.get(besides(path, decodeURIComponent(name)));
    if (!data) return name;
    addresses.push(URL.createObjectURL(new Blob([data.slice()])));
    return addresses[addresses.length - 1];
  });
  try {
    return (await new GLTFLoader(manager).parseAsync(bytes, '')).scene;
  } finally {
    addresses.forEach((address) => URL.revokeObjectURL(address));
  }
}

/** Corners of all triangles, nine numbers each, in the frame of the whole. */
function flat(whole: THREE.Object3D, path: string): Float32Array {
  const parts: Float32Array[] = [], at = new THREE.Vector3();
  whole.updateMatrixWorld(true);
  whole.traverse((object) => {
    if (!(object instanceof THREE.Mesh)) return;
    const { geometry } = object as THREE.Mesh, position = (geometry.index ? geometry.toNonIndexed() : geometry).getAttribute('position');
    if (!position) return;
    const corners = new Float32Array(3 * position.count);
    for (let i = 0; i < position.count; ++i) at.fromBufferAttribute(position, i).applyMatrix4(object.matrixWorld).toArray(corners, 3 * i);
    parts.push(corners);
  });
  const all = new Float32Array(parts.reduce((sum, part) => sum + part.length, 0));
  parts.reduce((from, part) => (all.set(part, from), from + part.length), 0);
  if (all.length === 0) throw new Error(`"${path}" has no triangles`);
  if (!all.every(Number.isFinite)) throw new Error(`"${path}" has corners that are no numbers`);
  return all;
}
