// Makes the page: one HTML document with program, style and pictures inside. usage: build.mjs OUTPUT
import { build } from 'esbuild';
import { createHash } from 'node:crypto';
import { readFile, writeFile } from 'node:fs/promises';
import { fileURLToPath } from 'node:url';

const here = fileURLToPath(new URL('.', import.meta.url));
const output = process.argv[2];
if (!output) {
  console.error('usage: build.mjs OUTPUT');
  process.exit(4);
}

async function bundled(entry, loader) {
  const result = await build({
    entryPoints: [`${here}/src/${entry}`],
    bundle: true,
    minify: true,
    write: false,
    format: 'iife',
    target: ['es2022'],
    charset: 'utf8',
    legalComments: 'none',
    loader,
  });
  return result.outputFiles[0].text;
}

const script = (await bundled('main.ts')).replaceAll('</script', '<\\/script');
const style = await bundled('style.css');
const hash = createHash('sha256').update(script).digest('base64');
// Nothing is fetched from anywhere but the daemon that served the page, whatever ends up in it.
const policy = [
  "default-src 'none'",
  `script-src 'sha256-${hash}'`,
  "style-src 'unsafe-inline'",
  "img-src data: blob:",
  "connect-src 'self' blob: data:",  // these hold parts of glTF files
  "base-uri 'none'",
  "form-action 'none'",
].join('; ');
const template = await readFile(`${here}/src/index.html`, 'utf8');
const page = template
  .replace('<!-- policy -->', () => `<meta http-equiv="Content-Security-Policy" content="${policy}">`)
  .replace('<!-- style -->', () => `<style>${style}</style>`)
  .replace('<!-- script -->', () => `<script>${script}</script>`);
await writeFile(output, page);
