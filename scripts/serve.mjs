// A small static server for the files of one folder, for this machine alone.
import { createReadStream } from 'node:fs';
import { stat } from 'node:fs/promises';
import { createServer, STATUS_CODES } from 'node:http';
import { extname, join, normalize, relative, sep } from 'node:path';
import { policyOf } from './policy.mjs';

/** The only interface that the server listens on. */
const HOST = '127.0.0.1';

/**
 * Names of this machine in a request. If another server's name is pointed at this machine (DNS rebinding), its pages
 * send that name.
 */
const OWN_NAME = /^(localhost|127\.0\.0\.1|\[::1\])(:\d+)?$/i;

/** Sent with every response. */
const SAFETY = {
  'X-Content-Type-Options': 'nosniff',
  'Referrer-Policy': 'no-referrer',
  'Cross-Origin-Opener-Policy': 'same-origin',
};

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

/** Returns the status and headers that refuse a request; undefined if it is to be answered. */
function refusal({ method, headers }) {
  if (!OWN_NAME.test(headers.host ?? '')) return [421, {}];
  return method === 'GET' || method === 'HEAD' ? undefined : [405, { Allow: 'GET, HEAD' }];
}

const refuse = (response, status, headers = {}) =>
  response.writeHead(status, { 'Content-Type': 'text/plain', ...headers }).end(`${STATUS_CODES[status]}\n`);

async function answer(folder, request, response, policyFor) {
  for (const [name, value] of Object.entries(SAFETY)) response.setHeader(name, value);
  const refused = refusal(request);
  if (refused) return refuse(response, ...refused);
  const path = await resolve(folder, request.url).catch(() => undefined);
  if (!path) return refuse(response, 404);
  const policy = policyFor(relative(folder, path).replaceAll(sep, '/'));
  if (policy) response.setHeader('Content-Security-Policy', policy);
  const headers = await freshness(path);
  if (request.headers['if-none-match'] === headers.ETag) return response.writeHead(304, headers).end();
  response.writeHead(200, { 'Content-Type': typeOf(path), ...headers });
  if (request.method === 'HEAD') return response.end();
  createReadStream(path)
    .on('error', () => response.destroy())
    .pipe(response);
}

/**
 * Serves a folder to this machine on a port (0 = any free one). Resolves to `{ address, close }` once it listens;
 * rejects when the port is taken. `policyFor` returns the content security policy of a file, if it has one.
 */
export function serve(folder, port = 0, policyFor = () => undefined) {
  const server = createServer((request, response) => answer(normalize(folder), request, response, policyFor));
  return new Promise((resolve, reject) => {
    server.once('error', reject);
    server.listen(port, HOST, () => {
      const close = () => new Promise((done) => server.close(done) && server.closeAllConnections());
      resolve({ address: `http://${HOST}:${server.address().port}/`, close });
    });
  });
}

/** Serves a folder with the built app, under its policies. */
export const serveApp = (folder, port = 0) => serve(folder, port, policyOf);
