// Compressed glTF is decoded into the document that it was before.
import { readFile } from 'node:fs/promises';
import fc from 'fast-check';
import { expect, test } from 'vitest';
import { decompressGltf, isCompressedGltf } from '../../pkg/gltf/index.js';
import startReaders, { parseMesh } from '../../pkg/import/index.js';
import { Mesh, VesicleError } from '../../pkg/index.js';
import { at } from '../../scripts/shell.mjs';
import { rejection, wrong } from './helpers.js';
import { ball, dracoGlb, dracoStream, type Given, glb, jsonOf, meshoptGlb } from './made-gltf.js';

/** Returns the corners of all triangles, with texture coordinates, in an order that vertex and triangle order do not change. */
function cornersOf({ positions, indices }: Given, uvs: Float32Array): string[] {
  const corner = (v = 0) => [...positions.subarray(3 * v, 3 * v + 3), ...uvs.subarray(2 * v, 2 * v + 2)].join();
  const triangles = Array.from({ length: indices.length / 3 }, (_, t) =>
    Array.from(indices.subarray(3 * t, 3 * t + 3), corner),
  );
  return triangles.map((corners) => turned(corners).join(' ')).sort();
}

/** Starts a triangle with its least corner. */
function turned(corners: string[]): string[] {
  const least = corners.indexOf(corners.toSorted()[0] ?? '');
  return [...corners.slice(least), ...corners.slice(0, least)];
}

const uvsOf = ({ positions }: Given) => positions.filter((_, k) => k % 3 < 2);

function readCorners(bytes: Uint8Array): string[] {
  const { positions, indices, uvs = new Float32Array() } = parseMesh(bytes);
  return cornersOf({ positions: Float32Array.from(positions), indices }, uvs);
}

await startReaders();

const BALL = ball();
const SMALL = { ...BALL, positions: BALL.positions.map((x) => x / 4 + 3) };

test.each([
  ['edgebreaker', {}],
  ['sequential', { sequential: true }],
  ['with metadata', { metadata: true }],
])('Draco, %s: positions, triangles and texture coordinates are the same', async (_, options) => {
  const plain = await decompressGltf(dracoGlb([dracoStream(BALL, options)]));
  expect(readCorners(plain)).toEqual(cornersOf(BALL, uvsOf(BALL)));
  const json = jsonOf(plain);
  expect([json.extensionsUsed, json.extensionsRequired]).toEqual([undefined, undefined]);
  expect(isCompressedGltf(plain)).toBe(false);
  expect(json.bufferViews).toHaveLength(3);
});

test('Draco: quantised positions are within half a step', async () => {
  const mesh = Mesh.parse(await decompressGltf(dracoGlb([dracoStream(BALL, { bits: 10 })])));
  const { positions } = mesh.arrays();
  const off = Array.from({ length: positions.length / 3 }, (_, v) =>
    Math.abs(Math.hypot(...positions.subarray(3 * v, 3 * v + 3)) - 1),
  );
  expect(Math.max(...off)).toBeLessThan(0.5 * (2 / 1023) * Math.sqrt(3) + 1e-6);
  expect(mesh.check().closed).toBe(true);
  mesh.free();
});

test('Draco: several primitives, and what is not compressed is kept', async () => {
  const more = { materials: [{ name: 'red' }], extras: { bufferView: 9 } };
  const plain = await decompressGltf(dracoGlb([dracoStream(BALL), dracoStream(SMALL)], more));
  const both = [BALL, SMALL].flatMap((one) => cornersOf(one, uvsOf(one))).sort();
  expect(readCorners(plain)).toEqual(both);
  expect(jsonOf(plain)).toMatchObject(more);
});

test.each(['EXT_meshopt_compression', 'KHR_meshopt_compression'])('%s: all is the same', async (name) => {
  const plain = await decompressGltf(await meshoptGlb(BALL, name));
  expect(readCorners(plain)).toEqual(cornersOf(BALL, uvsOf(BALL)));
  expect(isCompressedGltf(plain)).toBe(false);
});

test('the file of another program', async () => {
  const bytes = await readFile(at('tests/data/meshes/suzi_draco.glb'));
  const mesh = Mesh.parse(await decompressGltf(bytes));
  expect([mesh.vertexCount, mesh.triangleCount]).toEqual([7503, 14842]);
  mesh.free();
});

test('other files are returned as they are', async () => {
  for (const bytes of [new Uint8Array(), Uint8Array.of(1, 2, 3), new TextEncoder().encode('{"asset":{}}')])
    expect(await decompressGltf(bytes)).toBe(bytes);
});

test('of a document as text, buffers are in files beside it, and named if they are missing', async () => {
  const whole = dracoGlb([dracoStream(BALL)]);
  const json = jsonOf(whole);
  const bin = whole.slice(whole.length - json.buffers[0].byteLength);
  json.buffers[0].uri = 'a%20ball.bin';
  const text = new TextEncoder().encode(JSON.stringify(json));
  const plain = await decompressGltf(text, { files: [{ name: 'a ball.bin', bytes: bin }] });
  expect(readCorners(plain)).toEqual(cornersOf(BALL, uvsOf(BALL)));
  const error = await rejection(decompressGltf(text));
  expect([error.code, error.message]).toEqual(['bad-file', expect.stringContaining("'a ball.bin'")]);
});

const STREAM = dracoStream(BALL);
const patched = (change: (json: ReturnType<typeof jsonOf>) => void): Uint8Array => {
  const whole = dracoGlb([STREAM]);
  const json = jsonOf(whole);
  change(json);
  return glb(json, whole.slice(whole.length - Math.ceil(STREAM.bytes.length / 4) * 4));
};

test.each([
  ['a truncated stream', 'Draco stream', (json) => (json.bufferViews[0].byteLength = 200)],
  ['an empty stream', 'Draco stream', (json) => (json.bufferViews[0].byteLength = 0)],
  ['a view beyond the buffer', 'truncated', (json) => (json.bufferViews[0].byteLength = 1e9)],
  ['another count', 'POSITION', (json) => (json.accessors[0].count = 7)],
  ['another number of indices', 'indices', (json) => (json.accessors[2].count = 6)],
  ['another width', 'components', (json) => (json.accessors[1].type = 'VEC3')],
  ['an accessor that is not there', 'accessors', (json) => (json.meshes[0].primitives[0].attributes.POSITION = 99)],
  [
    'an attribute that is not there',
    'no attribute 9',
    (json) => (json.meshes[0].primitives[0].extensions.KHR_draco_mesh_compression.attributes.POSITION = 9),
  ],
  [
    'a view that is not there',
    'bufferViews',
    (json) => (json.meshes[0].primitives[0].extensions.KHR_draco_mesh_compression.bufferView = 9),
  ],
  ['lines', 'mode', (json) => (json.meshes[0].primitives[0].mode = 1)],
] satisfies [string, string, (json: ReturnType<typeof jsonOf>) => void][])(
  '%s is refused',
  async (_, named, change) => {
    const error = await rejection(decompressGltf(patched(change)));
    expect([error.code, error.message]).toEqual(['bad-file', expect.stringContaining(named)]);
  },
);

test('a sparse accessor changes what was decoded', async () => {
  // Its index and value, after the stream.
  const bytes = dracoGlb([STREAM]);
  const json = jsonOf(bytes);
  const start = Math.ceil(STREAM.bytes.length / 4) * 4;
  const binary = Buffer.concat([bytes.subarray(bytes.length - start), Buffer.alloc(16)]);
  for (const [k, x] of [5, 6, 7].entries()) binary.writeFloatLE(x, start + 4 + 4 * k);
  json.bufferViews.push(
    { buffer: 0, byteOffset: start, byteLength: 4 },
    { buffer: 0, byteOffset: start + 4, byteLength: 12 },
  );
  json.buffers[0].byteLength = binary.length;
  const indices = { bufferView: 1, componentType: 5125 };
  json.accessors[0].sparse = { count: 1, indices, values: { bufferView: 2 } };
  const mesh = Mesh.parse(await decompressGltf(glb(json, binary)));
  expect(Math.max(...mesh.arrays().positions)).toBe(7);
  mesh.free();
});

test('what states far more than it has takes neither time nor memory', async () => {
  const states = dracoStream(BALL, { sequential: true });
  // The numbers of triangles and of points follow the head.
  states.bytes.set([0xff, 0xff, 0xff, 0x7f], 11);
  const error = await rejection(decompressGltf(dracoGlb([states])));
  expect([error.code, error.message]).toEqual(['bad-file', expect.stringMatching(/states \d+ triangles in/)]);
  const meshopt = await meshoptGlb(BALL);
  const json = jsonOf(meshopt);
  for (const view of json.bufferViews.slice(0, 1)) {
    view.byteLength = 12 * 2 ** 30;
    view.extensions.EXT_meshopt_compression.count = 2 ** 30;
  }
  const large = await rejection(decompressGltf(glb(json, meshopt.slice(meshopt.length - json.buffers[0].byteLength))));
  expect(large.code).toBe('too-large');
});

test('a small file does not decode to very much, nor do its nodes repeat that', async () => {
  const states = dracoStream(BALL, { sequential: true });
  const padded = new Uint8Array(30_000);
  padded.set(states.bytes);
  // 1.4 million triangles: fewer than 64 for each byte.
  padded.set([0xd0, 0xf6, 0x55, 0], 11);
  const error = await rejection(decompressGltf(dracoGlb([{ ...states, bytes: padded }])));
  expect([error.code, error.message]).toEqual([
    'too-large',
    expect.stringMatching(/indices: needs \d+ .* decode to 8388608/),
  ]);
  const repeated = (bytes: Uint8Array) => (more: object[], count: number) => {
    const json = jsonOf(bytes);
    json.nodes = [...Array.from({ length: count }, () => ({ mesh: 0 })), ...more];
    json.scenes = [{ nodes: json.nodes.map((_: object, k: number) => k) }];
    return decompressGltf(glb(json, bytes.slice(bytes.length - json.buffers[0].byteLength)));
  };
  const instances = { mesh: 0, extensions: { EXT_mesh_gpu_instancing: { attributes: { TRANSLATION: 0 } } } };
  const vertices = BALL.positions.length / 3;
  const each = 12 * vertices + 4 * BALL.indices.length;
  for (const bytes of [dracoGlb([STREAM]), await meshoptGlb(BALL)]) {
    const most = Math.floor(2 ** 23 / each);
    expect((await repeated(bytes)([], most)).length).toBeGreaterThan(0);
    expect((await rejection(repeated(bytes)([], most + 1))).message).toMatch(/nodes: needs \d+ bytes/);
    const rejected = await rejection(repeated(bytes)(Array(Math.ceil(most / vertices)).fill(instances), 1));
    expect(rejected.message).toMatch(/nodes: needs \d+ bytes/);
  }
});

test('overlapping buffer views do not multiply a file', async () => {
  const view = { buffer: 0, byteLength: STREAM.bytes.length };
  const many = patched((json) => {
    json.bufferViews.push(...Array.from({ length: 2 ** 28 / STREAM.bytes.length }, () => view));
    json.images = json.bufferViews.map((_: object, bufferView: number) => ({ bufferView }));
  });
  expect((await rejection(decompressGltf(many))).code).toBe('too-large');
});

test.each([
  ['byteStride', 260, 'byteStride'],
  ['mode', 'OTHER', 'mode'],
  ['filter', 'OTHER', 'filter'],
  ['filter', 'OCTAHEDRAL', 'byteStride'],
  ['count', 1, 'elements'],
])('meshopt: %s of %s is refused', async (name, value, named) => {
  const bytes = await meshoptGlb(BALL);
  const json = jsonOf(bytes);
  json.bufferViews[0].extensions.EXT_meshopt_compression[name] = value;
  const changed = glb(json, bytes.slice(bytes.length - json.buffers[0].byteLength));
  const error = await rejection(decompressGltf(changed));
  expect([error.code, error.message]).toEqual(['bad-file', expect.stringContaining(named)]);
});

test('a decoder that is missing is an error with the package to install', async () => {
  const load = () => Promise.reject(new Error('not found'));
  const files = { draco: dracoGlb([STREAM]), meshopt: await meshoptGlb(BALL) };
  for (const [name, bytes] of Object.entries(files)) {
    const error = await rejection(decompressGltf(bytes, { decoders: { [name]: { load } } }));
    expect(error.code).toBe('invalid-argument');
    expect(error.message).toMatch(/not found.*install the package (draco3dgltf|meshoptimizer)/);
  }
  expect((await rejection(decompressGltf(files.draco, wrong({ file: [] })))).code).toBe('invalid-argument');
});

test('damaged files are refused, or read; none crashes or hangs', async () => {
  const files = [
    dracoGlb([STREAM]),
    dracoGlb([dracoStream(BALL, { sequential: true, bits: 12 })]),
    await meshoptGlb(BALL),
  ];
  const outcomes = { read: 0, refused: 0 };
  const damage = fc.array(fc.tuple(fc.double({ min: 0, max: 0.999999, noNaN: true }), fc.nat(255)), {
    minLength: 1,
    maxLength: 4,
  });
  await fc.assert(
    fc.asyncProperty(fc.constantFrom(...files), damage, async (file, changes) => {
      const bytes = file.slice();
      // Half of the changes in the data, which the text precedes.
      const start = 20 + new DataView(bytes.buffer).getUint32(12, true);
      for (const [k, [place, value]] of changes.entries()) {
        const from = k % 2 ? 0 : start;
        bytes[from + Math.floor(place * (bytes.length - from))] = value;
      }
      const before = performance.now();
      try {
        const plain = await decompressGltf(bytes);
        outcomes.read++;
        Mesh.parse(plain).free();
      } catch (error) {
        if (!(error instanceof VesicleError)) throw error;
        outcomes.refused++;
      }
      expect(performance.now() - before).toBeLessThan(5000);
    }),
    { numRuns: 300 },
  );
  expect(Math.min(outcomes.read, outcomes.refused)).toBeGreaterThan(10);
});
