/** Reactions of joints as forces on their second node, or on their only one, out of their private data. */
import type { ElementShape, Pose } from './geometry';

interface Reaction {
  /** Which of the joint's frames the components are in; absent: global. */
  frame?: 0 | 1;
  /** The force on the node is so many times the private data. */
  sign: 1 | -1;
}

/** By the joint's type, as the reference of the language has its private data Fx, Fy, Fz. */
const REACTIONS: Record<string, Reaction> = {
  'clamp': { sign: -1 },
  'spherical hinge': { sign: 1 },
  'spherical pin': { sign: -1 },
  'revolute hinge': { frame: 1, sign: 1 },
  'revolute pin': { frame: 0, sign: -1 },
  'cardano hinge': { sign: 1 },
  'cardano pin': { sign: 1 },
  'in line': { frame: 0, sign: -1 },
  'total joint': { frame: 0, sign: -1 },
  'total pin joint': { frame: 1, sign: -1 },
};

/** What an arrow of the reaction needs; nothing where the joint has none, or its frame is not known. `points`: indices of the element's points. */
export function reactionOf(element: ElementShape, points: number[], handleOf: (name: string) => number | undefined) {
  const reaction = element.family === 'joint' ? REACTIONS[element.type] : undefined;
  const handles = ['Fx', 'Fy', 'Fz'].map((name) => handleOf(`joint.${element.label}.${name}`));
  if (!reaction || points.length === 0 || handles.some((handle) => handle === undefined)) return undefined;
  const known = handles as number[], local = [0, 0, 0];
  const moving = element.frames.map((frame) => element.points[frame.point].node);
  const onNode = element.points.map(({ node }) => node).lastIndexOf(element.points.reduce((last, { node }) => (node >= 0 ? node : last), -1));
  const frame = reaction.frame === undefined ? undefined : element.frames[reaction.frame];
  if (reaction.frame !== undefined && !frame) return undefined;
  return {
    id: element.id,
    point: points[Math.max(onNode, 0)],
    handles: known,
    read(pose: Pose, out: number[]) {
      for (let k = 0; k < 3; ++k) local[k] = reaction.sign * pose.value(known[k], 0);
      if (!frame) return void local.forEach((value, k) => (out[k] = value));
      const R = frame.orientation, node = moving[reaction.frame ?? 0];
      const inNode = [0, 1, 2].map((row) => R[3 * row] * local[0] + R[3 * row + 1] * local[1] + R[3 * row + 2] * local[2]);
      for (let row = 0, r = 9 * node; row < 3; ++row, r += 3)
        out[row] = node < 0 ? inNode[row] : pose.R[r] * inNode[0] + pose.R[r + 1] * inNode[1] + pose.R[r + 2] * inNode[2];
    },
  };
}
