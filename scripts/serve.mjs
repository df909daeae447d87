// A small static server for the files of one folder.
import { createReadStream } from 'node:fs';
import { stat } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, normalize, sep } from 'node:path';

const TYPES = {
  '.html': 'text/html; charset=utf-8',
  '.js': 'text/javascript; charset=utf-8',
  '.mjs': 'text/javascript; charset=utf-8',
  '.css': 'text/css; charset=utf-8',
  '.json': 'application/json',
  '.txt': 'text/plain; charset=utf-8',
  '.svg': 'image/svg+xml',
  '.png': 'image/png',
  '.ico': 'image/x-icon',
  '.wasm': 'application/wasm',
};

// `.gz` files are data: they are sent as stored, without a Content-Encoding.
const typeOf = (path) => TYPES[extname(path)] ?? 'application/octet-stream';

/** Returns the path of the file at an address, or undefined if there is none inside the folder. */
async function resolve(folder, address) {
  const { pathname } = new URL(address, 'http://localhost');
  const path = normalize(join(folder, decodeURIComponent(pathname)));
  if (path !== folder && !path.startsWith(folder + sep)) return undefined;
  const found = await stat(path).catch(() => undefined);
  if (found?.isFile()) return path;
  return found?.isDirectory() ? resolve(folder, `${pathname.replace(/\/$/, '')}/index.html`) : undefined;
}

// The build puts a content hash into these names, so cached files never become outdated.
const isHashed = (path) => /[\\/]assets[\\/][^\\/]+-[\w-]{8}\.\w+$/.test(path);

/** Returns the headers for caching: how long a browser may keep a file, and the tag by which it revalidates it. */
async function freshness(path) {
  const { mtimeMs, size } = await stat(path);
  const keep = isHashed(path) ? 'max-age=31536000, immutable' : 'no-cache';
  return { 'Cache-Control': keep, ETag: `"${size.toString(36)}-${Math.round(mtimeMs).toString(36)}"` };
}

async function answer(folder, request, response) {
  const path = await resolve(folder, request.url).catch(() => undefined);
  if (!path) return response.writeHead(404, { 'Content-Type': 'text/plain' }).end('not found\n');
  const headers = await freshness(path);
  if (request.headers['if-none-match'] === headers.ETag) return response.writeHead(304, headers).end();
  response.writeHead(200, { 'Content-Type': typeOf(path), ...headers });
  if (request.method === 'HEAD') return response.end();
  createReadStream(path)
    .on('error', () => response.destroy())
    .pipe(response);
}

/**
 * Serves a folder on a port (0 = any free one). Resolves to `{ address, close }` once it listens; rejects when the
 * port is taken.
 */
export function serve(folder, port = 0) {
  const server = createServer((request, response) => answer(normalize(folder), request, response));
  return new Promise((resolve, reject) => {
    server.once('error', reject);
    server.listen(port, () => {
      const close = () => new Promise((done) => server.close(done) && server.closeAllConnections());
      resolve({ address: `http://localhost:${server.address().port}/`, close });
    });
  });
}
