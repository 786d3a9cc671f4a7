/** Eigenmodes as motions of the nodes. */
import { add, multiply, norm, rotationOf, type Vec3 } from './algebra';
import { orientationOf, positionOf, type FlexibleBody, type NodeShape, type Pose } from './geometry';

export interface Mode {
  /** Eigenvalue in 1/s. */
  real: number;
  imaginary: number;
  /** Real and imaginary parts of displacement and rotation vector of each node, global: 12 numbers a node. */
  motion: Float64Array;
  /** Real and imaginary parts of the amplitudes of flexible bodies, by the handles of their variables. */
  amplitudes: Map<number, readonly [number, number]>;
  /** The largest displacement of a point of a flexible body in its frame. */
  deformation: number;
}

/** What of a model can move. */
interface Movable {
  nodes: readonly NodeShape[];
  bodies: readonly FlexibleBody[];
}

/** Where a node's displacement and rotation stand among the unknowns, by the unknowns' names: "structural node 7 (tip), unknown of: …". */
export function unknownsOfNodes(names: readonly string[], nodes: readonly NodeShape[]): (number | undefined)[] {
  const first = new Map<number, number>();
  names.forEach((name, at) => {
    const label = /^structural node (-?\d+)\b/.exec(name)?.[1];
    if (label !== undefined && !first.has(Number(label))) first.set(Number(label), at);
  });
  return nodes.map((node) => first.get(node.label));
}

/** Where a flexible body's amplitudes stand among the unknowns: "joint 20 (modal), unknown of: velocity of mode 1". */
export function unknownsOfBody(names: readonly string[], joint: number): number[] {
  const mode = new RegExp(`^joint ${joint} \\(.*unknown of: velocity of mode \\d+$`);
  return names.flatMap((name, at) => (mode.test(name) ? [at] : []));
}

interface Matrix {
  rows: number;
  columns: number;
  values: ArrayLike<number>;
}

/** Modes with a frequency, one of each conjugate pair, slowest first. */
export function modesOf(
  eigen: { real: readonly number[]; imaginary: readonly number[]; vectorsReal?: Matrix; vectorsImaginary?: Matrix },
  names: readonly string[],
  { nodes, bodies }: Movable,
): Mode[] {
  const at = unknownsOfNodes(names, nodes), ofBodies = bodies.map(({ joint }) => unknownsOfBody(names, joint));
  const entry = (matrix: Matrix | undefined, row: number, column: number) => (matrix && matrix.values.length > 0 ? matrix.values[row * matrix.columns + column] : 0);
  const modes: Mode[] = [];
  eigen.real.forEach((real, column) => {
    const imaginary = eigen.imaginary[column];
    if (!(imaginary > 0)) return;
    const motion = new Float64Array(12 * nodes.length);
    nodes.forEach((node, i) => {
      const row = at[i];
      if (row === undefined) return;
      for (let k = 0; k < (node.orientation ? 6 : 3); ++k) {
        motion[12 * i + k] = entry(eigen.vectorsReal, row + k, column);
        motion[12 * i + 6 + k] = entry(eigen.vectorsImaginary, row + k, column);
      }
    });
    const amplitudes = new Map<number, readonly [number, number]>();
    bodies.forEach((body, b) => body.amplitudes.forEach((handle, k) => {
      const row = ofBodies[b][k];
      if (row !== undefined) amplitudes.set(handle, [entry(eigen.vectorsReal, row, column), entry(eigen.vectorsImaginary, row, column)]);
    }));
    modes.push({ real, imaginary, motion, amplitudes, deformation: Math.max(0, ...bodies.map((body) => deformationOf(body, amplitudes))) });
  });
  return modes.sort((a, b) => a.imaginary - b.imaginary);
}

/** The largest displacement of the body's points at these amplitudes, through a whole period. */
function deformationOf(body: FlexibleBody, amplitudes: Mode['amplitudes']): number {
  const q = body.amplitudes.map((handle) => amplitudes.get(handle) ?? [0, 0]);
  let largest = 0;
  for (let at = 0; at < body.shapes.length; at += 3 * q.length) {
    let sum = 0;
    for (let row = 0; row < 3; ++row)
      for (const part of [0, 1]) sum += q.reduce((u, amplitude, mode) => u + body.shapes[at + row * q.length + mode] * amplitude[part], 0) ** 2;
    largest = Math.max(largest, Math.sqrt(sum));
  }
  return largest;
}

export function frequency(mode: Mode): number {
  return mode.imaginary / (2 * Math.PI);
}

/** Part of the critical damping. */
export function damping(mode: Mode): number {
  return -mode.real / Math.hypot(mode.real, mode.imaginary);
}

function vector(motion: Float64Array, at: number, cos: number, sin: number): Vec3 {
  return [0, 1, 2].map((k) => motion[at + k] * cos - motion[at + 6 + k] * sin) as unknown as Vec3;
}

/** Factor by which the largest displacement becomes `reach`; where nothing is displaced, the largest rotation 0.5 rad. */
export function amplitude(mode: Mode, reach: number): number {
  let displacement = mode.deformation, rotation = 0;
  for (let at = 0; at < mode.motion.length; at += 12) {
    const size = (from: number) => Math.hypot(norm(vector(mode.motion, from, 1, 0)), norm(vector(mode.motion, from, 0, 1)));
    displacement = Math.max(displacement, size(at));
    rotation = Math.max(rotation, size(at + 3));
  }
  if (displacement > 0) return Math.min(reach / displacement, rotation > 0 ? 1 / rotation : Infinity);
  return rotation > 0 ? 0.5 / rotation : 0;
}

/** A pose moved by a mode; it is filled anew by each `move`. */
export class MovedPose implements Pose {
  readonly x: Float64Array;
  readonly R: Float64Array;
  private amplitudes: Mode['amplitudes'] = new Map();
  private cos = 0;
  private sin = 0;

  constructor(private base: Pose) {
    this.x = new Float64Array(base.x.length);
    this.R = new Float64Array(base.R.length);
  }

  /** `base`, moved by the mode at a phase in radians. */
  move(base: Pose, mode: Mode, phase: number, factor: number): Pose {
    this.base = base;
    const cos = (this.cos = factor * Math.cos(phase)), sin = (this.sin = factor * Math.sin(phase));
    this.amplitudes = mode.amplitudes;
    for (let node = 0; 3 * node < this.x.length; ++node) {
      this.x.set(add(positionOf(base, node), vector(mode.motion, 12 * node, cos, sin)), 3 * node);
      this.R.set(multiply(rotationOf(vector(mode.motion, 12 * node + 3, cos, sin)), orientationOf(base, node)), 9 * node);
    }
    return this;
  }

  value(handle: number, element: number): number {
    const [real, imaginary] = this.amplitudes.get(handle) ?? [0, 0];
    return this.base.value(handle, element) + this.cos * real - this.sin * imaginary;
  }
}
