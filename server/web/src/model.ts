/** What a model is made of, in plain data that recordings keep too. */
import { Causality } from './gen/mbcosim/v1/common_pb';
import type { ModelDescription } from './gen/mbcosim/v1/simulations_pb';

export type Kind = 'input' | 'output' | 'parameter' | 'state';

export interface VariableInfo {
  handle: number;
  name: string;
  size: number;
  unit: string;
  frame: string;
  kind: Kind;
  description: string;
  owner: string;
}

export interface Part {
  /** "joint:7", "node.structural:2": unique. */
  id: string;
  family: string;
  type: string;
  label: number;
  name: string;
}

export interface Model {
  title: string;
  digest: string;
  unknowns: number;
  initialTime: number;
  finalTime: number;
  step: number;
  nodes: Part[];
  elements: Part[];
  variables: VariableInfo[];
}

const KINDS: Record<number, Kind> = {
  [Causality.INPUT]: 'input',
  [Causality.PARAMETER]: 'parameter',
  [Causality.STATE]: 'state',
};

export function modelOf(description: ModelDescription): Model {
  return {
    title: description.title,
    digest: description.modelDigest,
    unknowns: description.unknowns,
    initialTime: description.initialTime,
    finalTime: description.finalTime,
    step: description.stepSize,
    nodes: description.nodes.map((node) => ({
      id: `node.${node.family}:${node.label}`,
      family: node.family,
      type: node.kind,
      label: node.label,
      name: node.name,
    })),
    elements: description.elements.map((element) => ({
      id: `${element.family}:${element.label}`,
      family: element.family,
      type: element.type,
      label: element.label,
      name: element.name,
    })),
    variables: description.variables.map((variable) => ({
      handle: variable.handle,
      name: variable.name,
      size: variable.size,
      unit: variable.unit,
      frame: variable.frame,
      kind: KINDS[variable.causality] ?? 'output',
      description: variable.description,
      owner: variable.owner,
    })),
  };
}

/** "joint:7" of "joint.7.Fx", "node.structural:2" of "node.structural.2.X"; empty: of the model. */
export function partOf(variable: string): string {
  const words = variable.split('.');
  const label = words.findIndex((word, i) => i > 0 && /^-?\d+$/.test(word));
  return label < 0 ? '' : `${words.slice(0, label).join('.')}:${words[label]}`;
}

/** "Fx" of "joint.7.Fx". */
export function shortName(variable: string): string {
  const words = variable.split('.');
  const label = words.findIndex((word, i) => i > 0 && /^-?\d+$/.test(word));
  return label < 0 ? variable : words.slice(label + 1).join('.');
}

/** Variables by the part that they belong to. */
export function variablesByPart(variables: readonly VariableInfo[]): Map<string, VariableInfo[]> {
  const found = new Map<string, VariableInfo[]>();
  for (const variable of variables) {
    const part = partOf(variable.name);
    const list = found.get(part);
    if (list) list.push(variable);
    else found.set(part, [variable]);
  }
  return found;
}

/** Title of a part as the tree shows it. */
export function partTitle(part: Part): string {
  const kind = part.id.startsWith('node.') ? `${part.type || part.family} node` : part.type || part.family;
  return `${kind} ${part.label}${part.name ? ` · ${part.name}` : ''}`;
}

/** Whether every word of `query` is found in `text`, upper and lower case alike. */
export function matches(text: string, query: string): boolean {
  const lower = text.toLowerCase();
  return query.toLowerCase().split(/\s+/).every((word) => lower.includes(word));
}
