import * as THREE from 'three';
import { describe, expect, test } from 'vitest';
import { IDENTITY, rotationOf, type Vec3 } from '../src/algebra';
import { initialPose, pointAt, type FlexibleBody, type NodeShape, type PointShape, type Pose } from '../src/geometry';
import { writeBar } from '../src/scene/batches/matrices';
import { FlexibleBatch } from '../src/scene/batches/flexible';
import { GlyphBatch } from '../src/scene/batches/glyphs';
import { roundBelow } from '../src/scene/grid';
import { coil, straight } from '../src/scene/line_items';
import { Points } from '../src/scene/points';
import { drawnBy, solids } from '../src/scene/solids';
import { ValueScale } from '../src/scene/value_colour';

const nodes: NodeShape[] = [
  { label: 1, kind: 'static', name: '', position: [1, 2, 3], orientation: rotationOf([0.3, -0.7, 1.1]), positionHandle: 0 },
  { label: 2, kind: 'dynamic', name: '', position: [-1, 0, 2], positionHandle: 1 },
];
const pose = initialPose(nodes);
const shapes: PointShape[] = [
  { name: '', node: 0, offset: [0.1, 0.2, -0.3] },
  { name: '', node: -1, offset: [5, 6, 7] },
  { name: '', node: 1, offset: [0, 0, 0] },
];

function table(): { points: Points; index: number[] } {
  const points = new Points(nodes.length), index = shapes.map((shape) => points.add(shape));
  points.update(pose);
  return { points, index };
}

describe('points', () => {
  test('stand where their nodes carry them', () => {
    const { points, index } = table();
    shapes.forEach((shape, i) => pointAt(pose, shape).forEach((value, k) => expect(points.x[3 * index[i] + k]).toBeCloseTo(value, 12)));
  });

  test('without an offset are their nodes', () => expect(table().index[2]).toBe(1));
});

describe('solids', () => {
  const box = new THREE.BoxGeometry(1, 1, 1), sizes: Vec3 = [2, 3, 4];

  test('turn with their node and have their sizes along their own axes', () => {
    drawnBy(true);
    const { points, index } = table(), local = rotationOf([0.2, 0.1, -0.4]);
    const batch = new GlyphBatch(box, [{ id: 'a', point: index[0], local, size: sizes }], points, new THREE.Color());
    batch.update(pose);
    const matrix = new THREE.Matrix4().fromArray(batch.matrices), R = nodes[0].orientation ?? IDENTITY;
    const x = pointAt(pose, shapes[0]);
    for (let column = 0; column < 3; ++column)
      for (let row = 0; row < 3; ++row) {
        const turned = [0, 1, 2].reduce((sum, k) => sum + R[3 * row + k] * local[3 * k + column], 0);
        expect(matrix.elements[4 * column + row]).toBeCloseTo(turned * sizes[column], 5);
      }
    for (let k = 0; k < 3; ++k) expect(matrix.elements[12 + k]).toBeCloseTo(x[k], 5);
  });

  test.each([true, false])('that one sees through hide nothing, with a graphics card: %s', (card) => {
    drawnBy(card);
    const look = (opacity: number) => solids(box, 100, opacity).object.material as THREE.Material;
    expect([look(0.6).transparent, look(0.6).depthWrite]).toEqual([true, false]);
    expect([look(1).transparent, look(1).depthWrite]).toEqual([false, true]);
  });

  test('in one mesh stand where instances would, and are told apart', () => {
    const corner = new THREE.Vector3();
    drawnBy(false);
    const many = solids(box, 100);
    drawnBy(true);
    const instances = solids(box, 100);
    expect(many.object).not.toBeInstanceOf(THREE.InstancedMesh);
    expect(instances.object).toBeInstanceOf(THREE.InstancedMesh);
    const matrix = new THREE.Matrix4().compose(new THREE.Vector3(7, 8, 9), new THREE.Quaternion().setFromEuler(new THREE.Euler(0.3, 0.5, 0.7)), new THREE.Vector3(...sizes));
    matrix.toArray(many.matrices, 16 * 42);
    many.moved();
    const position = many.object.geometry.attributes.position, each = position.count / 100;
    const box42 = new THREE.Box3().setFromArray(position.array.slice(3 * 42 * each, 3 * 43 * each));
    const expected = new THREE.Box3();
    for (let i = 0; i < 8; ++i) expected.expandByPoint(corner.set(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5).applyMatrix4(matrix));
    expect(box42.min.distanceTo(expected.min)).toBeLessThan(1e-5);
    expect(box42.max.distanceTo(expected.max)).toBeLessThan(1e-5);
    expect(many.copyOf({ faceIndex: 42 * 12 + 11 } as THREE.Intersection)).toBe(42);
    expect(instances.copyOf({ instanceId: 42 } as THREE.Intersection)).toBe(42);
  });

  test('that are bars lie along their direction', () => {
    for (const d of [[0, 0, 1], [0, 0, -1], [1, 0, 0], [0.6, -0.8, 0], [0.36, 0.48, 0.8]]) {
      const out = new Float32Array(16);
      writeBar(out, 0, [1, 2, 3], d, 5, 0.5);
      const matrix = new THREE.Matrix4().fromArray(out), end = new THREE.Vector3(0, 1, 0).applyMatrix4(matrix);
      d.forEach((value, k) => expect(end.getComponent(k)).toBeCloseTo([1, 2, 3][k] + 5 * value, 5));
      expect(Math.abs(matrix.determinant())).toBeCloseTo(5 * 0.25, 5);
    }
  });
});

test('cells of the grid have round lengths', () => {
  expect([0.004, 0.01, 0.3, 0.75, 1, 4.9, 5, 14, 100].map(roundBelow).map((cell) => Number(cell.toPrecision(6)))).toEqual([0.002, 0.01, 0.2, 0.5, 1, 2, 5, 10, 100]);
});

describe('a flexible body', () => {
  const body: FlexibleBody = {
    joint: 1, node: -1, fixedPosition: [0, 0, 0], fixedOrientation: IDENTITY, amplitudes: [7], labels: ['1', '2', '3'],
    positions: [0, 0, 0, 1, 0, 0, 2, 0, 0], shapes: [0, 0, 0, 0, 0, 0.5, 0, 0, 1],
  };
  const bent: Pose = { ...pose, value: (handle) => (handle === 7 ? 0.1 : NaN) };
  const blue = new THREE.Color(0, 0, 1), red = new THREE.Color(1, 0, 0);

  test('is drawn deformed, as many times as asked, in the colours of its deformation', () => {
    drawnBy(true);
    const scale = new ValueScale(blue, red, 0), batch = new FlexibleBatch(body, 'joint:1', scale, 0.01);
    batch.factor = 10;
    batch.update(bent);
    Array.from(batch.where).forEach((x, i) => expect(x).toBeCloseTo([0, 0, 0, 1, 0, 0.5, 2, 0, 1][i], 6));
    expect(scale.range?.map((value) => Number(value.toPrecision(6)))).toEqual([0, 0.1]);
    const points = batch.object.children[0] as THREE.Points, colours = Array.from(points.geometry.attributes.color.array);
    [0, 0, 1, 0.5, 0, 0.5, 1, 0, 0].forEach((part, i) => expect(colours[i]).toBeCloseTo(part, 5));
  });

  test('has a bar between each two near points', () => {
    drawnBy(true);
    const batch = new FlexibleBatch(body, 'joint:1', new ValueScale(blue, red, 0), 0.01);
    batch.update(bent);
    const bars = batch.object.children[1] as THREE.InstancedMesh, matrix = new THREE.Matrix4(), ends: number[] = [];
    for (let i = 0; i < bars.count; ++i) {
      bars.getMatrixAt(i, matrix);
      ends.push(...[0, 1].map((y) => new THREE.Vector3(0, y, 0).applyMatrix4(matrix).x));
    }
    expect(bars.count).toBeGreaterThanOrEqual(2);
    for (const x of [0, 1, 2]) expect(ends.some((end) => Math.abs(end - x) < 1e-6)).toBe(true);
  });
});

describe('colours of values', () => {
  const low = new THREE.Color(0, 0, 1), high = new THREE.Color(1, 0, 0);

  test('lie between those of the least and the largest seen', () => {
    const scale = new ValueScale(low, high), out = new THREE.Color();
    scale.colour(5, out);
    expect(out.toArray()).toEqual([0.5, 0, 0.5]);
    scale.colour(15, out);
    expect(out.toArray()).toEqual([1, 0, 0]);
    scale.colour(5, out);
    expect(out.toArray()).toEqual([0, 0, 1]);
    scale.colour(NaN, out.set(0x00ff00));
    expect(out.toArray()).toEqual([0, 1, 0]);
  });
});

describe('lines', () => {
  test('that are springs begin and end at their points and keep their radius', () => {
    const { points, index } = table();
    const item = coil('a', [index[0], index[1]], 0.1, points), out = new Float32Array(3 * item.corners);
    item.fill(out, pose);
    const from = pointAt(pose, shapes[0]), to = shapes[1].offset;
    for (let k = 0; k < 3; ++k) {
      expect(out[k]).toBeCloseTo(from[k], 5);
      expect(out[out.length - 3 + k]).toBeCloseTo(to[k], 5);
    }
    const along = new THREE.Vector3(...to).sub(new THREE.Vector3(...from)).normalize();
    for (let i = 1; i < item.corners - 1; ++i) {
      const at = new THREE.Vector3().fromArray(out, 3 * i).sub(new THREE.Vector3(...from));
      expect(at.addScaledVector(along, -at.dot(along)).length()).toBeCloseTo(0.1, 5);
    }
  });

  test('go through their points', () => {
    const { points, index } = table(), item = straight('a', [index[0], index[1], index[2]], points), out = new Float32Array(9);
    item.fill(out, pose);
    expect(Array.from(out.slice(3, 9))).toEqual([5, 6, 7, -1, 0, 2]);
  });
});
