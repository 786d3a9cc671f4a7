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
const handles: Record<string, number> = { 'joint.7.Fx': 10, 'joint.7.Fy': 11, 'joint.7.Fz': 12, 'joint.7.Mx': 13, 'joint.7.My': 14, 'joint.7.Mz': 15 };
/** Node 0 stands straight, node 1 is turned by a quarter about z, too. */
const pose: Pose = { x: new Float64Array(6), R: Float64Array.from([...IDENTITY, ...turn]), value: (handle) => handle - 9 };

function load(shape: ElementShape, kind: 'force' | 'moment'): number[] {
  const out = [0, 0, 0];
  reactionOf(shape, [4, 5], (name) => handles[name], kind)?.read(pose, out);
  return out.map((value) => Math.round(1e9 * value) / 1e9);
}
const force = (type: string) => load(joint(type), 'force'), moment = (type: string) => load(joint(type), 'moment');

describe('the reaction of a joint', () => {
  test('in global components acts on the second node', () => {
    expect(force('spherical hinge')).toEqual([1, 2, 3]);
    expect(reactionOf(joint('spherical hinge'), [4, 5], (name) => handles[name], 'force')?.point).toBe(5);
  });

  test('in the frame of the second hinge turns with it', () => expect(force('revolute hinge')).toEqual([-1, -2, 3]));

  test('of a total joint is in the frame of the first hinge, and is what the first node gets', () => expect(force('total joint')).toEqual([-1, -2, -3]));

  test('on a single node acts there', () => {
    const pin = { ...joint('spherical pin'), points: [{ name: 'hinge 1', node: 0, offset: [0, 0, 0] as const }, { name: 'ground', node: -1, offset: [0, 0, 0] as const }] };
    const arrow = reactionOf(pin, [4, 5], (name) => handles[name], 'force'), out = [0, 0, 0];
    arrow?.read(pose, out);
    expect(arrow?.point).toBe(4);
    expect(out).toEqual([-1, -2, -3]);
  });

  test('is not drawn where its frame is not known, or it has none', () => {
    expect(reactionOf(joint('deformable hinge'), [4, 5], (name) => handles[name], 'force')).toBeUndefined();
    expect(reactionOf(joint('spherical hinge'), [4, 5], () => undefined, 'force')).toBeUndefined();
  });
});

describe('the moment of a joint', () => {
  test('on the second node is in the axes that the joint has it in', () => {
    expect(moment('clamp')).toEqual([-4, -5, -6]);
    expect(moment('revolute hinge')).toEqual([-4, -5, 6]);
    expect(moment('axial rotation')).toEqual([-4, -5, 6]);
    expect(moment('drive hinge')).toEqual([-4, -5, -6]);
  });

  test('of a total joint is in the axes of its rotations, where they are others', () => {
    expect(moment('total joint')).toEqual([-4, -5, -6]);
    const turned = { ...joint('total joint'), frames: [...joint('total joint').frames, { name: 'rotation', point: 0, orientation: turn }] };
    expect(load(turned, 'moment')).toEqual([5, -4, -6]);
    expect(load(turned, 'force')).toEqual([-1, -2, -3]);
  });

  test('is not there where the joint lets its nodes turn', () => {
    expect(reactionOf(joint('spherical hinge'), [4, 5], (name) => handles[name], 'moment')).toBeUndefined();
  });
});
