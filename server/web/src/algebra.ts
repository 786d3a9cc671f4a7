/** Vectors and rotations as the service sends them: (x, y, z), matrices by rows. Nothing here knows of drawing. */

export type Vec3 = readonly [number, number, number];
/** By rows. */
export type Mat3 = readonly [number, number, number, number, number, number, number, number, number];

export const IDENTITY: Mat3 = [1, 0, 0, 0, 1, 0, 0, 0, 1];

export function vec3(values: ArrayLike<number>, at = 0): Vec3 {
  return [values[at] ?? 0, values[at + 1] ?? 0, values[at + 2] ?? 0];
}

export function mat3(values: ArrayLike<number>, at = 0): Mat3 {
  if (values.length < at + 9) return IDENTITY;
  return [
    values[at], values[at + 1], values[at + 2],
    values[at + 3], values[at + 4], values[at + 5],
    values[at + 6], values[at + 7], values[at + 8],
  ];
}

export function add(a: Vec3, b: Vec3): Vec3 {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

export function subtract(a: Vec3, b: Vec3): Vec3 {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

export function scale(a: Vec3, factor: number): Vec3 {
  return [a[0] * factor, a[1] * factor, a[2] * factor];
}

export function norm(a: Vec3): number {
  return Math.hypot(a[0], a[1], a[2]);
}

/** R v. */
export function rotate(R: Mat3, v: Vec3): Vec3 {
  return [
    R[0] * v[0] + R[1] * v[1] + R[2] * v[2],
    R[3] * v[0] + R[4] * v[1] + R[5] * v[2],
    R[6] * v[0] + R[7] * v[1] + R[8] * v[2],
  ];
}

/** A B. */
export function multiply(A: Mat3, B: Mat3): Mat3 {
  if (B === IDENTITY) return A;
  return [
    A[0] * B[0] + A[1] * B[3] + A[2] * B[6], A[0] * B[1] + A[1] * B[4] + A[2] * B[7], A[0] * B[2] + A[1] * B[5] + A[2] * B[8],
    A[3] * B[0] + A[4] * B[3] + A[5] * B[6], A[3] * B[1] + A[4] * B[4] + A[5] * B[7], A[3] * B[2] + A[4] * B[5] + A[5] * B[8],
    A[6] * B[0] + A[7] * B[3] + A[8] * B[6], A[6] * B[1] + A[7] * B[4] + A[8] * B[7], A[6] * B[2] + A[7] * B[5] + A[8] * B[8],
  ];
}

/** Rotation vector -> matrix. */
export function rotationOf(phi: Vec3): Mat3 {
  const angle = norm(phi);
  const a = angle > 1e-8 ? Math.sin(angle) / angle : 1;
  const b = angle > 1e-8 ? (1 - Math.cos(angle)) / (angle * angle) : 0.5;
  const [x, y, z] = phi;
  return [
    1 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y,
    b * x * y + a * z, 1 - b * (x * x + z * z), b * y * z - a * x,
    b * x * z - a * y, b * y * z + a * x, 1 - b * (x * x + y * y),
  ];
}

/** Unit quaternion (x, y, z, w) of a rotation matrix; the largest component is found first, so that it is exact near half turns. */
export function quaternionOf(R: Mat3): [number, number, number, number] {
  const trace = R[0] + R[4] + R[8];
  const candidates = [1 + 2 * R[0] - trace, 1 + 2 * R[4] - trace, 1 + 2 * R[8] - trace, 1 + trace];
  const largest = candidates.indexOf(Math.max(...candidates));
  const root = Math.sqrt(Math.max(candidates[largest], 0));
  const f = root > 0 ? 0.5 / root : 0;
  const q: [number, number, number, number] = [0, 0, 0, 1];
  if (largest === 3) {
    q[0] = (R[7] - R[5]) * f, q[1] = (R[2] - R[6]) * f, q[2] = (R[3] - R[1]) * f;
  } else {
    const i = largest, j = (i + 1) % 3, k = (i + 2) % 3;
    q[j] = (R[3 * j + i] + R[3 * i + j]) * f;
    q[k] = (R[3 * k + i] + R[3 * i + k]) * f;
    q[3] = (R[3 * k + j] - R[3 * j + k]) * f;
  }
  q[largest] = root / 2;
  return q;
}

/** Semi-axes of the solid ellipsoid with this mass and these principal moments: J1 = m (b² + c²) / 5. */
export function inertiaEllipsoid(mass: number, moments: Vec3): Vec3 {
  if (!(mass > 0)) return [0, 0, 0];
  const half = (moments[0] + moments[1] + moments[2]) / 2;
  return moments.map((J) => Math.sqrt(Math.max((5 * (half - J)) / mass, 0))) as unknown as Vec3;
}

/** The parabola through three points at ξ = −1, 0, 1. */
export function onParabola(x1: Vec3, x2: Vec3, x3: Vec3, xi: number): Vec3 {
  const n1 = (xi * (xi - 1)) / 2, n2 = 1 - xi * xi, n3 = (xi * (xi + 1)) / 2;
  return add(add(scale(x1, n1), scale(x2, n2)), scale(x3, n3));
}
