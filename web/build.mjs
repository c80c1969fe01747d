// Bundles src/ into dist/: index.html, assets with the hash of their content in the name, each with a .gz beside.
import { build } from 'esbuild';
import { mkdirSync, readdirSync, readFileSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { join, relative } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';

const here = fileURLToPath(new URL('.', import.meta.url));
const dist = join(here, 'dist');
rmSync(dist, { recursive: true, force: true });
mkdirSync(dist, { recursive: true });
const made = await build({
  absWorkingDir: here,
  entryPoints: ['src/app/main.ts'],
  outdir: dist,
  entryNames: 'assets/[name]-[hash]',
  chunkNames: 'assets/[name]-[hash]',
  bundle: true,
  splitting: true,
  format: 'esm',
  target: ['chrome100', 'firefox100', 'safari15.4'],
  minify: true,
  metafile: true,
  legalComments: 'none',
  logLevel: 'warning',
});
const outputs = made.metafile.outputs;
const from = (source) => Object.entries(outputs).find(([, out]) => out.entryPoint === source)[0];
const href = (path) => relative(dist, join(here, path));
// What the first picture needs, asked for at once instead of one after another.
const firstSources = ['src/app/main.ts', 'src/app/page.ts'];
const start = new Set();
const take = (path) => {
  if (start.has(path)) return;
  start.add(path);
  for (const { path: used, kind } of outputs[path].imports) if (kind === 'import-statement') take(used);
};
for (const source of firstSources) take(from(source));
const script = from('src/app/main.ts');
const { cssBundle } = outputs[script];
// The entry's styles hold those of the parts that are loaded later, too; nothing links the others.
for (const path of Object.keys(outputs)) if (path.endsWith('.css') && path !== cssBundle) rmSync(join(here, path));
const tags = [...start].filter((path) => path !== script).map((path) => `<link rel="modulepreload" href="${href(path)}">`);
const html = readFileSync(join(here, 'src/index.html'), 'utf8')
  .replace('<!--STYLE-->', `<link rel="stylesheet" href="${href(cssBundle)}">\n${tags.join('\n')}`)
  .replace('<!--SCRIPT-->', `<script type="module" src="${href(script)}"></script>`);
writeFileSync(join(dist, 'index.html'), html);

let raw = 0;
let packed = 0;
let first = 0;
const startup = new Set([...[...start].map(href), href(cssBundle), 'index.html']);
for (const folder of [dist, join(dist, 'assets')]) {
  for (const name of readdirSync(folder)) {
    const path = join(folder, name);
    if (!statSync(path).isFile()) continue;
    const bytes = readFileSync(path);
    const gz = gzipSync(bytes, { level: 9 });
    writeFileSync(`${path}.gz`, gz);
    raw += bytes.length;
    packed += gz.length;
    if (startup.has(relative(dist, path))) first += gz.length;
  }
}
const kb = (n) => `${(n / 1024).toFixed(0)} KiB`;
console.log(`web/dist: ${kb(raw)}, compressed ${kb(packed)}, of which ${kb(first)} at the start`);
if (packed > 1024 * 1024) throw new Error('the page weighs more than 1 MiB compressed');
