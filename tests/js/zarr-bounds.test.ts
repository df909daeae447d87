// `vesicle/zarr` with small files and slow servers that would take much memory, many requests, or all time.
import { deflateSync, gzipSync } from 'node:zlib';
import { afterEach, describe, expect, test } from 'vitest';
import * as zarrita from 'zarrita';
import { openZarr } from '../../pkg/zarr/index.js';
import { rejection } from './helpers.js';
import { type ImageServer, serveImage, TestStore } from './zarr-stores.js';

/** An array's metadata that differ from the usual. */
interface ArrayJson {
  shape: number[];
  chunks: number[];
  type?: string;
  /** Order in which the axes are stored, if not as they are. */
  order?: number[];
  codecs?: object[];
  fill?: number;
}

const json = (value: unknown) => new TextEncoder().encode(JSON.stringify(value));

/** Returns the files of an image with one level. */
function image({ shape, chunks, type = 'uint8', order, codecs = [], fill = 0 }: ArrayJson): Map<string, Uint8Array> {
  const transpose = order ? [{ name: 'transpose', configuration: { order } }] : [];
  const axes = ['z', 'y', 'x'].map((name) => ({ name, type: 'space' }));
  const scale = [{ type: 'scale', scale: [1, 1, 1] }];
  const multiscales = [{ axes, datasets: [{ path: '0', coordinateTransformations: scale }] }];
  const group = { zarr_format: 3, node_type: 'group', attributes: { ome: { version: '0.5', multiscales } } };
  const array = {
    ...{ zarr_format: 3, node_type: 'array', shape, data_type: type, fill_value: fill },
    chunk_grid: { name: 'regular', configuration: { chunk_shape: chunks } },
    chunk_key_encoding: { name: 'default', configuration: { separator: '/' } },
    codecs: [...transpose, { name: 'bytes', configuration: { endian: 'little' } }, ...codecs],
    attributes: {},
  };
  return new Map([
    ['/zarr.json', json(group)],
    ['/0/zarr.json', json(array)],
  ]);
}

const withChunk = (given: ArrayJson, chunk: Uint8Array) => new TestStore(image(given).set('/0/c/0/0/0', chunk));

/** Runs `work`, and returns by how much the memory of the process grew meanwhile, bytes. */
async function growth(work: () => Promise<unknown>): Promise<number> {
  const before = process.memoryUsage().rss;
  let most = before;
  const timer = setInterval(() => {
    most = Math.max(most, process.memoryUsage().rss);
  }, 5);
  await work();
  clearInterval(timer);
  return Math.max(most, process.memoryUsage().rss) - before;
}

const CUBE = { shape: [8, 8, 8], chunks: [8, 8, 8] };
const gzip = { name: 'gzip', configuration: { level: 9 } };
const zeros = (count: number) => new Uint8Array(count);

/** Blocks of Zstandard that repeat a byte, at most 131,071 times each. */
function zstdBlocks(size: number): number[] {
  const bytes: number[] = [];
  for (let left = size; left > 0; left -= 0x1ffff) {
    const header = (left <= 0x1ffff ? 1 : 0) + (1 << 1) + (Math.min(left, 0x1ffff) << 3);
    bytes.push(header & 255, (header >> 8) & 255, header >> 16, 7);
  }
  return bytes;
}

/** A frame of Zstandard without a size. */
const zstdRuns = (blocks: number) =>
  Uint8Array.from([0x28, 0xb5, 0x2f, 0xfd, 0, 0x58, ...zstdBlocks(blocks * 0x1ffff)]);

/** The same with a size. */
const zstdSized = (size: number) =>
  Uint8Array.from([0x28, 0xb5, 0x2f, 0xfd, 0b1010_0000, ...u32(size), ...zstdBlocks(size)]);

/** A header that states how many bytes follow once they are decoded. */
const bloscOf = (bytes: number) => Uint8Array.from([2, 1, 1, 1, ...u32(bytes), ...u32(bytes), ...u32(32), 0, 0, 0, 0]);
const u32 = (value: number) => [value & 255, (value >> 8) & 255, (value >> 16) & 255, value >>> 24];

describe('chunks whose axes are stored in another order', () => {
  test.each([[[2, 1, 0]], [[1, 2, 0]], [[0, 2, 1]]])('%j: each voxel is at its place', async (order) => {
    const shape = [33, 20, 50];
    const [, ny, nx] = shape as [number, number, number];
    const stored = order.map((axis) => shape[axis] as number);
    const value = (at: number[]) => ((at[0] as number) * 7 + (at[1] as number) * 11 + (at[2] as number) * 13) % 251;
    const chunk = new Uint8Array(33 * 20 * 50);
    for (let i = 0; i < chunk.length; i++) {
      const [, b, c] = stored as [number, number, number];
      const along = [Math.floor(i / (b * c)), Math.floor(i / c) % b, i % c];
      const at = [0, 0, 0];
      order.forEach((axis, k) => {
        at[axis] = along[k] as number;
      });
      chunk[i] = value(at);
    }
    const zarr = await openZarr(withChunk({ shape, chunks: shape, order }, chunk));
    const region = await zarr.region(0, { min: [0, 0, 0], max: [50, 20, 33] });
    const expected = Array.from(chunk, (_, i) => value([Math.floor(i / (nx * ny)), Math.floor(i / nx) % ny, i % nx]));
    expect([...region.intensities()]).toEqual(expected);
    zarr.free();
  });

  test('are rearranged in slices, between which an abort takes effect', async () => {
    const shape = [512, 256, 256];
    const store = withChunk({ shape, chunks: shape, order: [2, 1, 0] }, new Uint8Array(2 ** 25));
    let [turns, isOver] = [0, false];
    const count = () => {
      turns += 1;
      if (!isOver) setImmediate(count);
    };
    store.fault = async (key, bytes) => {
      if (key.includes('/c/')) turns = 0;
      return bytes;
    };
    count();
    const zarr = await openZarr(store);
    await zarr.region(0, { min: [0, 0, 0], max: [9, 9, 9] });
    isOver = true;
    // Without slices there are about ten.
    expect(turns).toBeGreaterThan(20);
    zarr.free();
  });
});

describe('decoders stop at the size of a chunk', () => {
  const codec = (name: string) => ({ name, configuration: { level: 5, cname: 'lz4', clevel: 5, shuffle: 0 } });
  test.each([
    ['gzip in gzip', [gzip, gzip], gzipSync(gzipSync(zeros(64e6)))],
    ['gzip', [gzip], gzipSync(zeros(64e6))],
    ['zlib', [codec('zlib')], deflateSync(zeros(64e6))],
    ['zstd that states its size', [codec('zstd')], zstdSized(64e6)],
    ['zstd that does not', [codec('zstd')], zstdRuns(8000)],
    ['blosc', [codec('blosc')], bloscOf(2e9)],
    ['lz4', [codec('lz4')], Uint8Array.from([...u32(2e9), 1, 2, 3])],
  ])('%s', async (_, codecs, bytes) => {
    expect(bytes.length).toBeLessThan(1e5);
    const store = withChunk({ ...CUBE, codecs }, bytes);
    const grown = await growth(async () => {
      const { code, message } = await rejection(openZarr(store));
      expect([code, message]).toEqual(['bad-file', expect.stringContaining('larger than its chunk')]);
    });
    expect(grown).toBeLessThan(60e6);
  });

  test('of hundreds of codecs are refused, in shards, too', async () => {
    const many = Array(500).fill({ name: 'crc32c' });
    const chunks = [{ name: 'bytes', configuration: { endian: 'little' } }];
    const shard = {
      chunk_shape: [4, 4, 4],
      codecs: [...chunks, ...many],
      index_codecs: [...chunks, { name: 'crc32c' }],
    };
    for (const codecs of [many, [{ name: 'sharding_indexed', configuration: shard }]]) {
      const error = await rejection(openZarr(new TestStore(image({ ...CUBE, codecs }))));
      expect(error.code).toBe('bad-file');
      expect(error.message).toMatch(/must have at most 8 codecs, got 50\d/);
    }
  });

  test('that change the order of axes several times, each with a copy, are refused', async () => {
    const transpose = { name: 'transpose', configuration: { order: [2, 1, 0] } };
    const bytes = { name: 'bytes', configuration: { endian: 'little' } };
    const shard = { chunk_shape: [4, 4, 4], codecs: [transpose, bytes], index_codecs: [bytes] };
    const [twice, inShards] = [[transpose], [{ name: 'sharding_indexed', configuration: shard }]];
    for (const codecs of [twice, inShards]) {
      const error = await rejection(openZarr(new TestStore(image({ ...CUBE, order: [2, 1, 0], codecs }))));
      expect(`${error.code} ${error.message}`).toMatch(/^bad-file .*must have at most 1 codec 'transpose', got 2/);
    }
  });

  test('for others that use the same zarrita, too, and only for what is larger', async () => {
    const voxels = Uint8Array.from({ length: 512 }, (_, index) => index);
    const store = withChunk({ ...CUBE, codecs: [gzip, gzip] }, gzipSync(gzipSync(voxels)));
    const opened = await openZarr(store);
    expect((await opened.voxels(0, { min: [0, 0, 0], max: [8, 8, 8] })).data).toEqual(voxels);
    const array = await zarrita.open.v3(zarrita.root(store).resolve('0'), { kind: 'array' });
    expect((await array.getChunk([0, 0, 0])).data).toEqual(voxels);
  });
});

describe('a chunk of few bytes', () => {
  const zstd = { name: 'zstd', configuration: { level: 5, checksum: false } };
  const constant = (size: number) =>
    withChunk({ shape: [1, size, 1024], chunks: [1, size, 1024], codecs: [zstd] }, zstdSized(size * 1024));

  test('that decodes to hundreds of megabytes is refused before it is decoded', async () => {
    const grown = await growth(async () => {
      const { code, message } = await rejection(openZarr(constant(244_140)));
      expect([code, message]).toEqual([
        'too-large',
        expect.stringMatching(/7\d+ bytes would decode to 249999360; .* 64 MiB: store/),
      ]);
    });
    expect(grown).toBeLessThan(60e6);
  });

  test('is read up to the limit', async () => {
    const zarr = await openZarr(constant(2 ** 16));
    const { data } = await zarr.voxels(0, { min: [1022, 65_000, 0], max: [1024, 65_001, 1] });
    expect(data).toEqual(Uint8Array.of(7, 7));
    expect((await rejection(openZarr(constant(2 ** 16 + 1)))).code).toBe('too-large');
  });

  test('of which an image has many: its coarsest level has up to 32 MiB', async () => {
    const many = (height: number) => {
      const files = image({ shape: [1, 4 * height, 1024], chunks: [1, height, 1024], codecs: [zstd] });
      for (let y = 0; y < 4; y++) files.set(`/0/c/0/${y}/0`, zstdSized(height * 1024));
      return openZarr(new TestStore(files));
    };
    expect(await many(2 ** 13)).toMatchObject({ range: [7, 7], unread: '' });
    const larger = await many(2 ** 13 + 1);
    expect([larger.range, larger.unread]).toEqual([
      undefined,
      expect.stringMatching(/^the coarsest .* may unpack to 32 MiB: store a coarser level/),
    ]);
  });
});

test('the range of a coarsest level of few values', async () => {
  const rangeOf = async (values: number[]) => {
    const bytes = new Uint8Array(Float32Array.from(values).buffer);
    const size = [1, 1, values.length];
    return (await openZarr(withChunk({ shape: size, chunks: size, type: 'float32' }, bytes))).range;
  };
  expect(await rangeOf([Number.NaN, Infinity, 3, -Infinity])).toEqual([3, 3]);
  expect(await rangeOf([-Infinity, -2, 5, Number.NaN])).toEqual([-2, 5]);
  expect(await rangeOf([Number.NaN, Infinity])).toBeUndefined();
});

describe('an image whose metadata promise much', () => {
  test('chunks that are not stored cost nothing', async () => {
    const store = new TestStore(image({ shape: [4, 4, 4], chunks: [512, 512, 1024], fill: 9 }));
    const grown = await growth(async () => {
      const zarr = await openZarr(store);
      expect(zarr.range).toEqual([9, 9]);
      expect((await zarr.voxels(0, { min: [1, 1, 1], max: [2, 3, 4] })).data).toEqual(new Uint8Array(6).fill(9));
      expect(zarr.loaded()).toEqual([{ chunks: 1, bytes: 64, of: { chunks: 1, bytes: 64 } }]);
    });
    expect(grown).toBeLessThan(60e6);
  });

  test('chunks of one voxel are not all requested when it is opened', async () => {
    const store = new TestStore(image({ shape: [60, 60, 60], chunks: [1, 1, 1] }));
    const zarr = await openZarr(store);
    expect([zarr.range, store.requests.size]).toEqual([undefined, 2]);
    expect(zarr.unread).toContain('216000');
    // They can be read where they are wanted.
    expect((await zarr.voxels(0, { min: [0, 0, 0], max: [2, 2, 2] })).data).toHaveLength(8);
  });

  test('chunks that are far larger than what they hold of the image', async () => {
    const zarr = await openZarr(new TestStore(image({ shape: [10, 1, 1], chunks: [1, 16384, 16384] })));
    expect([zarr.range, zarr.unread]).toEqual([undefined, expect.stringContaining('2 GB')]);
  });

  test('chunks above the limit, by their bytes', async () => {
    const store = new TestStore(image({ shape: [4, 4, 4], chunks: [512, 512, 513], type: 'float64' }));
    expect((await rejection(openZarr(store))).code).toBe('too-large');
  });

  test('files longer than they may be', async () => {
    const large = withChunk(CUBE, zeros(1e6));
    expect((await rejection(openZarr(large))).message).toMatch(/larger than the \d+ bytes that it may have/);
    const store = new TestStore(image(CUBE).set('/zarr.json', zeros(2 ** 22 + 1)));
    expect((await rejection(openZarr(store))).message).toContain('/zarr.json');
  });

  const withAttributes = (path: string, attributes: string, files = image(CUBE)) => {
    const text = new TextDecoder().decode(files.get(path)).replace('"attributes":{', `"attributes":{${attributes},`);
    return files.set(path, new TextEncoder().encode(text.replace(',}', '}')));
  };

  test('files of metadata that are longer together', async () => {
    const one = withAttributes('/zarr.json', `"a":"${'x'.repeat(2.2e6)}"`);
    expect((await openZarr(new TestStore(new Map(one)))).levels).toHaveLength(1);
    const both = new TestStore(withAttributes('/0/zarr.json', `"a":"${'x'.repeat(2.2e6)}"`, one));
    const error = await rejection(openZarr(both));
    expect(`${error.code} ${error.message}`).toMatch(/^bad-file .*\/0\/zarr.json: with it, .* more than 4194304 bytes/);
  });

  test('brackets within brackets, unless they are text', async () => {
    const text = `"a":"${'['.repeat(2e6)}\\"${'{'.repeat(1000)}","b":[${'[{}],'.repeat(1000)}[]]`;
    expect((await openZarr(new TestStore(withAttributes('/zarr.json', text)))).levels).toHaveLength(1);
    const deep = withAttributes('/zarr.json', `"a":${'['.repeat(2e6)}${']'.repeat(2e6)}`);
    const before = performance.now();
    const error = await rejection(openZarr(new TestStore(deep)));
    expect(`${error.code} ${error.message}`).toMatch(/^bad-file .*\/zarr.json: brackets are nested more than 200 deep/);
    expect(performance.now() - before).toBeLessThan(300);
  });

  test('sizes beyond 32 bits', async () => {
    const beyond = async (shape: number[], chunks: number[]) => {
      const error = await rejection(openZarr(new TestStore(image({ shape, chunks }))));
      return `${error.code} ${error.message}`;
    };
    const problem = 'at most 4294967295 voxels along each axis can be read, got';
    expect(await beyond([8, 8, 1e10], [8, 8, 8])).toBe(
      `too-large OME-Zarr: array "0".shape: ${problem} [8,8,10000000000]`,
    );
    expect(await beyond([8, 8, 8], [1e10, 8, 8])).toBe(
      `too-large OME-Zarr: array "0".chunk_shape: ${problem} [10000000000,8,8]`,
    );
  });
});

describe('a server', () => {
  let server: ImageServer | undefined;
  afterEach(() => server?.close());

  test('whose metadata have no end', async () => {
    server = await serveImage('v3-zstd-zyx');
    let sent = 0;
    server.answer = (_, response) => {
      const more = () => {
        while (!response.destroyed && response.write(zeros(1e6))) sent += 1e6;
        sent += 1e6;
      };
      response.writeHead(200).on('drain', more);
      more();
      return true;
    };
    const error = await rejection(openZarr(server.url));
    expect([error.code, error.message]).toEqual(['unavailable', expect.stringContaining('that were asked for')]);
    await expect.poll(server.open).toBe(0);
    expect(sent).toBeLessThan(2e8);
  });

  test('that drips is not waited for without end', async () => {
    server = await serveImage('v3-zstd-zyx');
    server.answer = (_, response) => {
      const timer = setInterval(() => response.write(' '), 20);
      response.writeHead(200).once('close', () => clearInterval(timer));
      return true;
    };
    const error = await rejection(openZarr(server.url, { timeoutMs: 100, retries: 3 }));
    expect([error.code, error.message]).toEqual(['unavailable', expect.stringContaining('slower than')]);
    await expect.poll(server.open).toBe(0);
    // Once for Zarr 3, and once for Zarr 2.
    expect(server.log.length).toBeLessThanOrEqual(3);
  });
});

test('reading chunks that are not stored can be aborted', async () => {
  const zarr = await openZarr(new TestStore(image({ shape: [200, 200, 200], chunks: [1, 1, 2] })));
  const stop = new AbortController();
  // Runs only if reading lets it.
  setTimeout(() => stop.abort(new Error('enough')), 5);
  await expect(zarr.region(0, { min: [0, 0, 0], max: [200, 200, 200] }, { signal: stop.signal })).rejects.toThrow(
    'enough',
  );
});
