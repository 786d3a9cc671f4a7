/** Decks from the reader's disk. */

export interface NamedFile {
  /** Relative to what was dropped, with `/`. */
  path: string;
  data: Uint8Array;
}

const CHUNK_BYTES = 1 << 20;

/** Files in pieces of at most 1 MiB, those of a file one after the other. */
export function chunks(files: readonly NamedFile[]): NamedFile[] {
  return files.flatMap(({ path, data }) => {
    const count = Math.max(1, Math.ceil(data.length / CHUNK_BYTES));
    return Array.from({ length: count }, (_, i) => ({ path, data: data.subarray(i * CHUNK_BYTES, (i + 1) * CHUNK_BYTES) }));
  });
}

/**
 * Files that can be a deck's main file: they have a `begin: data;` card, or include a file that leads to one, and none of the others includes
 * them. Where there is none, decks by their names: the daemon tells what is wrong with them.
 */
export function mainFiles(files: readonly NamedFile[]): string[] {
  const decoder = new TextDecoder();
  const texts = new Map(files.map(({ path, data }) => [path, decoder.decode(data)]));
  const includes = new Map([...texts].map(([path, text]) => [path, included(path, text).filter((other) => texts.has(other))]));
  const leads = (path: string, seen: Set<string>): boolean => {
    if (seen.has(path)) return false;
    seen.add(path);
    return /^\s*begin\s*:\s*data\s*;/im.test(texts.get(path) ?? '') || (includes.get(path) ?? []).some((other) => leads(other, seen));
  };
  const inside = new Set([...includes].flatMap(([path, others]) => others.filter((other) => other !== path)));
  const outer = files.map(({ path }) => path).filter((path) => !inside.has(path)), found = outer.filter((path) => leads(path, new Set()));
  return found.length > 0 ? found : outer.filter((path) => /\.mbd$/i.test(path));
}

/** Paths of the files that a deck's `include` cards name, which are relative to its own folder. */
function included(path: string, text: string): string[] {
  const folder = path.split('/').slice(0, -1);
  return [...text.matchAll(/^\s*include\s*:\s*"([^"]+)"/gim)].map(([, name]) => {
    const parts = [...folder];
    for (const part of name.split('/')) {
      if (part === '..') parts.pop();
      else if (part !== '.') parts.push(part);
    }
    return parts.join('/');
  });
}

/** The folder that all paths share is left out of them. */
export function withoutCommonFolder(files: readonly NamedFile[]): NamedFile[] {
  const [first, ...rest] = files.map(({ path }) => path.slice(0, path.lastIndexOf('/') + 1));
  const common = rest.reduce((shared, folder) => {
    let length = 0;
    for (let at = 0; at < Math.min(shared.length, folder.length) && shared[at] === folder[at]; ++at) if (shared[at] === '/') length = at + 1;
    return shared.slice(0, length);
  }, first ?? '');
  return files.map(({ path, data }) => ({ path: path.slice(common.length), data }));
}

/** What was dropped, folders with all that is in them. */
export async function droppedFiles(transfer: DataTransfer): Promise<NamedFile[]> {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry()).filter((entry): entry is FileSystemEntry => entry !== null);
  const lists = await Promise.all(entries.map((entry) => filesOf(entry, '')));
  return withoutCommonFolder(lists.flat());
}

export async function chosenFiles(list: FileList): Promise<NamedFile[]> {
  return withoutCommonFolder(await Promise.all([...list].map(async (file) => ({
    path: file.webkitRelativePath || file.name,
    data: new Uint8Array(await file.arrayBuffer()),
  }))));
}

async function filesOf(entry: FileSystemEntry, folder: string): Promise<NamedFile[]> {
  const path = folder + entry.name;
  if (entry.isFile) {
    const file = await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
    return [{ path, data: new Uint8Array(await file.arrayBuffer()) }];
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  const found: NamedFile[] = [];
  for (;;) {  // a reader gives at most a hundred at once
    const batch = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (batch.length === 0) return found;
    for (const inside of batch) found.push(...(await filesOf(inside, `${path}/`)));
  }
}
