/** From a model's shape to the things that are drawn, by kind. */
import * as THREE from 'three';
import { IDENTITY, inertiaEllipsoid, norm, type Mat3, type Vec3 } from '../algebra';
import { BeamCurve } from '../beam_curve';
import { initialPose, orientationOf, type ElementShape, type Geometry, type MeshShape, type NodeShape, type Pose } from '../geometry';
import type { ArrowItem } from './batches/arrows';
import type { BarItem } from './batches/bars';
import type { BeamItem } from './batches/beams';
import type { FaceItem } from './batches/faces';
import type { GlyphItem } from './batches/glyphs';
import type { LineItem } from './batches/lines';
import { reactionOf } from '../reactions';
import { elementGlyph, type GlyphName } from './glyphs';
import { axes, coil, section, straight } from './line_items';
import type { Palette } from './palette';
import { Points } from './points';
import { ValueScale } from './value_colour';

/** Stations along a beam; fewer where there are many. */
const BEAM_STATIONS = 13, MANY_BEAMS = 150;
/** Sections that are drawn between the ends of a beam are one less; so much wider than the beam. */
const SECTIONS = 4, SECTION_RIM = 1.5;

/** Copies of one mesh in one colour. */
export interface MeshCopies {
  triangles: Float32Array;
  colour?: string;
  items: GlyphItem[];
}

export class Items {
  readonly points: Points;
  readonly links: LineItem[] = [];
  readonly springs: LineItem[] = [];
  readonly others: LineItem[] = [];
  readonly beams: BeamItem[] = [];
  readonly barrels: BarItem[] = [];
  readonly rods: BarItem[] = [];
  readonly joints = new Map<GlyphName, GlyphItem[]>();
  readonly bodies: GlyphItem[] = [];
  readonly meshes: MeshCopies[] = [];
  readonly faces: FaceItem[] = [];
  readonly forces: ArrowItem[] = [];
  readonly moments: ArrowItem[] = [];
  readonly reactions: ArrowItem[] = [];
  readonly reactionMoments: ArrowItem[] = [];
  readonly velocities: ArrowItem[] = [];
  readonly axes: LineItem[] = [];
  readonly sections: LineItem[] = [];
  /** Handle of a variable whose values are shown as colours of `pressures`. */
  pressure?: number;
  /** Glyphs' size. */
  readonly size: number;
  private readonly pose: Pose;
  readonly pressures: ValueScale;
  /** Of the points of flexible bodies. */
  readonly deformations: ValueScale;
  private readonly stations: number;

  /** `handleOf`: handle of a variable by its name. */
  constructor(readonly geometry: Geometry, private readonly palette: Palette, private readonly handleOf: (name: string) => number | undefined) {
    this.points = new Points(geometry.nodes.length);
    this.size = glyphSize(geometry);
    this.pressures = new ValueScale(new THREE.Color(palette.low), new THREE.Color(palette.high));
    this.deformations = new ValueScale(new THREE.Color(palette.flexible), new THREE.Color(palette.strained), 0);
    this.pose = initialPose(geometry.nodes);
    const beams = geometry.elements.reduce((sum, element) => sum + Number(isBeam(element)), 0);
    this.stations = beams > MANY_BEAMS ? 5 : BEAM_STATIONS;
    for (const element of geometry.elements) this.collect(element);
    for (const mesh of geometry.meshes) this.addMesh(mesh);
    geometry.nodes.forEach((node, i) => this.addNode(node, i));
    this.points.update(this.pose);
  }

  private collect(element: ElementShape): void {
    const points = element.points.map((point) => this.points.add(point));
    element.points.forEach((shape, i) => {
      if (shape.node >= 0 && norm(shape.offset) > 0) this.links.push(straight(element.id, [shape.node, points[i]], this.points));
    });
    this.addMasses(element, points);
    if (isActuator(element)) this.addActuator(element, points);
    else for (const line of element.lines) this.addLine(element, line.points.map((index) => points[index]));
    for (const surface of element.surfaces) this.faces.push({ id: element.id, points: surface.points.map((index) => points[index]) });
    for (const arrow of element.arrows) (arrow.moment ? this.moments : this.forces).push(vectorArrow(element.id, points[arrow.point], arrow.handle, arrow.sign));
    for (const frame of element.frames) this.addAxes(element.id, points[frame.point], frame.orientation, 1.1);
    const force = reactionOf(element, points, this.handleOf, 'force'), moment = reactionOf(element, points, this.handleOf, 'moment');
    if (force) this.reactions.push(force);
    if (moment) this.reactionMoments.push(moment);
    this.addGlyph(element, points);
  }

  private addNode(node: NodeShape, index: number): void {
    const id = `node.structural:${node.label}`, handle = this.handleOf(`node.structural.${node.label}.XP`);
    if (handle !== undefined) this.velocities.push(vectorArrow(id, index, handle, 1));
    if (node.orientation) this.addAxes(id, index, IDENTITY, 1.5);
  }

  private addAxes(id: string, point: number, local: Mat3, length: number): void {
    const colours = [this.palette.x, this.palette.y, this.palette.z];
    this.axes.push(...axes(id, point, local, length * this.size, this.points, colours));
  }

  private addMesh({ id, point, orientation, scale, colour, triangles: index }: MeshShape): void {
    const triangles = this.geometry.triangles[index];
    let copies = this.meshes.find((known) => known.triangles === triangles && known.colour === colour);
    if (!copies) this.meshes.push((copies = { triangles, colour, items: [] }));
    copies.items.push({ id, point: this.points.add(point), local: orientation, size: [scale, scale, scale] });
  }

  /** Bodies whose nodes have meshes are seen by them. */
  private addMasses(element: ElementShape, points: number[]): void {
    const least = 0.3 * this.size;  // a point mass is seen, too
    for (const mass of element.masses) {
      if (this.geometry.meshes.some(({ point }) => point.node >= 0 && point.node === element.points[mass.point].node)) continue;
      const axes = inertiaEllipsoid(mass.mass, mass.moments);
      this.bodies.push({ id: element.id, point: points[mass.point], local: mass.axes, size: axes.map((axis) => Math.max(this.geometry.bodyScale * axis, least)) as unknown as Vec3 });
    }
  }

  private addLine(element: ElementShape, points: number[]): void {
    const word = `${element.family} ${element.type}`;
    if (isBeam(element)) this.addBeam(element.id, points);
    else if (/rod|spring|viscous/.test(word) && points.length === 2) this.springs.push(coil(element.id, points, 0.3 * this.size, this.points));
    else this.others.push(straight(element.id, points, this.points));
  }

  private addBeam(id: string, points: number[]): void {
    this.points.update(this.pose);
    const nodes = points.map((point) => this.points.node(point));
    const curve = new BeamCurve(points, nodes, this.points.x, (node) => (node < 0 ? IDENTITY : orientationOf(this.pose, node)), this.stations);
    const beam = { id, curve, width: 0.22 * this.size, height: 0.11 * this.size };
    this.beams.push(beam);
    const between = (this.stations - 1) / SECTIONS;
    for (let k = 0; k <= SECTIONS; ++k) this.sections.push(section(beam, Math.round(k * between), SECTION_RIM));
  }

  /** Two chambers that share the cylinder, coloured by their pressures; the piston between them, and its rod, which comes out at the head. */
  private addActuator(element: ElementShape, points: number[]): void {
    const [first, second] = element.lines, [bottom, piston] = first.points.map((index) => points[index]), head = points[second.points[1]];
    const radius = 0.34 * this.size, x = this.points;
    for (const { points: [from, to], value } of [first, second])
      this.barrels.push({ id: element.id, from: points[from], to: points[to], span: (length) => [0, length], radius, colour: this.byValue(value) });
    const at = () => x.distance(bottom, piston);
    this.rods.push({ id: element.id, from: bottom, to: head, span: (length) => [at() - 0.03 * length, at() + 0.03 * length], radius: 1.12 * radius });
    this.rods.push({ id: element.id, from: bottom, to: head, span: (length) => [at(), at() + 1.08 * length], radius: 0.4 * radius });
  }

  private byValue(handle: number | undefined): BarItem['colour'] {
    this.pressure ??= handle;
    return handle === undefined ? undefined : (pose, out) => this.pressures.colour(pose.value(handle, 0), out);
  }

  /** Where nothing else shows the element, or a joint stands at a hinge. */
  private addGlyph(element: ElementShape, points: number[]): void {
    if (element.lines.length + element.surfaces.length + element.masses.length + element.arrows.length > 0) return;
    if (points.length === 0 || this.geometry.bodies.some((body) => `joint:${body.joint}` === element.id)) return;
    const frame = element.frames[0], name = elementGlyph(element.family, element.type), size = this.size;
    this.addItem(name, { id: element.id, point: points[frame?.point ?? 0], local: frame?.orientation ?? IDENTITY, size: [size, size, size] });
    if (name === 'spring' && points.length === 2) this.springs.push(coil(element.id, points, 0.3 * size, this.points));
    else if (points.length > 1) this.others.push(straight(element.id, points, this.points));
  }

  private addItem(name: GlyphName, item: GlyphItem): void {
    const list = this.joints.get(name);
    if (list) list.push(item);
    else this.joints.set(name, [item]);
  }
}

function isActuator({ type, lines }: ElementShape): boolean {
  return type === 'actuator' && lines.length === 2 && lines.every((line) => line.points.length === 2);
}

function isBeam(element: ElementShape): boolean {
  return element.lines.length > 0 && (/beam/.test(`${element.family} ${element.type}`) || element.lines.some((line) => line.curved));
}

/** The arrow of a variable with three global components. */
function vectorArrow(id: string, point: number, handle: number, sign: number): ArrowItem {
  return {
    id,
    point,
    handles: [handle],
    read(pose, out) {
      for (let k = 0; k < 3; ++k) out[k] = sign * pose.value(handle, k);
    },
  };
}

/** Joints and nodes are small against the model, and against the distance between its nodes. */
export function glyphSize(geometry: Geometry): number {
  const nodes = Math.max(geometry.nodes.length, 1);
  return geometry.extent * Math.min(0.05, Math.max(0.012, 0.22 / Math.sqrt(nodes)));
}

/** A glyph for each node. */
export function nodeItems(geometry: Geometry, size: number): GlyphItem[] {
  const sizes: Vec3 = [size, size, size], local: Mat3 = IDENTITY;
  return geometry.nodes.map((node, point) => ({ id: `node.structural:${node.label}`, point, local, size: sizes }));
}
