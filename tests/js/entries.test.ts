// Entry points of the package other than `vesicle`, in Node.
import { readFile } from 'node:fs/promises';
import ts from 'typescript';
import { beforeAll, describe, expect, test } from 'vitest';
import * as deformable from '../../pkg/deformable/index.js';
import * as implicit from '../../pkg/implicit/index.js';
import * as files from '../../pkg/import/index.js';
import * as vesicle from '../../pkg/index.js';
import * as multires from '../../pkg/multires/index.js';
import * as tracking from '../../pkg/tracking/index.js';
import { LACKING } from '../../scripts/entries.mjs';
import { beats, REACH, SECONDS } from './beating.js';
import { BUMPS_BITS, bumpsBits } from './bumps.js';
import { LAMP_BITS, lampBits } from './lamp.js';
import { bits, node, root } from './processes.js';
import { SPONGE_BITS, spongeBits } from './sponge.js';

/** The sentence in the documentation of a member that entry points with one method lack. */
const LACKS = /Entry points with one method lack it(?:, but for `vesicle\/(\w+)`)?/;

/** Returns the members of a class that the entry point with this method lacks. */
const lacking = (name: keyof typeof LACKING, method: string) =>
  Object.entries<string[]>(LACKING[name])
    .flatMap(([member, having]) => (having.includes(method) ? [] : [member]))
    .sort();

type VolumeInit = ConstructorParameters<typeof vesicle.Volume>[0];

test('the file with the module inside gives the same bits, whatever folder it is run in', () => {
  expect(node(bits(`${root}pkg/inline.js`), '/')).toBe(SPONGE_BITS);
});

describe('an entry point with one method', () => {
  const entries = { deformable, implicit, tracking, multires };
  type Method = keyof typeof entries;
  const METHODS = Object.keys(entries) as Method[];

  /** Returns the surface of a beating ball in its last frame. */
  function tracked({ SurfaceTracker, Volume }: typeof vesicle): Float32Array {
    const dims = [20, 20, 20, 3] as const;
    const place = { spacing: [1.5, 1.5, 1.5], origin: REACH.min } as const;
    const data = beats({ frames: 3 });
    const volume = new Volume({ data, dims: [...dims], frameSeconds: SECONDS, ...(place as object) });
    const tracker = new SurfaceTracker({ volume, box: REACH });
    while (!tracker.step().done);
    return tracker.meshAt(2).arrays().positions;
  }

  beforeAll(async () => {
    for (const one of [vesicle, ...Object.values(entries)]) await one.default();
  });

  test('gives the same bits as the whole library', async () => {
    expect(await spongeBits(deformable as unknown as typeof vesicle)).toBe(SPONGE_BITS);
    expect(bumpsBits(implicit as unknown as typeof vesicle)).toBe(BUMPS_BITS);
    expect(lampBits(multires as unknown as typeof vesicle)).toBe(LAMP_BITS);
    expect(tracked(tracking as unknown as typeof vesicle)).toEqual(tracked(vesicle));
  });

  test.each(METHODS)('%s has all that vesicle has but the other methods', (method) => {
    const models = ['DeformableModel', 'ImplicitSurface', 'MultiresolutionModel', 'SurfaceTracker', 'LabelSurfaces'];
    const animated = method === 'tracking' || method === 'multires';
    const others = [...models, 'parsePoints', ...(animated ? [] : ['animationGlb'])];
    const own = Object.keys(entries[method]);
    expect('animationGlb' in entries[method]).toBe(animated);
    expect(Object.keys(vesicle).filter((name) => !own.includes(name) && !others.includes(name))).toEqual([]);
    expect(own.filter((name) => !(name in vesicle))).toEqual([]);
    const specs = entries[method].paramSpecs as typeof vesicle.paramSpecs;
    expect(specs(method)).toEqual(vesicle.paramSpecs(method));
    for (const other of METHODS.filter((one) => one !== method)) expect(() => specs(other)).toThrow(/^method: /);
  });

  test.each(METHODS)('%s works with meshes and volumes', (method) => {
    const { Mesh, Volume } = entries[method];
    const copy = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.3 });
    copy.remesh({ min: 0.1, max: 0.3 });
    expect(copy.check()).toMatchObject({ closed: true, selfIntersections: 0 });
    const volume = new Volume({ data: Uint8Array.from({ length: 64 }, (_, i) => i), dims: [4, 4, 4] });
    expect(volume.pyramid(2, { factor: 2 }).map(({ dims }) => dims)).toEqual([
      [4, 4, 4],
      [2, 2, 2],
    ]);
  });

  test('has no readers of files, nor, but for tracking, interpolation of slices and volumes of frames', () => {
    const { Mesh, Volume } = vesicle;
    const classes = { Mesh, Volume };
    expect('parse' in Mesh && 'parse' in Volume && 'enrichSlices' in Volume.prototype).toBe(true);
    for (const method of METHODS) {
      const own = entries[method];
      expect('parse' in own.Mesh || 'parse' in own.Volume).toBe(false);
      expect('enrichSlices' in own.Volume.prototype).toBe(method === 'tracking');
      expect('fromFrames' in own.Volume).toBe(method === 'tracking');
      const missing = (all: object, some: object) => Object.getOwnPropertyNames(all).filter((name) => !(name in some));
      for (const [name, whole] of Object.entries(classes) as ['Mesh' | 'Volume', typeof Mesh | typeof Volume][]) {
        const parts = [missing(whole, own[name]), missing(whole.prototype, own[name].prototype)];
        expect(parts.flat().sort()).toEqual(lacking(name, method));
      }
    }
    // @ts-expect-error: the types have no readers either.
    expect(() => deformable.Volume.parse(new Uint8Array(8))).toThrow(TypeError);
    const image = { data: Float32Array.from({ length: 64 }, (_, i) => i), dims: [4, 4, 4] } as const;
    const slices = new tracking.Volume({ ...image, dims: [...image.dims] }).enrichSlices({ factor: 2 });
    expect(slices.dims).toEqual([4, 4, 7]);
  });

  test('lacks what the documentation says', async () => {
    const said: Record<string, Record<string, string[]>> = {};
    for (const file of ['mesh', 'volume', 'deformable']) {
      const text = await readFile(`${root}pkg/${file}.d.ts`, 'utf8');
      const { statements } = ts.createSourceFile(file, text, ts.ScriptTarget.Latest);
      for (const { name, members } of statements.filter(ts.isClassDeclaration)) {
        const found = members.flatMap(({ name: member, pos, end }): [string, string[]][] => {
          const [lacks, having] = LACKS.exec(text.slice(pos, end)) ?? [];
          return lacks && member && ts.isIdentifier(member) ? [[member.text, having ? [having] : []]] : [];
        });
        if (found.length > 0) said[name?.text ?? ''] = Object.fromEntries(found);
      }
    }
    expect(said).toEqual(LACKING);
  });

  test('throws the errors of vesicle, and takes no object of another module', () => {
    const mesh = vesicle.Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.3 });
    const work = () => new multires.MultiresolutionModel({ ellipsoids: [], detail: mesh as never });
    expect(work).toThrow(vesicle.VesicleError);
    expect(() => multires.Mesh.icosphere({ center: [0, 0, 0], radius: -1, maxEdge: 0.3 })).toThrow(
      vesicle.VesicleError,
    );
    const volume = new vesicle.Volume({ data: new Uint8Array(8), dims: [2, 2, 2] });
    expect(() => deformable.Mesh.marchingCubes(volume as never, 0.5)).toThrow(
      /^volume: is a Volume of another entry point, or copy, of the package; pass on its voxels/,
    );
    // @ts-expect-error: a volume of another module is another type.
    expect(() => deformable.Mesh.marchingCubes(volume, 0.5)).toThrow(vesicle.VesicleError);
  });
});

describe('vesicle/import', () => {
  beforeAll(async () => {
    for (const one of [vesicle, files, deformable]) await one.default();
  });

  const volumes: [string, VolumeInit][] = [
    ...[Uint8Array, Int8Array, Uint16Array, Int16Array, Uint32Array, Int32Array, Float32Array, Float64Array].map(
      (kind): [string, VolumeInit] => [kind.name, { data: new kind([...Array(24).keys()]), dims: [2, 3, 4] }],
    ),
    [
      'a sequence with all that it can state',
      {
        data: Int16Array.from({ length: 48 }, (_, i) => 100 - 5 * i),
        dims: [2, 3, 4, 2],
        affine: [0, 2, 0, 0, -1.5, 0, 0, 0, 0, 0, 3, 0, 10, 20, 30, 1],
        ...{ slope: 0.5, intercept: -8, frameSeconds: 0.25, space: 'RAS', unit: 'um' },
      },
    ],
  ];

  test.each(volumes)('reads the same volume as vesicle: %s', (_, init) => {
    const bytes = new vesicle.Volume(init).toNifti();
    const data = files.parseVolume(bytes);
    expect(data.data).toEqual(init.data);
    expect(data).toMatchObject({ dims: init.dims, slope: init.slope ?? 1, intercept: init.intercept ?? 0 });
    expect(data.unit).toBe(init.unit);
    // The unit, too, is in the file.
    expect(new deformable.Volume(data).toNifti()).toEqual(vesicle.Volume.parse(bytes).toNifti());
  });

  test('reads the same meshes as vesicle, with all their arrays', () => {
    const positions = Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1);
    const indices = Uint32Array.of(0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3);
    const image = Uint8Array.of(0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a);
    const texture = { type: 'image/png', bytes: image } as const;
    const seams = { cornerUvs: Float32Array.from({ length: 24 }, (_, i) => i / 24), texture };
    const colors = { colors: Float32Array.from({ length: 12 }, (_, i) => i / 12) };
    for (const extra of [{}, colors, seams]) {
      const whole = vesicle.Mesh.fromArrays(positions, indices, extra);
      for (const format of ['glb', 'ply', 'obj', 'stl'] as const) {
        const bytes = whole.toBytes(format);
        const { positions: points, indices: corners, ...rest } = files.parseMesh(bytes);
        const copy = deformable.Mesh.fromArrays(points, corners, rest);
        expect(copy.toBytes('glb')).toEqual(vesicle.Mesh.parse(bytes).toBytes('glb'));
      }
    }
    const bytes = vesicle.Mesh.fromArrays(positions, indices, { uvs: new Float32Array(8) }).toBytes('obj');
    expect(files.parseMesh(bytes, { texture }).texture).toEqual(texture);
  });

  test('reads the same points as vesicle', () => {
    const bytes = new TextEncoder().encode('0 0 0 1 0 0\n1 2 3 0 1 0\n');
    expect(files.parsePoints(bytes)).toEqual(vesicle.parsePoints(bytes));
  });

  test('explains what is wrong with a file, and reads the next', () => {
    const bytes = new vesicle.Volume({ data: new Uint8Array(8), dims: [2, 2, 2] }).toNifti();
    expect(() => files.parseVolume(bytes.subarray(0, 355))).toThrow(vesicle.VesicleError);
    expect(() => files.parseVolume('' as never)).toThrow(/^bytes: must be a Uint8Array/);
    expect(() => files.parseMesh(bytes)).toThrow(vesicle.VesicleError);
    expect(files.parseVolume(bytes).dims).toEqual([2, 2, 2]);
  });

  test('gives back the memory of large files', () => {
    const script = `
      import { readFile } from 'node:fs/promises';
      import { setFlagsFromString } from 'node:v8';
      import { runInNewContext } from 'node:vm';
      import * as vesicle from './pkg/index.js';
      setFlagsFromString('--expose-gc');
      const collect = runInNewContext('gc');
      await vesicle.default();
      const bytes = new vesicle.Volume({ data: new Uint8Array(3e7), dims: [300, 400, 250] }).toNifti();
      const memories = [];
      const watched = (instance) => {
        memories.push(new WeakRef(instance.exports.memory));
        return instance;
      };
      const { instantiate, Instance } = WebAssembly;
      WebAssembly.instantiate = async (...given) => watched(await instantiate(...given));
      WebAssembly.Instance = function (...given) { return watched(new Instance(...given)); };
      WebAssembly.Instance.prototype = Instance.prototype;
      const files = await import('./pkg/import/index.js');
      await files.default();
      const voxels = [0, 1].map(() => files.parseVolume(bytes).data.length);
      await new Promise((resolve) => setTimeout(resolve));
      collect();
      const left = memories.map((memory) => memory.deref()?.buffer.byteLength ?? 0);
      console.log(voxels, memories.length > 2, Math.max(...left) < 5e6);`;
    expect(node(script)).toBe('[ 30000000, 30000000 ] true true');
  });
});
