// Stores of OME-Zarr images for tests: in memory, with faults, and behind a real server.
import { readFileSync } from 'node:fs';
import { createServer, type IncomingMessage, type ServerResponse } from 'node:http';
import type { AddressInfo } from 'node:net';
import { fileURLToPath } from 'node:url';
import { unzip } from 'unzipit';
import init, { Volume } from '../../pkg/index.js';

await init();

const data = (path: string) => fileURLToPath(new URL(`../../${path}`, import.meta.url));

/** The images of tests/data/zarr. */
export const IMAGES = [
  ...['v2-blosc-tczyx', 'v2-gzip-fortran'],
  ...['v3-zstd-zyx', 'v3-scaled-zyx', 'v3-blosc-xyz', 'v3-raw-float', 'v3-sharded-gzip', 'v3-sharded-zstd-yxzc'],
];

/** Returns an image as a ZIP. */
export function zipOf(image: string): Blob {
  return new Blob([readFileSync(data(`tests/data/zarr/${image}.zip`))]);
}

/** Returns the files of an image by their key. */
export async function filesOf(image: string): Promise<Map<string, Uint8Array>> {
  const { entries } = await unzip(new Uint8Array(await zipOf(image).arrayBuffer()));
  const files = Object.entries(entries).map(async ([name, entry]) => {
    return [`/${name}`, new Uint8Array(await entry.arrayBuffer())] as const;
  });
  return new Map(await Promise.all(files));
}

/** Size of level 0 of the images along x, y and z. */
export const DIMS = [26, 22, 14] as const;

/** Returns the voxels of the volume that the images were made of. */
export function sourceVoxels(): Float32Array {
  const volume = Volume.parse(new Uint8Array(readFileSync(data('www/public/data/ovule.nrrd'))));
  return volume.crop({ min: [40, 50, 8], max: [66, 72, 22] }).intensities();
}

type Key = `/${string}`;
type Range = { offset: number; length: number } | { suffixLength: number };

function cut(bytes: Uint8Array, range: Range): Uint8Array {
  if ('suffixLength' in range) return bytes.slice(-range.suffixLength);
  return bytes.slice(range.offset, range.offset + range.length);
}

/** A fault of a store: throws, or returns other bytes. */
export type Fault = (key: string, bytes: Uint8Array | undefined, request: number) => Promise<Uint8Array | undefined>;

/** A store in memory that counts its requests, those at the same time, and can have faults. */
export class TestStore {
  /** Number of requests of each key. */
  readonly requests = new Map<string, number>();
  /** Number of requests without an answer. */
  open = 0;
  /** Largest number of requests without an answer. */
  most = 0;
  fault: Fault = async (_, bytes) => bytes;
  readonly #files: Map<string, Uint8Array>;

  constructor(files: Map<string, Uint8Array>) {
    this.#files = files;
  }

  get(key: Key, options?: { signal?: AbortSignal }): Promise<Uint8Array | undefined> {
    return this.#answer(key, this.#files.get(key), options?.signal);
  }

  async getRange(key: Key, range: Range, options?: { signal?: AbortSignal }): Promise<Uint8Array | undefined> {
    const bytes = this.#files.get(key);
    return this.#answer(key, bytes && cut(bytes, range), options?.signal);
  }

  async #answer(key: string, bytes: Uint8Array | undefined, signal?: AbortSignal): Promise<Uint8Array | undefined> {
    const request = (this.requests.get(key) ?? 0) + 1;
    this.requests.set(key, request);
    this.open += 1;
    this.most = Math.max(this.most, this.open);
    const aborted = new Promise<never>((_, reject) => {
      signal?.addEventListener('abort', () => reject(signal.reason));
    });
    try {
      return await Promise.race([aborted, this.fault(key, bytes, request)]);
    } finally {
      this.open -= 1;
    }
  }
}

/** Returns a store of an image in memory. */
export async function storeOf(image: string): Promise<TestStore> {
  return new TestStore(await filesOf(image));
}

/** Returns a store of an image whose JSON file at `key` was changed. */
// biome-ignore lint/suspicious/noExplicitAny: any JSON
export async function changed(image: string, key: Key, change: (json: any) => unknown): Promise<TestStore> {
  const files = await filesOf(image);
  const json = JSON.parse(new TextDecoder().decode(files.get(key)));
  const result = change(json) ?? json;
  files.set(key, new TextEncoder().encode(typeof result === 'string' ? result : JSON.stringify(result)));
  return new TestStore(files);
}

/** Answers a request instead of the server; returns whether it did. */
export type Answer = (request: IncomingMessage, response: ServerResponse) => boolean;

/** A server of an image, with byte ranges. */
export interface ImageServer {
  url: string;
  /** Method, path and range of each request. */
  log: string[];
  /** Number of connections on which a request waits for its answer. */
  open: () => number;
  most: () => number;
  answer: Answer;
  close: () => Promise<void>;
}

/** Serves an image at an address; requests that `answer` handles are not answered otherwise. */
export async function serveImage(image: string): Promise<ImageServer> {
  const files = await filesOf(image);
  let [open, most] = [0, 0];
  const served: ImageServer = { url: '', log: [], open: () => open, most: () => most, answer: () => false, close };
  const server = createServer((request, response) => {
    const { method, url = '/', headers } = request;
    served.log.push([method, url, headers.range].filter(Boolean).join(' '));
    open += 1;
    most = Math.max(most, open);
    response.once('close', () => {
      open -= 1;
    });
    if (!served.answer(request, response)) send(files.get(decodeURI(url).slice('/image'.length)), request, response);
  });
  function close(): Promise<void> {
    server.closeAllConnections();
    return new Promise((resolve) => server.close(() => resolve()));
  }
  await new Promise<void>((resolve) => server.listen(0, '127.0.0.1', resolve));
  served.url = `http://127.0.0.1:${(server.address() as AddressInfo).port}/image`;
  return served;
}

function send(file: Uint8Array | undefined, { method, headers }: IncomingMessage, response: ServerResponse): void {
  if (!file) {
    response.writeHead(404, { 'Access-Control-Allow-Origin': '*' }).end();
    return;
  }
  const [, from = '', to = ''] = /^bytes=(\d*)-(\d*)$/.exec(headers.range ?? '') ?? [];
  const start = from === '' && to !== '' ? Math.max(0, file.length - Number(to)) : Number(from);
  const end = from === '' || to === '' ? file.length : Number(to) + 1;
  const part = file.slice(start, end);
  const sharing = { 'Access-Control-Allow-Origin': '*' };
  response.writeHead(headers.range ? 206 : 200, { 'Content-Length': part.length, ...sharing });
  response.end(method === 'HEAD' ? undefined : part);
}
