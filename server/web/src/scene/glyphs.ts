/** Small solids by which one sees what an element is. Each fits a box of about one unit; axis 3 of a joint is z. */
import * as THREE from 'three';
import { mergeGeometries } from 'three/examples/jsm/utils/BufferGeometryUtils.js';

export type GlyphName =
  | 'sphere' | 'ball' | 'clamp' | 'hinge' | 'slider' | 'plate' | 'cross' | 'octahedron' | 'spring' | 'drive' | 'box' | 'node' | 'wheel' | 'wing' | 'disc' | 'sensor';

function merged(...parts: THREE.BufferGeometry[]): THREE.BufferGeometry {
  return mergeGeometries(parts);
}

/** Corners around something round: fewer where there are many of it. */
class Detail {
  constructor(private readonly part: number) {}
  round(corners: number): number {
    return Math.max(5, Math.round(corners * this.part));
  }
}
const FINE = new Detail(1), COARSE = new Detail(0.25);

function cylinderAlong(axis: 'x' | 'y' | 'z', radius: number, length: number, d: Detail): THREE.BufferGeometry {
  const cylinder = new THREE.CylinderGeometry(radius, radius, length, d.round(20));
  if (axis === 'z') cylinder.rotateX(Math.PI / 2);
  if (axis === 'x') cylinder.rotateZ(Math.PI / 2);
  return cylinder;
}

const sphere = (radius: number, d: Detail) => new THREE.SphereGeometry(radius, d.round(32), d.round(20));
const torus = (radius: number, tube: number, d: Detail, arc = 2 * Math.PI) => new THREE.TorusGeometry(radius, tube, d.round(10), d.round(32), arc);
const box = (x: number, y: number, z: number) => new THREE.BoxGeometry(x, y, z);

const MAKERS: Record<GlyphName, (d: Detail) => THREE.BufferGeometry> = {
  sphere: (d) => sphere(1, d),
  node: (d) => new THREE.SphereGeometry(0.5, d.round(16), d.round(10)),
  ball: (d) => merged(sphere(0.38, d), torus(0.46, 0.07, d)),
  clamp: () => merged(box(0.7, 0.7, 0.7), box(0.95, 0.95, 0.12).translate(0, 0, -0.36)),
  hinge: (d) => merged(cylinderAlong('z', 0.24, 1.1, d), torus(0.34, 0.1, d)),
  slider: (d) => merged(box(0.5, 0.5, 0.5), cylinderAlong('z', 0.1, 1.5, d)),
  plate: (d) => merged(box(1.1, 1.1, 0.06), sphere(0.2, d)),
  cross: (d) => merged(cylinderAlong('x', 0.13, 1, d), cylinderAlong('y', 0.13, 1, d), sphere(0.2, d)),
  octahedron: () => new THREE.OctahedronGeometry(0.5),
  spring: (d) => merged(...[-0.36, -0.18, 0, 0.18, 0.36].map((z) => torus(0.3, 0.06, d).translate(0, 0, z))),
  drive: (d) => merged(
    torus(0.42, 0.07, d, Math.PI * 1.6),
    new THREE.ConeGeometry(0.17, 0.32, d.round(16)).translate(0.42, -0.08, 0).rotateZ(Math.PI),
    cylinderAlong('z', 0.12, 0.9, d),
  ),
  wheel: (d) => merged(torus(0.45, 0.1, d), cylinderAlong('z', 0.08, 0.6, d)),
  box: () => box(0.6, 0.6, 0.6),
  wing: (d) => new THREE.CylinderGeometry(0.5, 0.5, 1.2, d.round(24)).scale(1, 1, 0.16),
  disc: (d) => merged(torus(0.62, 0.03, d), torus(0.36, 0.03, d), cylinderAlong('z', 0.12, 0.4, d)),
  sensor: (d) => merged(box(0.46, 0.46, 0.2), cylinderAlong('z', 0.07, 0.7, d)),
};

/** What is drawn in place of the above where there are many. */
const PLAIN: Partial<Record<GlyphName, (d: Detail) => THREE.BufferGeometry>> = {
  node: () => new THREE.OctahedronGeometry(0.5),
  ball: () => new THREE.OctahedronGeometry(0.45, 1),
  spring: () => new THREE.CylinderGeometry(0.25, 0.25, 0.9, 8).rotateX(Math.PI / 2),
  sphere: () => new THREE.SphereGeometry(1, 8, 5),
};

/** What is drawn in place of all the above where there are very many: some twenty triangles each. */
const PLAINEST: Partial<Record<GlyphName, () => THREE.BufferGeometry>> = {
  node: () => new THREE.OctahedronGeometry(0.5),
  sphere: () => new THREE.IcosahedronGeometry(1),
  ball: () => new THREE.OctahedronGeometry(0.45),
  hinge: () => new THREE.CylinderGeometry(0.28, 0.28, 1.1, 5).rotateX(Math.PI / 2),
  octahedron: () => new THREE.OctahedronGeometry(0.5),
  plate: () => new THREE.BoxGeometry(1.1, 1.1, 0.06),
  slider: () => new THREE.BoxGeometry(0.4, 0.4, 1.2),
  spring: () => new THREE.CylinderGeometry(0.25, 0.25, 0.9, 5).rotateX(Math.PI / 2),
};

/** Above so many of a kind, each is drawn with fewer corners. */
export const MANY = 120;
const VERY_MANY = 400;
const made = new Map<string, THREE.BufferGeometry>();

function make(name: GlyphName, count: number): THREE.BufferGeometry {
  if (count > VERY_MANY) return (PLAINEST[name] ?? (() => new THREE.BoxGeometry(0.6, 0.6, 0.6)))();
  if (count > MANY) return (PLAIN[name] ?? MAKERS[name])(COARSE);
  return MAKERS[name](FINE);
}

export function glyph(name: GlyphName, count: number): THREE.BufferGeometry {
  const key = `${name} ${count > VERY_MANY} ${count > MANY}`;
  let geometry = made.get(key);
  if (!geometry) made.set(key, (geometry = make(name, count)));
  return geometry;
}

const JOINTS: [RegExp, GlyphName][] = [
  [/deformable|viscous|invariant/, 'spring'],
  [/clamp/, 'clamp'],
  [/drive|imposed|velocity|acceleration|motor/, 'drive'],
  [/brake/, 'wheel'],
  [/revolute|plane hinge|plane pin|axial rotation|screw/, 'hinge'],
  [/spherical|^pin$|gimbal|rotation/, 'ball'],
  [/universal|cardano/, 'cross'],
  [/prismatic|in line|slider/, 'slider'],
  [/in plane|plane/, 'plate'],
  [/total/, 'octahedron'],
];

/** What a joint of this type looks like. */
export function jointGlyph(type: string): GlyphName {
  return JOINTS.find(([pattern]) => pattern.test(type))?.[1] ?? 'octahedron';
}

const FAMILIES: [RegExp, GlyphName][] = [
  [/rotor|induced velocity|inflow/, 'disc'],
  [/aero|aircraft|wing/, 'wing'],
  [/accelerometer|displacement|sensor|electric/, 'sensor'],
  [/motor/, 'wheel'],
];

/** What an element looks like that nothing but its points shows. */
export function elementGlyph(family: string, type: string): GlyphName {
  if (family === 'joint') return jointGlyph(type);
  return FAMILIES.find(([pattern]) => pattern.test(`${type} ${family}`))?.[1] ?? 'box';
}
