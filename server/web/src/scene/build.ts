/** From a model's shape to what is drawn. */
import * as THREE from 'three';
import { IDENTITY, inertiaEllipsoid, norm, onParabola, subtract, type Vec3 } from '../algebra';
import { initialPose, pointAt, type ElementShape, type Geometry, type PointShape, type Pose } from '../geometry';
import {
  ArrowBatch, FaceBatch, FlexibleBatch, GlyphBatch, LineBatch, TubeBatch,
  type ArrowItem, type Batch, type FaceItem, type GlyphItem, type LineItem, type TubeItem,
} from './batches';
import { glyph, jointGlyph, type GlyphName } from './glyphs';
import type { Palette } from './palette';

/** What can be shown and hidden by itself. */
export type Layer = 'nodes' | 'links' | 'bodies' | 'joints' | 'lines' | 'surfaces' | 'forces' | 'flexible';

export interface Drawn {
  batches: { layer: Layer; batch: Batch }[];
  /** The nodes' glyphs, in the order of `Geometry.nodes`. */
  nodes: GlyphBatch;
}

const BEAM_SAMPLES = 13;
const COILS = 8;
const NODE_ORIGIN: Vec3 = [0, 0, 0];

interface Items {
  links: LineItem[];
  lines: Record<'beam' | 'spring' | 'other', LineItem[]>;
  barrels: TubeItem[];
  rods: TubeItem[];
  joints: Map<GlyphName, GlyphItem[]>;
  bodies: GlyphItem[];
  faces: FaceItem[];
  forces: ArrowItem[];
  moments: ArrowItem[];
}

export function build(geometry: Geometry, palette: Palette): Drawn {
  const size = glyphSize(geometry);
  const items: Items = {
    links: [],
    lines: { beam: [], spring: [], other: [] },
    barrels: [],
    rods: [],
    joints: new Map(),
    bodies: [],
    faces: [],
    forces: [],
    moments: [],
  };
  const pose = initialPose(geometry.nodes);
  for (const element of geometry.elements) collect(element, items, size, pose);
  return draw(geometry, items, size, palette);
}

/** Joints and nodes are small against the model, and against the distance between its nodes. */
export function glyphSize(geometry: Geometry): number {
  const nodes = Math.max(geometry.nodes.length, 1);
  return geometry.extent * Math.min(0.05, Math.max(0.012, 0.22 / Math.sqrt(nodes)));
}

function collect(element: ElementShape, items: Items, size: number, pose: Pose): void {
  const point = (index: number): PointShape => element.points[index];
  for (const shape of element.points)
    if (shape.node >= 0 && norm(shape.offset) > 0) items.links.push(straight(element.id, [{ ...shape, offset: NODE_ORIGIN }, shape]));
  for (const mass of element.masses) {
    const axes = inertiaEllipsoid(mass.mass, mass.moments);
    const least = 0.3 * size;  // a point mass is seen, too
    items.bodies.push({
      id: element.id,
      point: point(mass.point),
      local: mass.axes,
      size: axes.map((axis) => Math.max(axis, least)) as unknown as Vec3,
    });
  }
  for (const line of element.lines) addLine(element, line, items, size, pose);
  for (const surface of element.surfaces) items.faces.push({ id: element.id, points: surface.points.map(point) });
  for (const arrow of element.arrows)
    (arrow.moment ? items.moments : items.forces).push({
      id: element.id,
      point: point(arrow.point),
      handle: arrow.handle,
      element: 0,
      sign: arrow.sign,
    });
  addJoint(element, items, size);
}

function addJoint(element: ElementShape, items: Items, size: number): void {
  if (element.lines.length > 0 || element.surfaces.length > 0 || element.masses.length > 0 || element.arrows.length > 0) return;
  if (element.points.length === 0) return;
  const frame = element.frames[0];
  const name: GlyphName = element.family === 'joint' ? jointGlyph(element.type) : 'box';
  const item: GlyphItem = {
    id: element.id,
    point: element.points[frame?.point ?? 0],
    local: frame?.orientation ?? IDENTITY,
    size: [size, size, size],
  };
  const list = items.joints.get(name);
  if (list) list.push(item);
  else items.joints.set(name, [item]);
}

function addLine(element: ElementShape, line: ElementShape['lines'][number], items: Items, size: number, pose: Pose): void {
  const points = line.points.map((index) => element.points[index]);
  const word = `${element.family} ${element.type}`;
  if (line.curved && points.length === 3) items.lines.beam.push(parabola(element.id, points));
  else if (/beam/.test(word)) items.lines.beam.push(straight(element.id, points));
  else if (/actuator/.test(word) && points.length === 2) addActuator(element.id, points, items, size, pose);
  else if (/rod|spring|viscous/.test(word) && points.length === 2) items.lines.spring.push(coil(element.id, points, 0.35 * size));
  else items.lines.other.push(straight(element.id, points));
}

/** A barrel that keeps its length, and a rod that comes out of it. */
function addActuator(id: string, [from, to]: PointShape[], items: Items, size: number, pose: Pose): void {
  const length = norm(subtract(pointAt(pose, to), pointAt(pose, from)));
  items.barrels.push({ id, from, to, start: 0, end: 0.62 * length, radius: 0.34 * size });
  items.rods.push({ id, from, to, start: 0.3 * length, end: Infinity, radius: 0.15 * size });
}

function straight(id: string, points: PointShape[]): LineItem {
  return {
    id,
    corners: points.length,
    fill: (pose, out, at) => points.forEach((point, i) => out.set(pointAt(pose, point), at + 3 * i)),
  };
}

function parabola(id: string, points: PointShape[]): LineItem {
  return {
    id,
    corners: BEAM_SAMPLES,
    fill(pose, out, at) {
      const [x1, x2, x3] = points.map((point) => pointAt(pose, point));
      for (let i = 0; i < BEAM_SAMPLES; ++i) out.set(onParabola(x1, x2, x3, -1 + (2 * i) / (BEAM_SAMPLES - 1)), at + 3 * i);
    },
  };
}

/** A helix between two points: it is seen to lengthen. */
function coil(id: string, points: PointShape[], radius: number): LineItem {
  const corners = COILS * 12 + 3;
  return {
    id,
    corners,
    fill(pose: Pose, out, at) {
      const start = new THREE.Vector3(...pointAt(pose, points[0])), end = new THREE.Vector3(...pointAt(pose, points[1]));
      const along = new THREE.Vector3(...subtract(end.toArray(), start.toArray()));
      const side = new THREE.Vector3(1, 0, 0).cross(along);
      if (side.lengthSq() < 1e-12 * along.lengthSq()) side.set(0, 1, 0).cross(along);
      side.normalize();
      const other = along.clone().normalize().cross(side);
      start.toArray(out, at);
      for (let i = 0; i <= corners - 3; ++i) {
        const part = i / (corners - 3), angle = part * COILS * 2 * Math.PI;
        start.clone().addScaledVector(along, 0.12 + 0.76 * part).addScaledVector(side, radius * Math.cos(angle)).addScaledVector(other, radius * Math.sin(angle))
          .toArray(out, at + 3 * (i + 1));
      }
      end.toArray(out, at + 3 * (corners - 1));
    },
  };
}

function draw(geometry: Geometry, items: Items, size: number, palette: Palette): Drawn {
  const batches: Drawn['batches'] = [];
  const colour = (name: keyof Palette) => new THREE.Color(palette[name]);
  const add = (layer: Layer, batch: Batch) => batches.push({ layer, batch });
  const lines = (layer: Layer, list: LineItem[], name: keyof Palette, width: number) => {
    if (list.length > 0) add(layer, new LineBatch(list, colour(name), width));
  };
  const nodes = new GlyphBatch(glyph('node', geometry.nodes.length), geometry.nodes.map((node, index) => ({
    id: `node.structural:${node.label}`,
    point: { name: '', node: index, offset: NODE_ORIGIN },
    local: IDENTITY,
    size: [0.36 * size, 0.36 * size, 0.36 * size] as Vec3,
  })), colour('node'));
  add('nodes', nodes);
  lines('links', items.links, 'link', 2);
  if (items.bodies.length > 0) add('bodies', new GlyphBatch(glyph('sphere', items.bodies.length), items.bodies, colour('body'), 0.62));
  for (const [name, list] of items.joints) add('joints', new GlyphBatch(glyph(name, list.length), list, colour('joint')));
  lines('lines', items.lines.beam, 'beam', 5);
  lines('lines', items.lines.spring, 'spring', 2);
  if (items.barrels.length > 0) add('lines', new TubeBatch(items.barrels, colour('hydraulic')));
  if (items.rods.length > 0) add('lines', new TubeBatch(items.rods, colour('node')));
  lines('lines', items.lines.other, 'other', 2.5);
  if (items.faces.length > 0) add('surfaces', new FaceBatch(items.faces, colour('shell')));
  const reach = 0.28 * geometry.extent;
  if (items.forces.length > 0) add('forces', new ArrowBatch(items.forces, colour('force'), reach));
  if (items.moments.length > 0) add('forces', new ArrowBatch(items.moments, colour('moment'), reach));
  for (const body of geometry.bodies) add('flexible', new FlexibleBatch(body, `joint:${body.joint}`, colour('flexible')));
  return { batches, nodes };
}
