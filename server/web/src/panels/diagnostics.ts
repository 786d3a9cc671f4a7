/** What is wrong with a deck, beside its text, with a mark at the place. */
import { h } from '../dom';
import { Severity, type Diagnostic } from '../gen/mbcosim/v1/common_pb';
import type { NamedFile } from '../upload';

const NAMES: Record<number, string> = { [Severity.ERROR]: 'error', [Severity.WARNING]: 'warning', [Severity.NOTE]: 'note' };
/** Lines of the deck before and after the one that is meant. */
const AROUND = 3;

/** A line cut at bytes `column` to `column + length` (columns count bytes of UTF-8, from 1). */
export function marked(line: string, column: number, length: number): [string, string, string] {
  const bytes = new TextEncoder().encode(line);
  const from = Math.min(Math.max(column - 1, 0), bytes.length), to = Math.min(from + Math.max(length, 1), bytes.length);
  const text = (start: number, end: number) => new TextDecoder().decode(bytes.subarray(start, end));
  return [text(0, from), text(from, to), text(to, bytes.length)];
}

/** Lines around line `line` (from 1), with their numbers. */
export function linesAround(lines: readonly string[], line: number): { before: [number, string][]; after: [number, string][] } {
  const numbered = (from: number, to: number) => lines.slice(from, to).map((words, i): [number, string] => [from + i + 1, words]);
  return { before: numbered(Math.max(line - 1 - AROUND, 0), line - 1), after: numbered(line, line + AROUND) };
}

/** `files`: those of the deck, where the page has them. */
export function diagnosticsList(diagnostics: readonly Diagnostic[], files: readonly NamedFile[] = []): HTMLElement {
  const texts = new Map(files.map(({ path, data }) => [path, data])), split = new Map<string, string[]>();
  const linesOf = (file: string): string[] => {
    const lines = split.get(file) ?? new TextDecoder().decode(texts.get(file)).split(/\r?\n/);
    split.set(file, lines);
    return lines;
  };
  return h('div', { class: 'diagnostics' }, ...diagnostics.map((diagnostic) => {
    const name = NAMES[diagnostic.severity] ?? 'note';
    const { file, line = 0, column = 0 } = diagnostic;
    return h('article', { class: `diagnostic ${name}` },
      h('div', {}, h('strong', {}, line > 0 ? `${file}:${line}:${column}: ` : ''), `${name}: ${diagnostic.message}`),
      diagnostic.sourceLine ? deckText(diagnostic, line, column, texts.has(file) ? linesOf(file) : []) : null,
      diagnostic.hint ? h('p', {}, h('em', {}, 'hint: '), diagnostic.hint) : null,
      ...diagnostic.trail.map((step) => h('p', { class: 'soft' }, step)));
  }));
}

function deckText(diagnostic: Diagnostic, line: number, column: number, lines: readonly string[]): HTMLElement {
  const [before, at, after] = marked(diagnostic.sourceLine, column, diagnostic.length);
  const around = linesAround(lines, line);
  const row = (number: number, ...words: (Node | string)[]) => h('div', { class: 'line' }, h('span', { class: 'soft', 'aria-hidden': 'true' }, String(number)), h('code', {}, ...words));
  return h('pre', { tabindex: 0, 'aria-label': `Line ${line} of ${diagnostic.file}` },
    ...around.before.map(([number, words]) => row(number, words)),
    row(line, before, h('mark', {}, at), after),
    ...around.after.map(([number, words]) => row(number, words)));
}
