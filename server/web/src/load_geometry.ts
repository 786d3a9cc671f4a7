/** The shape of a model as far as its variables tell it: the nodes. */
import { simulations } from './api';
import { mat3, vec3 } from './algebra';
import { finish, type Geometry, type NodeShape } from './geometry';
import type { Model } from './model';

export async function loadGeometry(simulation: string, model: Model): Promise<Geometry> {
  const handles = new Map(model.variables.map((variable) => [variable.name, variable.handle]));
  const nodes = model.nodes.filter((node) => node.family === 'structural').map((node): NodeShape => ({
    label: node.label,
    kind: node.type,
    name: node.name,
    position: [0, 0, 0],
    positionHandle: handles.get(`node.structural.${node.label}.X`) ?? -1,
    orientationHandle: handles.get(`node.structural.${node.label}.R`),
  }));
  const oriented = nodes.filter((node) => node.orientationHandle !== undefined);
  const { values } = await simulations.readVariables({
    simulation,
    handles: [...nodes.map((node) => node.positionHandle), ...oriented.map((node) => node.orientationHandle as number)],
  });
  nodes.forEach((node, i) => (node.position = vec3(values, 3 * i)));
  oriented.forEach((node, i) => (node.orientation = mat3(values, 3 * nodes.length + 9 * i)));
  return finish(nodes, [], []);
}
