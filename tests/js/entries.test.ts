// Entry points of the package other than `vesicle`, in Node.
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdtempSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { beforeAll, describe, expect, test } from 'vitest';
import * as deformable from '../../pkg/deformable/index.js';
import * as implicit from '../../pkg/implicit/index.js';
import * as vesicle from '../../pkg/index.js';
import * as multires from '../../pkg/multires/index.js';
import * as tracking from '../../pkg/tracking/index.js';
import { beats, REACH, SECONDS } from './beating.js';
import { BUMPS_BITS, bumpsBits } from './bumps.js';
import { LAMP_BITS, lampBits } from './lamp.js';
import { SPONGE_BITS, spongeBits } from './sponge.js';

const root = fileURLToPath(new URL('../..', import.meta.url));

/** Runs a script in a separate Node process, in a folder of the project, and returns what it prints. */
function node(script: string, cwd = root): string {
  const args = ['--input-type=module', '--eval', script];
  return execFileSync(process.execPath, args, { cwd, encoding: 'utf8', timeout: 120_000 }).trim();
}

const bits = (address: string, options = '') => `
  const vesicle = await import('${address}');
  await vesicle.default(${options});
  console.log(await (${spongeBits})(vesicle));`;

test('the file with the module inside gives the same bits, whatever folder it is run in', () => {
  expect(node(bits(`${root}pkg/inline.js`), '/')).toBe(SPONGE_BITS);
});

test('an engine without SIMD gets the plain module, with the same bits', () => {
  const without = `
    const { readFile } = (await import('node:fs')).promises;
    const read = [];
    WebAssembly.validate = () => false;
    const { compile } = WebAssembly;
    WebAssembly.compile = (bytes) => { read.push(bytes.length); return compile(bytes); };`;
  const sizes = `
    const lengths = await Promise.all(['plain_bg', 'bg'].map((name) => readFile('pkg/vesicle_' + name + '.wasm')));
    console.log(...lengths.map(({ length }) => read.includes(length)));`;
  expect(node(`${without}${bits('./pkg/index.js')}${sizes}`)).toBe(`${SPONGE_BITS}\ntrue false`);
});

test('only the plain module is valid without SIMD', () => {
  const check = (...args: string[]) =>
    spawnSync('node_modules/.bin/wasm-opt', ['--all-features', ...args], { cwd: root }).status;
  const isValid = (module: string) => {
    // The module's own feature section would enable SIMD again.
    const bare = join(mkdtempSync(join(tmpdir(), 'vesicle-')), 'bare.wasm');
    expect(check('--strip-target-features', `pkg/${module}`, '-o', bare)).toBe(0);
    return check('--disable-simd', bare, '-o', bare) === 0;
  };
  expect(isValid('vesicle_plain_bg.wasm')).toBe(true);
  expect(isValid('vesicle_bg.wasm')).toBe(false);
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
    const others = ['DeformableModel', 'ImplicitSurface', 'MultiresolutionModel', 'SurfaceTracker', 'parsePoints'];
    const own = Object.keys(entries[method]);
    expect(Object.keys(vesicle).filter((name) => !own.includes(name) && !others.includes(name))).toEqual([]);
    expect(own.filter((name) => !(name in vesicle))).toEqual([]);
    const specs = entries[method].paramSpecs as typeof vesicle.paramSpecs;
    expect(specs(method)).toEqual(vesicle.paramSpecs(method));
    for (const other of METHODS.filter((one) => one !== method)) expect(() => specs(other)).toThrow(/^method: /);
  });

  test.each(METHODS)('%s works with files, meshes and slices', (method) => {
    const { Mesh, Volume } = entries[method];
    const sphere = Mesh.icosphere([0, 0, 0], 1, 0.3);
    const copy = Mesh.parse(sphere.toBytes('ply'));
    expect(copy.info().area).toBeCloseTo(sphere.info().area, 6);
    copy.remesh({ min: 0.1, max: 0.3 });
    expect(copy.check()).toMatchObject({ closed: true, selfIntersections: 0 });
    const volume = new Volume({ data: Uint8Array.from({ length: 64 }, (_, i) => i), dims: [4, 4, 4] });
    expect(Volume.parse(volume.toNifti()).enrichSlices({ factor: 2 }).dims).toEqual([4, 4, 7]);
  });

  test('throws the errors of vesicle, and takes no object of another module', () => {
    const mesh = vesicle.Mesh.icosphere([0, 0, 0], 1, 0.3);
    const work = () => new multires.MultiresolutionModel({ ellipsoids: [], detail: mesh as never });
    expect(work).toThrow(vesicle.VesicleError);
    expect(() => multires.Mesh.parse(new Uint8Array(3))).toThrow(vesicle.VesicleError);
    const volume = new vesicle.Volume({ data: new Uint8Array(8), dims: [2, 2, 2] });
    expect(() => deformable.Mesh.marchingCubes(volume as never, 0.5)).toThrow(/^volume: must be a Volume/);
    // @ts-expect-error: a volume of another module is another type.
    expect(() => deformable.Mesh.marchingCubes(volume, 0.5)).toThrow(vesicle.VesicleError);
  });
});
