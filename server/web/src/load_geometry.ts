/** Reads `DescribeGeometry` into plain data: what is drawn, with the meshes of the deck's sidecar, and the cards of the deck. */
import { geometry as client } from './api';
import { mat3, vec3, type Mat3 } from './algebra';
import { finish, type ElementShape, type FlexibleBody, type Geometry, type NodeShape } from './geometry';
import { meshesOf, type Meshes } from './meshes';
import { cardOf, type Card } from './model';
import { SidecarError } from './sidecar';
import type { ElementGeometry, ModalPoints, NodeGeometry } from './gen/mbcosim/v1/geometry_pb';

export interface Loaded {
  geometry: Geometry;
  cards: Map<string, Card>;
  /** Why the sidecar's meshes are not drawn. */
  fault?: string;
}

export async function loadGeometry(simulation: string, signal?: AbortSignal): Promise<Loaded> {
  const nodes: NodeShape[] = [], elements: ElementShape[] = [], bodies: FlexibleBody[] = [];
  const indexOf = new Map<number, number>(), cards = new Map<string, Card>();
  const pieces = new Map<string, Uint8Array[]>();
  for await (const reply of client.describeGeometry({ simulation, cards: true, attachments: true }, { signal })) {
    switch (reply.content.case) {
      case 'nodes':
        for (const node of reply.content.value.nodes) {
          indexOf.set(node.label, nodes.length);
          nodes.push(nodeShape(node));
        }
        break;
      case 'elements':
        for (const element of reply.content.value.elements) elements.push(elementShape(element, indexOf));
        break;
      case 'modalPoints':
        addPoints(bodies, reply.content.value, indexOf);
        break;
      case 'cards':
        for (const card of reply.content.value.cards) cards.set(...cardOf(card));
        break;
      case 'attachment': {
        const { path, data } = reply.content.value;
        pieces.set(path, [...(pieces.get(path) ?? []), data]);
        break;
      }
    }
  }
  const { meshes, triangles, fault } = await attached(pieces, nodes, elements);
  return { geometry: finish(nodes, elements, bodies, meshes, triangles), cards, fault };
}

/** A sidecar that is wrong keeps nobody from looking at the rest. */
async function attached(pieces: ReadonlyMap<string, Uint8Array[]>, nodes: NodeShape[], elements: ElementShape[]): Promise<Meshes & { fault?: string }> {
  const files = await Promise.all([...pieces].map(async ([path, parts]): Promise<[string, Uint8Array]> =>
    [path, new Uint8Array(await new Blob(parts as BlobPart[]).arrayBuffer())]));
  try {
    return await meshesOf(new Map(files), nodes, elements);
  } catch (thrown) {
    if (!(thrown instanceof SidecarError)) throw thrown;
    return { meshes: [], triangles: [], fault: thrown.message };
  }
}

function nodeShape(node: NodeGeometry): NodeShape {
  return {
    label: node.label,
    kind: node.kind,
    name: node.name,
    position: vec3(node.position),
    orientation: node.orientation.length === 9 ? mat3(node.orientation) : undefined,
    positionHandle: node.positionHandle,
    orientationHandle: node.orientationHandle,
  };
}

function elementShape(element: ElementGeometry, indexOf: Map<number, number>): ElementShape {
  return {
    id: `${element.family}:${element.label}`,
    family: element.family,
    type: element.type,
    label: element.label,
    name: element.name,
    points: element.points.map((point) => {
      const node = point.nodeLabel === undefined ? -1 : indexOf.get(point.nodeLabel) ?? -1;
      return { name: point.name, node, offset: vec3(point.offset) };
    }),
    frames: element.frames.map((frame) => ({ name: frame.name, point: frame.point, orientation: mat3(frame.orientation) })),
    lines: element.lines.map((line) => ({ name: line.name, points: [...line.points], curved: line.curved, value: line.valueHandle })),
    surfaces: element.surfaces.map((surface) => ({ name: surface.name, points: [...surface.points] })),
    masses: element.masses.map((mass) => ({
      point: mass.point,
      mass: mass.mass,
      moments: vec3(mass.principalMoments),
      axes: mat3(mass.principalAxes) as Mat3,
    })),
    arrows: element.arrows.map((arrow) => ({
      point: arrow.point,
      handle: arrow.handle,
      sign: arrow.reversed ? -1 : 1,
      moment: arrow.moment,
    })),
  };
}

/** Points of one body come in several messages. */
function addPoints(bodies: FlexibleBody[], part: ModalPoints, indexOf: Map<number, number>): void {
  let body = bodies.find((known) => known.joint === part.jointLabel);
  if (!body) {
    body = {
      joint: part.jointLabel,
      node: part.nodeLabel === undefined ? -1 : indexOf.get(part.nodeLabel) ?? -1,
      fixedPosition: vec3(part.fixedPosition),
      fixedOrientation: mat3(part.fixedOrientation),
      amplitudes: [...part.amplitudeHandles],
      labels: [],
      positions: [],
      shapes: [],
    };
    bodies.push(body);
  }
  body.labels.push(...part.labels);
  for (const value of part.positions) body.positions.push(value);
  for (const value of part.shapes) body.shapes.push(value);
}
