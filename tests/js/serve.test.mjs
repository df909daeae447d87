// The local server: whom it answers, and with which headers.
import { mkdir, mkdtemp, rm, writeFile } from 'node:fs/promises';
import { request } from 'node:http';
import { connect } from 'node:net';
import { networkInterfaces, tmpdir } from 'node:os';
import { join } from 'node:path';
import { afterAll, beforeAll, describe, expect, test } from 'vitest';
import { serve } from '../../scripts/serve.mjs';

const POLICY = "default-src 'none'";

let folder = '';
let server;
let port = 0;

beforeAll(async () => {
  folder = await mkdtemp(join(tmpdir(), 'vesicle-serve-'));
  for (const name of ['site', 'site-2']) await mkdir(join(folder, name));
  await writeFile(join(folder, 'site/page.html'), 'a page');
  for (const name of ['secret.txt', 'site-2/secret.txt']) await writeFile(join(folder, name), 'a secret');
  server = await serve(join(folder, 'site'), 0, (file) => `${POLICY}; report-to ${file}`);
  port = Number(new URL(server.address).port);
});
afterAll(async () => {
  await server.close();
  await rm(folder, { recursive: true });
});

/** Sends a request, with a name of its own for the server; resolves to the status, headers and body of the answer. */
function ask(path, { method = 'GET', ...headers } = {}) {
  return new Promise((resolve, reject) => {
    const sent = request(
      { host: '127.0.0.1', port, path, method, headers, setHost: !('Host' in headers) },
      (answer) => {
        let body = '';
        answer.on('data', (part) => (body += part));
        answer.on('end', () => resolve({ status: answer.statusCode, headers: answer.headers, body }));
      },
    );
    sent.on('error', reject).end();
  });
}

/** Resolves to whether anything accepts connections at an address of this machine. */
const accepts = (host) =>
  new Promise((resolve) => {
    const socket = connect({ host, port }, () => resolve(true));
    socket.on('error', () => resolve(false)).on('connect', () => socket.destroy());
  });

test('only the loopback interface is served', async () => {
  const all = Object.values(networkInterfaces()).flat();
  const others = all.map(({ address, scopeid }) => (scopeid ? `${address}%${scopeid}` : address));
  expect(server.address).toBe(`http://127.0.0.1:${port}/`);
  expect(await accepts('127.0.0.1')).toBe(true);
  for (const address of ['::1', ...others.filter((one) => one !== '127.0.0.1')])
    expect([address, await accepts(address)]).toEqual([address, false]);
});

describe('names of the server in requests', () => {
  test.each(['localhost', 'LOCALHOST:1', '127.0.0.1', '127.0.0.1:80', '[::1]:5173'])('%s is its own', async (Host) => {
    expect(await ask('/page.html', { Host })).toMatchObject({ status: 200, body: 'a page' });
  });

  test.each([
    'evil.example',
    'localhost.evil.example:5173',
    'evil.example:localhost',
    '127.0.0.1.evil.example',
    '127.0.0.2',
    'localhost:',
    '',
  ])('%j is refused', async (Host) => {
    const { status, headers, body } = await ask('/page.html', { Host });
    expect([status, body]).toEqual([421, 'Misdirected Request\n']);
    expect(headers['x-content-type-options']).toBe('nosniff');
  });
});

test.each(['POST', 'PUT', 'DELETE', 'OPTIONS', 'PATCH'])('%s is not answered', async (method) => {
  const { status, headers, body } = await ask('/page.html', { method });
  expect([status, headers.allow, body]).toEqual([405, 'GET, HEAD', 'Method Not Allowed\n']);
});

test('each answer has the headers, with a policy where there is a file', async () => {
  const { headers } = await ask('/page.html');
  const again = { 'If-None-Match': headers.etag };
  const answers = [
    await ask('/page.html'),
    await ask('/page.html', { method: 'HEAD' }),
    await ask('/page.html', again),
  ];
  expect(answers.map(({ status }) => status)).toEqual([200, 200, 304]);
  for (const { headers } of answers) expect(headers['content-security-policy']).toBe(`${POLICY}; report-to page.html`);
  const none = await ask('/none.html');
  expect([none.status, none.headers['content-security-policy']]).toEqual([404, undefined]);
  for (const { headers } of [...answers, none])
    expect(headers).toMatchObject({
      'x-content-type-options': 'nosniff',
      'referrer-policy': 'no-referrer',
      'cross-origin-opener-policy': 'same-origin',
    });
});

test.each([
  '/../secret.txt',
  '/..%2fsecret.txt',
  '/%2e%2e%2fsecret.txt',
  '/..%2fsite-2/secret.txt',
  '//evil.example/..%2fsecret.txt',
  '/%00',
])('nothing outside of the folder is served: %s', async (path) => {
  expect(await ask(path)).toMatchObject({ status: 404, body: 'Not Found\n' });
});
