/** A model's shape: points that hang on nodes, and what hangs on points. Plain data, as recordings keep it. */
import { add, IDENTITY, inertiaEllipsoid, mat3, multiply, rotate, vec3, type Mat3, type Vec3 } from './algebra';
import { valueOf, type Layout, type Sample } from './recording';

export interface NodeShape {
  label: number;
  kind: string;
  name: string;
  position: Vec3;
  /** Node frame to global; absent: the node has no orientation. */
  orientation?: Mat3;
  positionHandle: number;
  orientationHandle?: number;
}

export interface PointShape {
  name: string;
  /** Index into `Geometry.nodes`; −1: fixed in space. */
  node: number;
  /** In the node's frame; fixed points: global position. */
  offset: Vec3;
}

export interface ElementShape {
  /** "joint:7": unique in the model. */
  id: string;
  family: string;
  type: string;
  label: number;
  name: string;
  points: PointShape[];
  frames: { name: string; point: number; orientation: Mat3 }[];
  /** `value`: handle of the variable that may colour the line. */
  lines: { name: string; points: number[]; curved: boolean; value?: number }[];
  surfaces: { name: string; points: number[] }[];
  masses: { point: number; mass: number; moments: Vec3; axes: Mat3 }[];
  arrows: { point: number; handle: number; sign: number; moment: boolean }[];
}

/** A flexible body: x + R (f + Σ U q). */
export interface FlexibleBody {
  joint: number;
  node: number;
  fixedPosition: Vec3;
  fixedOrientation: Mat3;
  amplitudes: number[];
  labels: string[];
  /** f: (x, y, z) for each point. */
  positions: number[];
  /** U by rows, 3 × modes for each point. */
  shapes: number[];
}

/** A mesh in place of the ellipsoid of a body, or fixed in space. */
export interface MeshShape {
  /** Of the only body of its node; of the node where there are others; "": it is fixed in space. */
  id: string;
  /** Its origin. */
  point: PointShape;
  /** Its axes to those of the point's node. */
  orientation: Mat3;
  scale: number;
  /** "#8090a0"; absent: that of bodies. */
  colour?: string;
  /** Index into `Geometry.triangles`. */
  triangles: number;
}

export interface Geometry {
  nodes: NodeShape[];
  elements: ElementShape[];
  bodies: FlexibleBody[];
  meshes: MeshShape[];
  /** Corners of the triangles of each mesh file, nine numbers a triangle. */
  triangles: Float32Array[];
  /** Diagonal of the box around all points at the start; where they are one point, three times the largest ellipsoid; 1 when there is nothing. */
  extent: number;
  centre: Vec3;
  /** Ellipsoids of inertia are drawn so many times as large as they are, so that they do not hide the rest; at most 1. */
  bodyScale: number;
}

/** Where the nodes are, and what else a sample tells. Batches read its arrays; whoever made it may fill it anew. */
export interface Pose {
  /** Positions of the nodes, three numbers each. */
  readonly x: Float64Array;
  /** Their orientations by rows, nine numbers each. */
  readonly R: Float64Array;
  /** One number of a variable; NaN: not known. */
  value(handle: number, element: number): number;
}

export function positionOf(pose: Pose, node: number): Vec3 {
  return vec3(pose.x, 3 * node);
}

export function orientationOf(pose: Pose, node: number): Mat3 {
  return mat3(pose.R, 9 * node);
}

export function pointAt(pose: Pose, point: PointShape): Vec3 {
  if (point.node < 0) return point.offset;
  return add(positionOf(pose, point.node), rotate(orientationOf(pose, point.node), point.offset));
}

/** Orientation of something that is fixed to a point: `local` to global. */
export function orientationAt(pose: Pose, point: PointShape, local: Mat3): Mat3 {
  return point.node < 0 ? local : multiply(orientationOf(pose, point.node), local);
}

/** The pose in which the model was described. */
export function initialPose(nodes: readonly NodeShape[]): Pose {
  const x = new Float64Array(3 * nodes.length), R = new Float64Array(9 * nodes.length);
  nodes.forEach((node, i) => {
    x.set(node.position, 3 * i);
    R.set(node.orientation ?? IDENTITY, 9 * i);
  });
  return { x, R, value: () => NaN };
}

/** Turns samples into poses; nodes that a sample does not have stay where they were described. Nothing is made anew: it is itself the pose. */
export class PoseReader implements Pose {
  readonly x: Float64Array;
  readonly R: Float64Array;
  private sample?: Sample;
  private layout?: Layout;
  /** Where the position and the orientation of each node stand in samples of the layout; −1: nowhere. */
  private readonly places: Int32Array;

  constructor(private readonly nodes: readonly NodeShape[]) {
    const { x, R } = initialPose(nodes);
    this.x = x;
    this.R = R;
    this.places = new Int32Array(2 * nodes.length);
  }

  read(sample: Sample): Pose {
    this.sample = sample;
    if (sample.layout !== this.layout) this.find(sample.layout);
    const { x, R, places } = this, { values } = sample;
    for (let node = 0; 2 * node < places.length; ++node) {
      const from = places[2 * node], turned = places[2 * node + 1];
      if (from >= 0) for (let k = 0; k < 3; ++k) x[3 * node + k] = values[from + k];
      if (turned >= 0) for (let k = 0; k < 9; ++k) R[9 * node + k] = values[turned + k];
    }
    return this;
  }

  private find(layout: Layout): void {
    this.layout = layout;
    this.nodes.forEach((node, i) => {
      this.places[2 * i] = layout.offset(node.positionHandle) ?? -1;
      this.places[2 * i + 1] = node.orientationHandle === undefined ? -1 : layout.offset(node.orientationHandle) ?? -1;
    });
  }

  value(handle: number, element: number): number {
    return this.sample ? valueOf(this.sample, handle, element) : NaN;
  }
}

/** Points of a flexible body in global coordinates, three numbers each, with the deformation enlarged `factor` times. */
export function deformedPoints(body: FlexibleBody, pose: Pose, amplitudes: readonly number[], factor: number, out: Float32Array): void {
  const modes = body.amplitudes.length;
  const x = body.node < 0 ? body.fixedPosition : positionOf(pose, body.node);
  const R = body.node < 0 ? body.fixedOrientation : orientationOf(pose, body.node);
  const local = [0, 0, 0];
  for (let i = 0; 3 * i < body.positions.length; ++i) {
    for (let row = 0; row < 3; ++row) {
      const shape = (3 * i + row) * modes;
      let deformation = 0;
      for (let mode = 0; mode < modes; ++mode) deformation += body.shapes[shape + mode] * amplitudes[mode];
      local[row] = body.positions[3 * i + row] + factor * deformation;
    }
    for (let row = 0; row < 3; ++row) out[3 * i + row] = x[row] + R[3 * row] * local[0] + R[3 * row + 1] * local[1] + R[3 * row + 2] * local[2];
  }
}

/** Semi-axis of the only body, as a part of the extent; of several, by the root of their number less. */
const LARGEST_BODY = 0.34;

/** Fills in what follows from the rest. */
export function finish(nodes: NodeShape[], elements: ElementShape[], bodies: FlexibleBody[], meshes: MeshShape[] = [], triangles: Float32Array[] = []): Geometry {
  const pose = initialPose(nodes);
  const lower = [Infinity, Infinity, Infinity], upper = [-Infinity, -Infinity, -Infinity];
  const include = (x: ArrayLike<number>) => {
    for (let k = 0; k < 3; ++k) {
      lower[k] = Math.min(lower[k], x[k]);
      upper[k] = Math.max(upper[k], x[k]);
    }
  };
  nodes.forEach((node) => include(node.position));
  for (const element of elements) for (const point of element.points) include(pointAt(pose, point));
  for (const body of bodies) {
    const out = new Float32Array(body.positions.length);
    deformedPoints(body, pose, body.amplitudes.map(() => 0), 0, out);
    for (let i = 0; i < out.length; i += 3) include(out.subarray(i, i + 3));
  }
  const { largest, count } = ellipsoids(elements), known = lower[0] <= upper[0];
  const centre = lower.map((low, k) => (known ? (low + upper[k]) / 2 : 0)) as unknown as Vec3;
  const extent = (known && Math.hypot(...lower.map((low, k) => upper[k] - low))) || 3 * largest || 1;
  const room = (LARGEST_BODY * extent) / Math.sqrt(Math.max(count, 1));
  return { nodes, elements, bodies, meshes, triangles, extent, centre, bodyScale: largest > room ? room / largest : 1 };
}

/** The largest semi-axis of an ellipsoid of inertia, and how many there are. */
function ellipsoids(elements: readonly ElementShape[]): { largest: number; count: number } {
  let largest = 0, count = 0;
  for (const { masses } of elements)
    for (const { mass, moments } of masses) {
      largest = Math.max(largest, ...inertiaEllipsoid(mass, moments));
      ++count;
    }
  return { largest, count };
}
