import { describe, expect, test } from 'vitest';
import { IDENTITY } from '../src/algebra';
import { finish, type ElementShape, type NodeShape } from '../src/geometry';
import { meshesOf } from '../src/meshes';
import { readSidecar, SidecarError } from '../src/sidecar';
import { Drawn } from '../src/scene/build';
import { LIGHT } from '../src/scene/palette';

const labels = new Set([1, 7]);
const read = (text: string) => readSidecar('arm.view.json', text, labels);

describe('a sidecar', () => {
  test('says where meshes are', () => {
    const quarter = [0, -1, 0, 1, 0, 0, 0, 0, 1];
    expect(read(JSON.stringify({ meshes: [{ node: 7, file: 'a.stl' }, { file: 'b.obj', offset: [1, 2, 3], orientation: quarter, scale: 0.001, color: '#8090A0' }] }))).toEqual([
      { node: 7, file: 'a.stl', offset: [0, 0, 0], orientation: IDENTITY, scale: 1, colour: undefined },
      { node: undefined, file: 'b.obj', offset: [1, 2, 3], orientation: quarter, scale: 0.001, colour: '#8090A0' },
    ]);
  });

  test.each([
    ['{"meshes": [}', /^arm\.view\.json(:1:13)?: this is no JSON/],
    ['[]', /"meshes" is missing/],
    ['{"meshes": {}}', /"meshes" is missing/],
    ['{"meshes": [], "units": "mm"}', /^arm\.view\.json: "units" is unknown/],
    ['{"meshes": [7]}', /meshes\[0\]: must be/],
    ['{"meshes": [{"file": "a.stl"}, {"node": 1}]}', /meshes\[1\]\.file: must be/],
    ['{"meshes": [{"node": 2, "file": "a.stl"}]}', /meshes\[0\]\.node: 2 is no label of a structural node/],
    ['{"meshes": [{"node": "7", "file": "a.stl"}]}', /meshes\[0\]\.node: "7" is no label/],
    ['{"meshes": [{"file": "a.stl", "scale": 0}]}', /meshes\[0\]\.scale: 0 must be/],
    ['{"meshes": [{"file": "a.stl", "offset": [1, 2]}]}', /meshes\[0\]\.offset: must be 3 numbers/],
    ['{"meshes": [{"file": "a.stl", "orientation": [1, 0, 0, 0, 1, 0, 0, 0, -1]}]}', /meshes\[0\]\.orientation: must be a rotation/],
    ['{"meshes": [{"file": "a.stl", "orientation": [2, 0, 0, 0, 1, 0, 0, 0, 1]}]}', /meshes\[0\]\.orientation: must be a rotation/],
    ['{"meshes": [{"file": "a.stl", "color": "red"}]}', /meshes\[0\]\.color: "red" must be like/],
    ['{"meshes": [{"file": "a.stl", "rotation": []}]}', /meshes\[0\]\.rotation: is unknown/],
  ])('that is wrong is refused with its place: %s', (text, message) => {
    expect(() => read(text)).toThrow(SidecarError);
    expect(() => read(text)).toThrow(message);
  });
});

const OBJ = 'v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 2 3\nf 1 2 4\n';
const STL = 'solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n';
const text = (words: string) => new TextEncoder().encode(words);

/** A triangle (0, 0, 0), (1, 0, 0), (0, 1, 0) that its glTF node moves by (5, 0, 0), as a .glb file. */
function glb(): Uint8Array {
  const json = JSON.stringify({
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0, translation: [5, 0, 0] }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
    accessors: [{ bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] }],
    bufferViews: [{ buffer: 0, byteLength: 36 }], buffers: [{ byteLength: 36 }],
  });
  const words = Buffer.from(json + ' '.repeat((4 - (json.length % 4)) % 4)), corners = Buffer.from(Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0).buffer);
  const head = (...numbers: number[]) => Buffer.from(Uint32Array.from(numbers).buffer);
  return new Uint8Array(Buffer.concat([head(0x46546c67, 2, 28 + words.length + corners.length), head(words.length, 0x4e4f534a), words, head(corners.length, 0x4e4942), corners]));
}

const nodes: NodeShape[] = [{ label: 7, kind: 'dynamic', name: '', position: [0, 0, 1], orientation: IDENTITY, positionHandle: 0 }];
const body = (label: number): ElementShape => ({
  id: `body:${label}`, family: 'body', type: '', label, name: '', points: [{ name: '', node: 0, offset: [0, 0, 0] }], frames: [], lines: [], surfaces: [], arrows: [],
  masses: [{ point: 0, mass: 1, moments: [1, 1, 1], axes: IDENTITY }],
});
const sidecar = (...meshes: object[]) => text(JSON.stringify({ meshes }));

describe('meshes', () => {
  test('are read out of OBJ, STL and glTF files, each once', async () => {
    const attachments = new Map([
      ['d/arm.view.json', sidecar({ file: 'a.obj' }, { node: 7, file: 'parts/b.stl' }, { file: './a.obj' }, { file: 'c.glb' })],
      ['d/a.obj', text(OBJ)], ['d/parts/b.stl', text(STL)], ['d/c.glb', glb()],
    ]);
    const { meshes, triangles } = await meshesOf(attachments, nodes, [body(3)]);
    expect(meshes.map((mesh) => [mesh.id, mesh.point.node, mesh.triangles])).toEqual([['', -1, 0], ['body:3', 0, 1], ['', -1, 0], ['', -1, 2]]);
    expect(triangles.map((list) => list.length)).toEqual([18, 9, 9]);
    expect([...triangles[0].slice(9)]).toEqual([0, 0, 0, 1, 0, 0, 0, 0, 3]);
    expect([...triangles[2]]).toEqual([5, 0, 0, 6, 0, 0, 5, 1, 0]);
  });

  test('of a node with several bodies are the node', async () => {
    const { meshes } = await meshesOf(new Map([['arm.view.json', sidecar({ node: 7, file: 'b.stl' })], ['b.stl', text(STL)]]), nodes, [body(3), body(4)]);
    expect(meshes[0].id).toBe('node.structural:7');
  });

  test.each([
    ['lost.stl', text(STL), /meshes\[0\]\.file: "lost\.stl" is not there/],
    ['a.step', text('ISO'), /meshes\[0\]\.file: "a\.step" must be an \.obj, \.stl, \.glb or \.gltf file/],
    ['a.obj', text('v 0 0 0\n'), /meshes\[0\]\.file: "a\.obj" has no triangles/],
    ['a.glb', text('{'), /meshes\[0\]\.file: /],
  ])('that cannot be drawn are told: %s', async (file, data, message) => {
    const attachments = new Map([['arm.view.json', sidecar({ file })], [file === 'lost.stl' ? 'other.stl' : file, data]]);
    const made = meshesOf(attachments, nodes, []);
    await expect(made).rejects.toThrow(SidecarError);
    await expect(made).rejects.toThrow(message);
  });

  test('stand in place of the ellipsoids of their bodies, and one sees all of them', async () => {
    const attachments = new Map([['arm.view.json', sidecar({ node: 7, file: 'a.obj', scale: 10 }, { node: 7, file: 'a.obj', offset: [0, 0, 50] })], ['a.obj', text(OBJ)]]);
    const { meshes, triangles } = await meshesOf(attachments, nodes, [body(3)]);
    const ball = (shapes: typeof meshes) => {
      const drawn = new Drawn(finish(nodes, [body(3)], [], shapes, triangles), LIGHT, () => undefined);
      drawn.update({ x: Float64Array.of(0, 0, 1), R: Float64Array.from(IDENTITY), value: () => NaN });
      return { bodies: drawn.batches.filter(({ layer }) => layer === 'bodies').length, bounds: drawn.bounds() };
    };
    expect(ball([]).bodies).toBe(1);
    const { bodies, bounds } = ball(meshes);
    expect(bodies).toBe(1);  // both copies of the mesh; no ellipsoid
    for (const corner of [[0, 0, 31], [10, 0, 1], [0, 2, 51], [0, 0, 54]]) expect(bounds.center.distanceTo({ x: corner[0], y: corner[1], z: corner[2] })).toBeLessThanOrEqual(bounds.radius + 1e-6);
  });
});
