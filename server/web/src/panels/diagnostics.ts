/** What is wrong with a deck, with the lines and a mark at the place. */
import { h } from '../dom';
import { Severity, type Diagnostic } from '../gen/mbcosim/v1/common_pb';

const NAMES: Record<number, string> = { [Severity.ERROR]: 'error', [Severity.WARNING]: 'warning', [Severity.NOTE]: 'note' };

/** A line cut at bytes `column` to `column + length` (columns count bytes of UTF-8, from 1). */
export function marked(line: string, column: number, length: number): [string, string, string] {
  const bytes = new TextEncoder().encode(line);
  const from = Math.min(Math.max(column - 1, 0), bytes.length), to = Math.min(from + Math.max(length, 1), bytes.length);
  const text = (start: number, end: number) => new TextDecoder().decode(bytes.subarray(start, end));
  return [text(0, from), text(from, to), text(to, bytes.length)];
}

export function diagnosticsList(diagnostics: readonly Diagnostic[]): HTMLElement {
  return h('div', { class: 'diagnostics' }, ...diagnostics.map((diagnostic) => {
    const name = NAMES[diagnostic.severity] ?? 'note';
    const place = diagnostic.line ? `${diagnostic.file}:${diagnostic.line}:${diagnostic.column ?? 1}: ` : '';
    const [before, at, after] = marked(diagnostic.sourceLine, diagnostic.column ?? 1, diagnostic.length);
    return h('article', { class: `diagnostic ${name}` },
      h('div', {}, h('strong', {}, place), `${name}: ${diagnostic.message}`),
      diagnostic.sourceLine ? h('pre', { tabindex: 0 }, before, h('mark', {}, at), after) : null,
      diagnostic.hint ? h('p', {}, h('em', {}, 'hint: '), diagnostic.hint) : null,
      ...diagnostic.trail.map((step) => h('p', { class: 'soft' }, step)));
  }));
}
