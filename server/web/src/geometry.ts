/** A model's shape: points that hang on nodes, and what hangs on points. Plain data, as recordings keep it. */
import { add, IDENTITY, mat3, multiply, rotate, vec3, type Mat3, type Vec3 } from './algebra';

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
  lines: { name: string; points: number[]; curved: boolean }[];
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

export interface Geometry {
  nodes: NodeShape[];
  elements: ElementShape[];
  bodies: FlexibleBody[];
  /** Diagonal of the box around all points at the start; 1 when there is no extent. */
  extent: number;
  centre: Vec3;
}

/** Where the nodes are, and what else a sample tells. */
export interface Pose {
  position(node: number): Vec3;
  orientation(node: number): Mat3;
  /** One number of a variable; NaN: not known. */
  value(handle: number, element: number): number;
}

export function pointAt(pose: Pose, point: PointShape): Vec3 {
  if (point.node < 0) return point.offset;
  return add(pose.position(point.node), rotate(pose.orientation(point.node), point.offset));
}

/** Orientation of something that is fixed to a point: `local` to global. */
export function orientationAt(pose: Pose, point: PointShape, local: Mat3): Mat3 {
  return point.node < 0 ? local : multiply(pose.orientation(point.node), local);
}

/** The pose in which the model was described. */
export function initialPose(nodes: readonly NodeShape[]): Pose {
  return {
    position: (node) => nodes[node].position,
    orientation: (node) => nodes[node].orientation ?? IDENTITY,
    value: () => NaN,
  };
}

/** The pose that a sample's numbers tell; nodes that it does not have stay where they were described. */
export function poseOf(nodes: readonly NodeShape[], values: ArrayLike<number>, offset: (handle: number) => number | undefined): Pose {
  return {
    position(node) {
      const at = offset(nodes[node].positionHandle);
      return at === undefined ? nodes[node].position : vec3(values, at);
    },
    orientation(node) {
      const handle = nodes[node].orientationHandle;
      const at = handle === undefined ? undefined : offset(handle);
      return at === undefined ? nodes[node].orientation ?? IDENTITY : mat3(values, at);
    },
    value(handle, element) {
      const at = offset(handle);
      return at === undefined ? NaN : values[at + element];
    },
  };
}

/** Points of a flexible body in global coordinates, three numbers each, with the deformation enlarged `factor` times. */
export function deformedPoints(body: FlexibleBody, pose: Pose, amplitudes: readonly number[], factor: number, out: Float32Array): void {
  const modes = body.amplitudes.length;
  const x = body.node < 0 ? body.fixedPosition : pose.position(body.node);
  const R = body.node < 0 ? body.fixedOrientation : pose.orientation(body.node);
  for (let i = 0; 3 * i < body.positions.length; ++i) {
    const local = [0, 1, 2].map((row) => {
      let deformation = 0;
      for (let mode = 0; mode < modes; ++mode) deformation += body.shapes[(3 * i + row) * modes + mode] * amplitudes[mode];
      return body.positions[3 * i + row] + factor * deformation;
    }) as unknown as Vec3;
    out.set(add(x, rotate(R, local)), 3 * i);
  }
}

/** Fills in what follows from the rest. */
export function finish(nodes: NodeShape[], elements: ElementShape[], bodies: FlexibleBody[]): Geometry {
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
  if (lower[0] > upper[0]) return { nodes, elements, bodies, extent: 1, centre: [0, 0, 0] };
  const centre = lower.map((low, k) => (low + upper[k]) / 2) as unknown as Vec3;
  const extent = Math.hypot(...lower.map((low, k) => upper[k] - low));
  return { nodes, elements, bodies, extent: extent > 0 ? extent : 1, centre };
}
