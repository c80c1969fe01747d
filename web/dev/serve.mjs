// For work on the page: serves web/dist, passes the WebSocket on to a running twin, and hands out meshes.
//   node dev/serve.mjs [--port 8790] [--twin 8700] [--robots ../robots]
import { createServer, request } from 'node:http';
import { createReadStream, existsSync, realpathSync, statSync } from 'node:fs';
import { dirname, extname, join, resolve, sep } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const option = (name, otherwise) => {
  const at = process.argv.indexOf(`--${name}`);
  return at < 0 ? otherwise : process.argv[at + 1];
};
const port = Number(option('port', 8790));
const twin = Number(option('twin', 8700));
const robots = resolve(option('robots', join(here, '../../robots')));
const dist = join(here, '../dist');
// As the program sends it.
const POLICY = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self' ws: wss: blob:; font-src 'self'; base-uri 'none'; form-action 'none'";
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css' };

function inside(root, path) {
  if (!existsSync(path)) return null;
  const real = realpathSync(path);
  return real.startsWith(realpathSync(root) + sep) && statSync(real).isFile() ? real : null;
}

function assetPath(uri) {
  const package_ = /^package:\/\/([^/]+)\/(.*)$/.exec(uri);
  if (package_) return inside(robots, join(robots, package_[1].replace(/_description$/, ''), package_[2])) ?? inside(robots, join(robots, package_[1], package_[2]));
  const file = /^file:\/\/(.*)$/.exec(uri);
  return inside(robots, file ? file[1] : resolve(robots, uri));
}

const server = createServer((req, res) => {
  const url = new URL(req.url, 'http://localhost');
  const path = url.pathname === '/dev-asset' ? assetPath(url.searchParams.get('uri') ?? '')
    : inside(dist, join(dist, url.pathname === '/' ? 'index.html' : url.pathname));
  if (!path) {
    res.writeHead(404).end('not found');
    return;
  }
  res.writeHead(200, { 'content-type': TYPES[extname(path)] ?? 'application/octet-stream', 'cache-control': 'no-store', 'content-security-policy': POLICY });
  createReadStream(path).pipe(res);
});
server.on('upgrade', (req, socket, head) => {
  const out = request({ host: '127.0.0.1', port: twin, path: req.url, headers: { ...req.headers, host: `127.0.0.1:${twin}`, origin: `http://127.0.0.1:${twin}` } });
  const fail = () => socket.destroy();
  out.on('error', fail);
  out.on('response', fail);
  out.on('upgrade', (answer, upstream, rest) => {
    const lines = Object.entries(answer.headers).map(([name, value]) => `${name}: ${value}`);
    socket.write(`HTTP/1.1 101 Switching Protocols\r\n${lines.join('\r\n')}\r\n\r\n`);
    upstream.write(head);
    socket.write(rest);
    upstream.pipe(socket).pipe(upstream);
    upstream.on('error', fail);
    socket.on('error', () => upstream.destroy());
  });
  out.end();
});
server.listen(port, '127.0.0.1', () => console.log(`http://127.0.0.1:${port} -> twin at ${twin}, meshes of ${robots}`));
