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

/** Lines around line `line` (from 1) of a text, with their numbers. */
export function linesAround(text: string, line: number): { before: [number, string][]; after: [number, string][] } {
  const numbered = text.split(/\r?\n/).map((words, i): [number, string] => [i + 1, words]);
  return { before: numbered.slice(Math.max(line - 1 - AROUND, 0), line - 1), after: numbered.slice(line, line + AROUND) };
}

/** `files`: those of the deck, where the page has them. */
export function diagnosticsList(diagnostics: readonly Diagnostic[], files: readonly NamedFile[] = []): HTMLElement {
  const texts = new Map(files.map(({ path, data }) => [path, data]));
  return h('div', { class: 'diagnostics' }, ...diagnostics.map((diagnostic) => {
    const name = NAMES[diagnostic.severity] ?? 'note';
    const { file, line = 0, column = 0 } = diagnostic;
    return h('article', { class: `diagnostic ${name}` },
      h('div', {}, h('strong', {}, line > 0 ? `${file}:${line}:${column}: ` : ''), `${name}: ${diagnostic.message}`),
      diagnostic.sourceLine ? deckText(diagnostic, line, column, texts.get(file)) : null,
      diagnostic.hint ? h('p', {}, h('em', {}, 'hint: '), diagnostic.hint) : null,
      ...diagnostic.trail.map((step) => h('p', { class: 'soft' }, step)));
  }));
}

function deckText(diagnostic: Diagnostic, line: number, column: number, data: Uint8Array | undefined): HTMLElement {
  const [before, at, after] = marked(diagnostic.sourceLine, column, diagnostic.length);
  const around = data ? linesAround(new TextDecoder().decode(data), line) : { before: [], after: [] };
  const row = (number: number, ...words: (Node | string)[]) => h('div', { class: 'line' }, h('span', { class: 'soft', 'aria-hidden': 'true' }, String(number)), h('code', {}, ...words));
  return h('pre', { tabindex: 0, 'aria-label': `Line ${line} of ${diagnostic.file}` },
    ...around.before.map(([number, words]) => row(number, words)),
    row(line, before, h('mark', {}, at), after),
    ...around.after.map(([number, words]) => row(number, words)));
}
