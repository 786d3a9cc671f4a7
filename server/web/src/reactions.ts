/** Reactions of joints as forces and moments on their second node, or on their only one, out of their private data. */
import type { ElementShape, Pose } from './geometry';

interface Reaction {
  /** Which of the joint's frames the components are in; absent: global. */
  frame?: 0 | 1;
  /** The load on the node is so many times the private data. */
  sign: 1 | -1;
}

/** By the joint's type, as the reference of the language has its private data Fx, Fy, Fz and Mx, My, Mz. */
const REACTIONS: Record<string, { force?: Reaction; moment?: Reaction }> = {
  'clamp': { force: { sign: -1 }, moment: { sign: -1 } },
  'spherical hinge': { force: { sign: 1 } },
  'spherical pin': { force: { sign: -1 } },
  'revolute hinge': { force: { frame: 1, sign: 1 }, moment: { frame: 1, sign: 1 } },
  'revolute pin': { force: { frame: 0, sign: -1 }, moment: { frame: 0, sign: -1 } },
  'revolute rotation': { moment: { frame: 1, sign: 1 } },
  'axial rotation': { force: { frame: 1, sign: 1 }, moment: { frame: 1, sign: 1 } },
  'prismatic': { moment: { frame: 1, sign: 1 } },
  'drive hinge': { moment: { frame: 0, sign: -1 } },
  'cardano hinge': { force: { sign: 1 } },
  'cardano pin': { force: { sign: 1 } },
  'in line': { force: { frame: 0, sign: -1 } },
  'total joint': { force: { frame: 0, sign: -1 }, moment: { frame: 0, sign: -1 } },
  'total pin joint': { force: { frame: 1, sign: -1 }, moment: { frame: 1, sign: -1 } },
};
/** Axes of the moments of total joints, where they are not those of the forces. */
const ROTATION = 'rotation';

type HandleOf = (name: string) => number | undefined;

/** What an arrow of the reaction needs; nothing where the joint has none, or its frame is not known. `points`: indices of the element's points. */
export function reactionOf(element: ElementShape, points: number[], handleOf: HandleOf, kind: 'force' | 'moment') {
  const reaction = element.family === 'joint' ? REACTIONS[element.type]?.[kind] : undefined, letter = kind === 'force' ? 'F' : 'M';
  const handles = ['x', 'y', 'z'].map((axis) => handleOf(`joint.${element.label}.${letter}${axis}`));
  if (!reaction || points.length === 0 || handles.some((handle) => handle === undefined)) return undefined;
  const known = handles as number[], local = [0, 0, 0];
  const onNode = element.points.map(({ node }) => node).lastIndexOf(element.points.reduce((last, { node }) => (node >= 0 ? node : last), -1));
  const frame = reaction.frame === undefined ? undefined : (kind === 'moment' && element.frames.find(({ name }) => name === ROTATION)) || element.frames[reaction.frame];
  if (reaction.frame !== undefined && !frame) return undefined;
  const node = frame ? element.points[frame.point].node : -1;
  return {
    id: element.id,
    point: points[Math.max(onNode, 0)],
    handles: known,
    read(pose: Pose, out: number[]) {
      for (let k = 0; k < 3; ++k) local[k] = reaction.sign * pose.value(known[k], 0);
      if (!frame) return void local.forEach((value, k) => (out[k] = value));
      const R = frame.orientation;
      const inNode = [0, 1, 2].map((row) => R[3 * row] * local[0] + R[3 * row + 1] * local[1] + R[3 * row + 2] * local[2]);
      for (let row = 0, r = 9 * node; row < 3; ++row, r += 3)
        out[row] = node < 0 ? inNode[row] : pose.R[r] * inNode[0] + pose.R[r + 1] * inNode[1] + pose.R[r + 2] * inNode[2];
    },
  };
}
