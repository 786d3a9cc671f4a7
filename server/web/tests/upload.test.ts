import { describe, expect, test } from 'vitest';
import { chunks, mainFiles, withoutCommonFolder } from '../src/upload';

const file = (path: string, text = '') => ({ path, data: new TextEncoder().encode(text) });

describe('a deck from the disk', () => {
  test('is sent in pieces of a mebibyte, an empty file in one', () => {
    const pieces = chunks([{ path: 'big', data: new Uint8Array((1 << 20) + 5) }, file('empty')]);
    expect(pieces.map(({ path, data }) => [path, data.length])).toEqual([['big', 1 << 20], ['big', 5], ['empty', 0]]);
  });

  test('has as main file the one with a data card', () => {
    expect(mainFiles([file('a.inc', 'set: real L = 1.;'), file('b.mbd', '# deck\n Begin : data ;\n'), file('c.fem', 'begin data')])).toEqual(['b.mbd']);
  });

  test('has as main file the one that nobody includes, wherever the data card is', () => {
    const files = [file('m/beam.inc', 'begin: data;'), file('m/load.mbd', 'set: real F = 1.;\n  include: "./parts/../beam.inc";'), file('m/parts/notes.txt', 'include: "load.mbd"')];
    expect(mainFiles(files)).toEqual(['m/load.mbd']);
    expect(mainFiles([...files, file('m/other.mbd', 'include: "beam.inc";')])).toEqual(['m/load.mbd', 'm/other.mbd']);
    expect(mainFiles([file('a', 'begin: data;\ninclude: "a";')])).toEqual(['a']);
  });

  test('has as main file one that is called a deck where no data card is found', () => {
    expect(mainFiles([file('typo.mbd', 'begin data;'), file('notes.txt')])).toEqual(['typo.mbd']);
    expect(mainFiles([file('load.MBD', 'include: "part.mbd";'), file('part.mbd', 'set: real L = 1.;')])).toEqual(['load.MBD']);
    expect(mainFiles([file('notes.txt', 'begin data;')])).toEqual([]);
  });

  test('is named without the folder that all files are in', () => {
    const paths = (...names: string[]) => withoutCommonFolder(names.map((name) => file(name))).map(({ path }) => path);
    expect(paths('m/a.mbd', 'm/sub/b.inc')).toEqual(['a.mbd', 'sub/b.inc']);
    expect(paths('m/sub1/a', 'm/sub2/b')).toEqual(['sub1/a', 'sub2/b']);
    expect(paths('a', 'm/b')).toEqual(['a', 'm/b']);
    expect(paths('only/one')).toEqual(['one']);
  });
});
