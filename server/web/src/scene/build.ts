/** What is drawn of a model: a batch for each kind of thing. */
import * as THREE from 'three';
import type { Geometry, Pose } from '../geometry';
import { ArrowBatch, type ArrowItem, type ArrowLook } from './batches/arrows';
import { BarBatch } from './batches/bars';
import type { Batch } from './batches/batch';
import { BeamBatch } from './batches/beams';
import { FaceBatch } from './batches/faces';
import { FlexibleBatch } from './batches/flexible';
import { GlyphBatch } from './batches/glyphs';
import { LineBatch, type LineItem } from './batches/lines';
import { MeshBatch } from './batches/meshes';
import { glyph, MANY } from './glyphs';
import { Items, nodeItems } from './items';
import type { Palette } from './palette';
import type { ValueScale } from './value_colour';

/** What can be shown and hidden by itself. */
export type Layer = 'nodes' | 'links' | 'bodies' | 'joints' | 'beams' | 'lines' | 'surfaces' | 'forces' | 'flexible' | 'reactions' | 'velocities' | 'axes';

/** A range of values and the colours of its ends. */
export interface Legend {
  name: string;
  /** Of a variable that has the values' unit; absent: that of positions. */
  handle?: number;
  least: number;
  largest: number;
  low: string;
  high: string;
}

function legend(name: string, { range, low, high }: ValueScale, handle?: number): Legend | undefined {
  const hex = (colour: THREE.Color) => `#${colour.getHexString()}`;
  return range && { name, handle, least: range[0], largest: range[1], low: hex(low), high: hex(high) };
}

/** Layers that are hidden until somebody asks for them. */
export const ASKED_FOR: readonly Layer[] = ['reactions', 'velocities', 'axes'];

const NODE_SIZE = 0.36;
/** Length of the longest arrow, as a part of the model's extent. */
const ARROW = 0.28;
/** Moments that are smaller than such a part of the largest reaction times the model's extent are rounding. */
const NOISE = 1e-9;

/** A ball around balls: its centre is that of the box around them. */
function around(balls: readonly THREE.Sphere[]): THREE.Sphere {
  const box = new THREE.Box3(), one = new THREE.Box3();
  for (const ball of balls) box.union(ball.getBoundingBox(one));
  const centre = box.isEmpty() ? new THREE.Vector3() : box.getCenter(new THREE.Vector3());
  return new THREE.Sphere(centre, balls.reduce((reach, ball) => Math.max(reach, ball.center.distanceTo(centre) + ball.radius), 0));
}

export class Drawn {
  readonly batches: { layer: Layer; batch: Batch }[] = [];
  /** The nodes' glyphs, in the order of `Geometry.nodes`. */
  readonly nodes: GlyphBatch;
  private readonly items: Items;

  constructor(geometry: Geometry, private readonly palette: Palette, handleOf: (name: string) => number | undefined) {
    const items = (this.items = new Items(geometry, palette, handleOf));
    this.nodes = new GlyphBatch(glyph('node', geometry.nodes.length), nodeItems(geometry, NODE_SIZE * items.size), items.points, this.colour('node'));
    this.add('nodes', this.nodes);
    this.addLines('links', items.links, 'link', 2);
    this.addBodies();
    for (const { triangles, colour, items: copies } of items.meshes)
      this.add('bodies', new MeshBatch(triangles, copies, items.points, colour ? new THREE.Color(colour) : this.colour('body')));
    for (const [name, list] of items.joints) this.add('joints', new GlyphBatch(glyph(name, list.length), list, items.points, this.colour('joint')));
    if (items.beams.length > 0) this.add('beams', new BeamBatch(items.beams, items.points, this.colour('beam')));
    this.addLines('beams', items.sections, 'section', 1.2);
    this.addLines('lines', items.springs, 'spring', 2);
    if (items.barrels.length > 0) this.add('lines', new BarBatch(items.barrels, items.points, this.colour('hydraulic'), 0.8));
    if (items.rods.length > 0) this.add('lines', new BarBatch(items.rods, items.points, this.colour('node')));
    this.addLines('lines', items.others, 'other', 2.5);
    if (items.faces.length > 0) this.add('surfaces', new FaceBatch(items.faces, items.points, this.colour('shell')));
    this.addArrows('forces', items.forces, 'force', { tipAtPoint: true });
    this.addArrows('forces', items.moments, 'moment', { tipAtPoint: true, heads: 2 });
    const forces = this.addArrows('reactions', items.reactions, 'reaction'), lever = NOISE * geometry.extent;
    this.addArrows('reactions', items.reactionMoments, 'reaction', { heads: 2, least: () => lever * (forces?.largest ?? 0) });
    this.addArrows('velocities', items.velocities, 'velocity');
    this.addLines('axes', items.axes, 'other', 2);
    for (const body of geometry.bodies) this.add('flexible', new FlexibleBatch(body, `joint:${body.joint}`, items.deformations, 0.12 * items.size));
  }

  private colour(name: keyof Palette): THREE.Color {
    return new THREE.Color(this.palette[name]);
  }

  private add(layer: Layer, batch: Batch): void {
    this.batches.push({ layer, batch });
  }

  private addLines(layer: Layer, list: LineItem[], name: keyof Palette, width: number): void {
    if (list.length > 0) this.add(layer, new LineBatch(list, this.colour(name), width));
  }

  /** One sees through bodies, unless they are so many that this would cost too much. */
  private addBodies(): void {
    const { bodies, points } = this.items;
    if (bodies.length > 0) this.add('bodies', new GlyphBatch(glyph('sphere', bodies.length), bodies, points, this.colour('body'), bodies.length > MANY ? 1 : 0.62));
  }

  private addArrows(layer: Layer, list: ArrowItem[], name: keyof Palette, look: Partial<ArrowLook> = {}): ArrowBatch | undefined {
    if (list.length === 0) return undefined;
    const batch = new ArrowBatch(list, this.items.points, this.colour(name), { reach: ARROW * this.items.geometry.extent, tipAtPoint: false, heads: 1, ...look });
    this.add(layer, batch);
    return batch;
  }

  /** What colours mean, as far as values were seen. */
  legends(): Legend[] {
    const { pressures, pressure, deformations } = this.items;
    return [legend('pressure', pressures, pressure), legend('deformation', deformations)].filter((known) => known !== undefined);
  }

  /** Colours begin anew with the values that come. */
  forgetColours(): void {
    this.items.pressures.forget();
    this.items.deformations.forget();
  }

  /** Handles of the variables that a layer needs besides the poses of nodes. */
  needs(layer: Layer): number[] {
    const arrows = this.batches.filter((entry) => entry.layer === layer).map(({ batch }) => batch).filter((batch) => batch instanceof ArrowBatch);
    return arrows.flatMap((batch) => batch.items.flatMap((item) => item.handles));
  }

  /** A ball around all that is drawn as it stands, but for arrows and axes. */
  bounds(): THREE.Sphere {
    const balls: THREE.Sphere[] = [], { bodies, points: { x } } = this.items;
    const add = (from: ArrayLike<number>, at: number, radius: number) => balls.push(new THREE.Sphere(new THREE.Vector3(from[at], from[at + 1], from[at + 2]), radius));
    for (let i = 0; i < x.length; i += 3) add(x, i, 0);
    for (const { point, size } of bodies) add(x, 3 * point, Math.max(...size));
    for (const { batch } of this.batches) if (batch instanceof MeshBatch) balls.push(...batch.balls());
    for (const { batch } of this.batches) if (batch instanceof FlexibleBatch) for (let i = 0; i < batch.where.length; i += 3) add(batch.where, i, 0);
    return around(balls);
  }

  update(pose: Pose): void {
    this.items.points.update(pose);
    for (const { batch } of this.batches) if (batch.object.visible) batch.update(pose);
  }
}
