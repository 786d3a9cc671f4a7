import { describe, expect, test } from 'vitest';
import { IDENTITY, rotationOf } from '../src/algebra';
import type { ElementShape, Pose } from '../src/geometry';
import { reactionOf } from '../src/reactions';

const turn = rotationOf([0, 0, Math.PI / 2]);

function joint(type: string): ElementShape {
  return {
    id: 'joint:7', family: 'joint', type, label: 7, name: '', lines: [], surfaces: [], masses: [], arrows: [],
    points: [{ name: 'hinge 1', node: 0, offset: [0, 0, 0] }, { name: 'hinge 2', node: 1, offset: [0, 0, 0] }],
    frames: [{ name: 'hinge 1', point: 0, orientation: IDENTITY }, { name: 'hinge 2', point: 1, orientation: turn }],
  };
}
const handles: Record<string, number> = { 'joint.7.Fx': 10, 'joint.7.Fy': 11, 'joint.7.Fz': 12 };
/** Node 0 stands straight, node 1 is turned by a quarter about z, too. */
const pose: Pose = { x: new Float64Array(6), R: Float64Array.from([...IDENTITY, ...turn]), value: (handle) => handle - 9 };

function force(type: string): number[] {
  const out = [0, 0, 0];
  reactionOf(joint(type), [4, 5], (name) => handles[name])?.read(pose, out);
  return out.map((value) => Math.round(1e9 * value) / 1e9);
}

describe('the reaction of a joint', () => {
  test('in global components acts on the second node', () => {
    expect(force('spherical hinge')).toEqual([1, 2, 3]);
    expect(reactionOf(joint('spherical hinge'), [4, 5], (name) => handles[name])?.point).toBe(5);
  });

  test('in the frame of the second hinge turns with it', () => expect(force('revolute hinge')).toEqual([-1, -2, 3]));

  test('of a total joint is in the frame of the first hinge, and is what the first node gets', () => expect(force('total joint')).toEqual([-1, -2, -3]));

  test('on a single node acts there', () => {
    const pin = { ...joint('spherical pin'), points: [{ name: 'hinge 1', node: 0, offset: [0, 0, 0] as const }, { name: 'ground', node: -1, offset: [0, 0, 0] as const }] };
    const arrow = reactionOf(pin, [4, 5], (name) => handles[name]), out = [0, 0, 0];
    arrow?.read(pose, out);
    expect(arrow?.point).toBe(4);
    expect(out).toEqual([-1, -2, -3]);
  });

  test('is not drawn where its frame is not known, or it has none', () => {
    expect(reactionOf(joint('deformable hinge'), [4, 5], (name) => handles[name])).toBeUndefined();
    expect(reactionOf(joint('spherical hinge'), [4, 5], () => undefined)).toBeUndefined();
  });
});
