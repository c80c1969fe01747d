// Bundles src/ into dist/: index.html and assets with the hash of their content in the name, each with a .gz file.
// --watch: repeats this whenever a source is saved.
import { build, context } from 'esbuild';
import { mkdirSync, readdirSync, readFileSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { join, relative } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';

const here = fileURLToPath(new URL('.', import.meta.url));
const dist = join(here, 'dist');
const options = {
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
};
const href = (path) => relative(dist, join(here, path));
const kb = (n) => `${(n / 1024).toFixed(0)} KiB`;

function clear() {
  rmSync(dist, { recursive: true, force: true });
  mkdirSync(dist, { recursive: true });
}

// index.html with the files of the first picture, which are requested in parallel; returns their names.
function writePage({ outputs }) {
  const from = (source) => Object.entries(outputs).find(([, out]) => out.entryPoint === source)[0];
  const start = new Set();
  const take = (path) => {
    if (start.has(path)) return;
    start.add(path);
    for (const { path: used, kind } of outputs[path].imports) if (kind === 'import-statement') take(used);
  };
  for (const source of ['src/app/main.ts', 'src/app/page.ts']) take(from(source));
  const script = from('src/app/main.ts');
  const { cssBundle } = outputs[script];
  // The styles of the entry include those of the parts that are loaded later; nothing links the others.
  for (const path of Object.keys(outputs)) if (path.endsWith('.css') && path !== cssBundle) rmSync(join(here, path));
  const tags = [...start].filter((path) => path !== script).map((path) => `<link rel="modulepreload" href="${href(path)}">`);
  const html = readFileSync(join(here, 'src/index.html'), 'utf8')
    .replace('<!--STYLE-->', `<link rel="stylesheet" href="${href(cssBundle)}">\n${tags.join('\n')}`)
    .replace('<!--SCRIPT-->', `<script type="module" src="${href(script)}"></script>`);
  writeFileSync(join(dist, 'index.html'), html);
  return new Set([...[...start].map(href), href(cssBundle), 'index.html']);
}

// Writes the compressed form of each file.
function compress(startup) {
  let raw = 0;
  let packed = 0;
  let first = 0;
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
  console.log(`web/dist: ${kb(raw)}, compressed ${kb(packed)}, of which ${kb(first)} at the start`);
  if (packed > 1024 * 1024) throw new Error('the page weighs more than 1 MiB compressed');
}

if (process.argv.includes('--watch')) {
  const finish = {
    name: 'page',
    setup(made) {
      made.onStart(clear);
      made.onEnd(({ metafile, errors }) => errors.length === 0 && compress(writePage(metafile)));
    },
  };
  await (await context({ ...options, plugins: [finish] })).watch();
} else {
  clear();
  compress(writePage((await build(options)).metafile));
}
