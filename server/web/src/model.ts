/** What a model is made of, in plain data that recordings keep too. */
import { Causality } from './gen/mbcosim/v1/common_pb';
import type { DeckCard } from './gen/mbcosim/v1/geometry_pb';
import type { ModelDescription, SymbolValue } from './gen/mbcosim/v1/simulations_pb';

export type Kind = 'input' | 'output' | 'parameter' | 'state';

export interface VariableInfo {
  handle: number;
  name: string;
  size: number;
  /** "mm"; where the deck's units are not declared the quantity: "length". */
  unit: string;
  frame: string;
  kind: Kind;
  description: string;
  owner: string;
}

/** A card of the deck, as its author wrote it. */
export interface Card {
  /** "pendulum.mbd:12:3". */
  place: string;
  text: string;
  /** The deck's card is longer than that. */
  cut: boolean;
}

export interface Part {
  /** "joint:7", "node.structural:2": unique. */
  id: string;
  family: string;
  type: string;
  label: number;
  name: string;
  card?: Card;
}

/** A variable of the deck (`set` cards). */
export interface Parameter {
  name: string;
  /** "0.5", "true", "\"text\"". */
  value: string;
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
  parameters: Parameter[];
  /** The deck's units are declared: `unit` may stand behind a number. */
  unitsDeclared?: boolean;
}

const KINDS: Record<number, Kind> = {
  [Causality.INPUT]: 'input',
  [Causality.PARAMETER]: 'parameter',
  [Causality.STATE]: 'state',
};

/** `cards`: by the identifiers of their parts. */
export function modelOf(description: ModelDescription, cards: ReadonlyMap<string, Card>): Model {
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
      card: cards.get(`node.${node.family}:${node.label}`),
    })),
    elements: description.elements.map((element) => ({
      id: `${element.family}:${element.label}`,
      family: element.family,
      type: element.type,
      label: element.label,
      name: element.name,
      card: cards.get(`${element.family}:${element.label}`),
    })),
    variables: description.variables.map((variable) => ({
      handle: variable.handle,
      name: variable.name,
      size: variable.size,
      unit: variable.unit.replaceAll('deck unit of ', ''),
      frame: variable.frame,
      kind: KINDS[variable.causality] ?? 'output',
      description: variable.description,
      owner: variable.owner,
    })),
    parameters: description.symbols.map(({ name, value }) => ({ name, value: written(value) })),
    unitsDeclared: description.units !== undefined,
  };
}

/** The part to which a card belongs, and the card as it is shown. */
export function cardOf(card: DeckCard): [string, Card] {
  const id = `${card.ofNode ? 'node.' : ''}${card.family}:${card.label}`;
  return [id, { place: `${card.file}:${card.line}:${card.column}`, text: evenly(card.text, card.column), cut: card.cut }];
}

function written(value: SymbolValue | undefined): string {
  if (value?.value.case === 'text') return JSON.stringify(value.value.value);
  return String(value?.value.value ?? '');
}

/** A card without the indentation that it has in its file: its first line begins at a column, from 1. */
export function evenly(text: string, column: number): string {
  const [first, ...rest] = text.split('\n');
  const blanks = rest.filter((line) => line.trim() !== '').map((line) => line.search(/\S/));
  const shift = Math.min(column - 1, ...blanks);
  return [first, ...rest.map((line) => line.slice(Math.min(shift, line.search(/\S|$/))))].join('\n');
}

/** The deck's variables that a card names, outside its comments and strings. */
export function namedIn(card: Card, parameters: readonly Parameter[]): Parameter[] {
  const code = card.text.replace(/"(?:[^"\\]|\\.)*"|\/\*[\s\S]*?(?:\*\/|$)|#.*/g, ' ');
  const words = new Set(code.match(/[A-Za-z_]\w*/g));
  return parameters.filter(({ name }) => words.has(name));
}

/** What has variables and is neither node nor element: drives. */
export function otherParts(model: Model): Part[] {
  const known = new Set([...model.nodes, ...model.elements].map(({ id }) => id));
  const others = [...variablesByPart(model.variables).keys()].filter((id) => id !== '' && !known.has(id));
  return others.map((id) => {
    const [family, label] = id.split(':');
    return { id, family, type: family === 'drive' ? 'drive caller' : family, label: Number(label), name: '' };
  });
}

/** The label in the name of a variable, with its dots. */
const LABEL = /\.(-?\d+)(?:\.|$)/;

/** "joint:7" of "joint.7.Fx", "node.structural:2" of "node.structural.2.X"; empty: of the model. */
export function partOf(variable: string): string {
  const label = LABEL.exec(variable);
  return label ? `${variable.slice(0, label.index)}:${label[1]}` : '';
}

/** "Fx" of "joint.7.Fx". */
export function shortName(variable: string): string {
  const label = LABEL.exec(variable);
  return label ? variable.slice(label.index + label[0].length) : variable;
}

/** Of models that were asked about: a large one has a hundred thousand variables. */
const grouped = new WeakMap<readonly VariableInfo[], Map<string, VariableInfo[]>>();

/** Variables by the part that they belong to. */
export function variablesByPart(variables: readonly VariableInfo[]): ReadonlyMap<string, VariableInfo[]> {
  const found = grouped.get(variables) ?? new Map<string, VariableInfo[]>();
  if (grouped.has(variables)) return found;
  grouped.set(variables, found);
  for (const variable of variables) {
    const part = partOf(variable.name);
    const list = found.get(part);
    if (list) list.push(variable);
    else found.set(part, [variable]);
  }
  return found;
}

export function variableNamed(variables: readonly VariableInfo[], name: string): VariableInfo | undefined {
  return variablesByPart(variables).get(partOf(name))?.find((variable) => variable.name === name);
}

/** Title of a part as the tree shows it. */
export function partTitle(part: Part): string {
  const kind = part.id.startsWith('node.') ? `${part.type || part.family} node` : part.type || part.family;
  return `${kind} ${part.label}${part.name ? ` · ${part.name}` : ''}`;
}

/** Whether every word of `query` is found in `text`, upper and lower case alike. */
export function matches(text: string, query: string): boolean {
  return finder(query)(text);
}

/** The same for many texts. */
export function finder(query: string): (text: string) => boolean {
  const words = query.toLowerCase().split(/\s+/);
  return (text) => {
    const lower = text.toLowerCase();
    return words.every((word) => lower.includes(word));
  };
}
