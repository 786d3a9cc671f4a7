/** `NAME.view.json` beside a deck: meshes that are drawn with its nodes. */
import { IDENTITY, mat3, vec3, type Mat3, type Vec3 } from './algebra';

/** A mesh in a file, fixed to a node or in space. */
export interface Placement {
  file: string;
  /** Label of a structural node; absent: fixed in space. */
  node?: number;
  /** Of the mesh's origin, in the node's frame. */
  offset: Vec3;
  /** The mesh's axes to the node's. */
  orientation: Mat3;
  /** Lengths of the deck in a length of the mesh. */
  scale: number;
  colour?: string;
}

/** A sidecar that cannot be understood: says where, and what would be right. */
export class SidecarError extends Error {}

const KEYS = ['file', 'node', 'offset', 'orientation', 'scale', 'color'];
/** How far columns of an orientation may be from unit vectors at right angles. */
const SKEW = 1e-6;

/** `labels`: of the structural nodes. */
export function readSidecar(path: string, text: string, labels: ReadonlySet<number>): Placement[] {
  const whole = parse(path, text);
  if (!isObject(whole) || !Array.isArray(whole.meshes)) throw new SidecarError(`${path}: "meshes" is missing: a list of {"node": …, "file": …}`);
  for (const key of Object.keys(whole)) if (key !== 'meshes') throw new SidecarError(`${path}: "${key}" is unknown: there is only "meshes"`);
  return whole.meshes.map((mesh: unknown, i) => placement(mesh, labels, (key, text) => {
    throw new SidecarError(`${path}: meshes[${i}]${key && `.${key}`}: ${text}`);
  }));
}

type Refuse = (key: string, text: string) => never;

function parse(path: string, text: string): unknown {
  try {
    return JSON.parse(text);
  } catch (thrown) {
    const { message } = thrown as SyntaxError, at = Number(/position (\d+)/.exec(message)?.[1]);
    const before = text.slice(0, at).split('\n');
    const place = Number.isFinite(at) ? `:${before.length}:${before[before.length - 1].length + 1}` : '';
    throw new SidecarError(`${path}${place}: this is no JSON: ${message}`);
  }
}

function isObject(value: unknown): value is Record<string, unknown> {
  return typeof value === 'object' && value !== null && !Array.isArray(value);
}

function placement(mesh: unknown, labels: ReadonlySet<number>, refuse: Refuse): Placement {
  if (!isObject(mesh)) return refuse('', 'must be {"node": …, "file": …}');
  for (const key of Object.keys(mesh)) if (!KEYS.includes(key)) refuse(key, `is unknown: there are ${KEYS.join(', ')}`);
  const { file, node, color, scale = 1 } = mesh;
  if (typeof file !== 'string' || file === '') return refuse('file', 'must be the name of an .obj, .stl, .glb or .gltf file beside the deck');
  if (node !== undefined && !(typeof node === 'number' && labels.has(node))) refuse('node', `${JSON.stringify(node)} is no label of a structural node of the deck; without "node" the mesh is fixed in space`);
  if (typeof scale !== 'number' || !(scale > 0)) return refuse('scale', `${JSON.stringify(scale)} must be a number greater than 0`);
  if (color !== undefined && !/^#[0-9a-f]{6}$/i.test(String(color))) refuse('color', `${JSON.stringify(color)} must be like "#8090a0"`);
  return {
    file,
    node: node as number | undefined,
    offset: vec3(numbers(mesh, 'offset', [0, 0, 0], refuse)),
    orientation: rotation(numbers(mesh, 'orientation', IDENTITY, refuse), refuse),
    scale,
    colour: color as string | undefined,
  };
}

function numbers(mesh: Record<string, unknown>, key: string, otherwise: readonly number[], refuse: Refuse): readonly number[] {
  const value = mesh[key];
  if (value === undefined) return otherwise;
  if (!Array.isArray(value) || value.length !== otherwise.length || !value.every((x) => typeof x === 'number')) return refuse(key, `must be ${otherwise.length} numbers`);
  return value as number[];
}

function rotation(values: readonly number[], refuse: Refuse): Mat3 {
  const R = mat3(values), column = (k: number): Vec3 => [R[k], R[k + 3], R[k + 6]];
  const dot = (a: Vec3, b: Vec3) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const [x, y, z] = [column(0), column(1), column(2)];
  const right = dot(x, [y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0]]);
  const errors = [dot(x, x) - 1, dot(y, y) - 1, dot(z, z) - 1, dot(x, y), dot(y, z), dot(z, x), right - 1];
  if (errors.some((error) => !(Math.abs(error) < SKEW))) refuse('orientation', 'must be a rotation matrix by rows: columns of length 1 at right angles, right-handed');
  return R;
}
