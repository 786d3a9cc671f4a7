/** Questions about a simulation whose answers come wrapped or in pages. */
import { create } from '@bufbuild/protobuf';
import type { CallOptions } from '@connectrpc/connect';
import { simulations } from './api';
import {
  ComputeEigenvaluesReplySchema, MatrixSchema, ModelDescriptionSchema,
  type ComputeEigenvaluesReply, type Matrix, type ModelDescription, type SimulationInfo,
} from './gen/mbcosim/v1/simulations_pb';

/** What a reply must have. */
export function told<T>(part: T | undefined): T {
  if (part === undefined) throw new Error('the server left out a part of its reply');
  return part;
}

export async function look(simulation: string, options?: CallOptions): Promise<SimulationInfo> {
  return told((await simulations.getSimulation({ simulation }, options)).simulation);
}

/** Every page of an answer. */
async function* pages<Page extends { nextPageToken: string }>(ask: (pageToken: string) => Promise<Page>): AsyncGenerator<Page> {
  let token = '';
  do {
    const page = await ask(token);
    yield page;
    token = page.nextPageToken;
  } while (token !== '');
}

/** All simulations that the reader may see, in the order of creation. */
export async function listSimulations(): Promise<SimulationInfo[]> {
  const all: SimulationInfo[] = [];
  for await (const page of pages((pageToken) => simulations.listSimulations({ pageSize: 1000, pageToken }))) all.push(...page.simulations);
  return all;
}

export async function describe(simulation: string): Promise<ModelDescription> {
  const whole = create(ModelDescriptionSchema);
  for await (const { model } of pages((pageToken) => simulations.describeSimulation({ simulation, pageToken }))) {
    const { nodes, elements, variables, ports, symbols, ...rest } = told(model);
    Object.assign(whole, rest);
    whole.nodes.push(...nodes);
    whole.elements.push(...elements);
    whole.variables.push(...variables);
    whole.ports.push(...ports);
    whole.symbols.push(...symbols);
  }
  return whole;
}

/** Names of the unknowns, in their order. */
export async function stateNames(simulation: string): Promise<string[]> {
  const names: string[] = [];
  for await (const page of pages((pageToken) => simulations.linearize({ simulation, descriptorForm: true, pageToken }))) names.push(...page.stateNames);
  return names;
}

function append(part: Matrix | undefined, whole: Matrix | undefined): Matrix | undefined {
  if (part === undefined) return whole;
  const joined = whole ?? create(MatrixSchema, { rows: part.rows, columns: part.columns, sparse: part.sparse });
  joined.values = joined.values.concat(part.values);
  return joined;
}

/** Eigenvalues and eigenvectors about the present state: `count` of them, nearest to a frequency. */
export async function eigenvectors(simulation: string, count: number, shift: number): Promise<ComputeEigenvaluesReply> {
  const whole = create(ComputeEigenvaluesReplySchema);
  const ask = (pageToken: string) => simulations.computeEigenvalues({ simulation, count, shift, eigenvectors: true, pageToken });
  for await (const page of pages(ask)) {
    whole.step = page.step;
    whole.real.push(...page.real);
    whole.imaginary.push(...page.imaginary);
    whole.vectorsReal = append(page.vectorsReal, whole.vectorsReal);
    whole.vectorsImaginary = append(page.vectorsImaginary, whole.vectorsImaginary);
  }
  return whole;
}
