/** Parts of the Track lab that need no browser. */
import { readFile } from 'node:fs/promises';
import { beforeAll, describe, expect, test } from 'vitest';
import init, { type FrameStatistics, Mesh, Volume } from '../../pkg/index.js';
import { at } from '../../scripts/shell.mjs';
import { groupFiles } from '../../www/src/engine/file-groups';
import type { Surface } from '../../www/src/engine/protocol';
import { boxOf, voxelsOf } from '../../www/src/labs/track/box';
import { canny } from '../../www/src/labs/track/canny';
import { cineVoxels, contraction, trueVolume, wallDistances } from '../../www/src/labs/track/cine';
import { boundaryImage, hasBoundary, sliceVotes, twoMeans, windowAt } from '../../www/src/labs/track/clusters';
import { beatOf, warningsOf } from '../../www/src/labs/track/curve';
import { IMAGES } from '../../www/src/labs/track/examples';
import { interpolateSlice } from '../../www/src/labs/track/interpolate-slice';
import { fromHash, linkOf, setupOf, toHash } from '../../www/src/labs/track/link';
import { framesCsv } from '../../www/src/labs/track/measures';
import { TRACK_PRESETS, viewOf } from '../../www/src/labs/track/presets';
import { checkSmall, openImage, prepare } from '../../www/src/labs/track/source';
import { votesNear } from '../../www/src/labs/track/votes';
import { invert } from '../../www/src/scene/anatomy';
import { crossSection, intersectionsWithRow } from '../../www/src/scene/cross-section';

beforeAll(() => init());

const SPEC = { dims: [36, 36, 36], spacing: [2, 2, 2], frames: 8, noise: 0, size: 24, papillary: false } as const;
const spec = () => structuredClone(SPEC) as unknown as Parameters<typeof cineVoxels>[0];

function surfaceOf(mesh: Mesh): Surface {
  const { positions, normals, indices } = mesh.arrays({ relative: true });
  const counts = { vertices: positions.length / 3, triangles: indices.length / 3 };
  return { positions, normals, indices, ...counts, origin: mesh.origin };
}

describe('the computed ventricle', () => {
  test('contracts and fills once per beat', () => {
    const part = Array.from({ length: 8 }, (_, frame) => contraction(spec(), frame));
    expect(part[0]).toBe(0);
    expect(Math.max(...part)).toBeGreaterThan(0.95);
    expect(part.at(-1)).toBeLessThan(0.1);
  });

  test('has the volume of its bright voxels', () => {
    const voxels = cineVoxels(spec());
    const size = 36 ** 3;
    for (const frame of [0, 3]) {
      const blood = voxels.subarray(frame * size, (frame + 1) * size).reduce((sum, v) => sum + (v > 145 ? 8 : 0), 0);
      expect(trueVolume(spec(), frame) / blood).toBeGreaterThan(0.96);
      expect(trueVolume(spec(), frame) / blood).toBeLessThan(1.04);
    }
  });

  test('knows the distance of a point from its wall, and is deterministic', () => {
    // The short semi-axis is 25 · 24/42 mm, and the centre of the volume is 35 mm from its first voxel.
    const half = (25 * 24) / 42;
    const found = wallDistances(spec(), 0, Float32Array.of(35 + half, 35, 35, 35 + half + 1, 35, 35));
    expect(found[0]).toBeCloseTo(0, 4);
    expect(found[1]).toBeCloseTo(1, 1);
    const noisy = { ...spec(), noise: 8 };
    expect(cineVoxels(noisy)).toEqual(cineVoxels(noisy));
  });
});

describe('a heartbeat', () => {
  test('has an end-diastole, an end-systole and an ejection fraction', () => {
    expect(beatOf([90, 100, 60, 40, 70])).toEqual({
      diastole: 1,
      systole: 3,
      largest: 100,
      smallest: 40,
      ejection: 0.6,
    });
    expect(beatOf([5])).toBeUndefined();
    // Nothing is ejected from an object that is not there.
    expect(beatOf([90, 0, 60])).toBeUndefined();
  });

  test('is suspect if triangles fold or the area jumps', () => {
    const facts = [
      { folded: 0, triangles: 1000, area: 100, volume: 80 },
      { folded: 11, triangles: 1000, area: 110, volume: 80 },
      { folded: 10, triangles: 1000, area: 90, volume: 80 },
      // The area shrinks in proportion to the volume.
      { folded: 0, triangles: 1000, area: 90 / 4, volume: 10 },
    ];
    expect(warningsOf(facts).map(({ frame, kind }) => [frame, kind])).toEqual([
      [1, 'folded'],
      [2, 'area'],
    ]);
  });

  test('is exported as a table with a line per frame', () => {
    const facts: FrameStatistics = {
      ...{
        volume: 2,
        area: 3,
        triangles: 4,
        folded: 5,
        rejected: 6,
        heldMoves: 7,
        withoutBoundary: 8,
        steps: 9,
        meanFinalCorrection: 10,
      },
    };
    const frame = { facts, surface: {}, measures: {}, error: { mean: 0.5, p95: 1 } };
    const lines = framesCsv([frame] as unknown as Parameters<typeof framesCsv>[0], [2.5]).split('\n');
    expect(lines[0]).toMatch(/^frame,volume,area,triangles,folded,.*,error,error \(95 %\),true volume$/);
    expect(lines[1]).toBe('1,2,3,4,5,6,7,8,9,10,,0.5,1,2.5');
    const [head] = framesCsv([frame] as unknown as Parameters<typeof framesCsv>[0], [2.5], [], 'mm').split('\n');
    expect(head).toMatch(
      /^frame,volume \(mm³\),area \(mm²\),triangles,.*,error \(mm\),error \(95 %\) \(mm\),true volume \(mm³\)$/,
    );
  });
});

describe('Canny', () => {
  const disc = (width: number, height: number) => ({
    width,
    height,
    values: Float32Array.from({ length: width * height }, (_, i) =>
      Math.hypot((i % width) - 20, Math.floor(i / width) - 20) < 10 ? 200 : 50,
    ),
  });

  test('finds a thin closed line around a disc, and nothing else', () => {
    const edges = canny(disc(41, 41), { deviation: 1, low: 6, high: 14 });
    const found = [...edges.keys()].filter((i) => edges[i]);
    expect(found.length).toBeGreaterThan(45);
    expect(found.length).toBeLessThan(95);
    for (const i of found)
      expect(Math.abs(Math.hypot((i % 41) - 20, Math.floor(i / 41) - 20) - 9.75)).toBeLessThan(1.5);
  });

  test('keeps weak edges only if they are connected to strong ones', () => {
    // A step across the whole image that fades from left to right, and a weak one apart from it.
    const [width, height] = [60, 30];
    const values = Float32Array.from({ length: width * height }, (_, i) => {
      const [x, y] = [i % width, Math.floor(i / width)];
      return (y > 8 ? 60 - x : 0) + (y > 20 ? 12 : 0);
    });
    const rowsOf = (high: number) => {
      const edges = canny({ width, height, values }, { deviation: 1, low: 3, high });
      return new Set([...edges.keys()].filter((i) => edges[i]).map((i) => Math.floor(i / width)));
    };
    expect([...rowsOf(15)].every((row) => row < 12)).toBe(true);
    expect([...rowsOf(3.2)].some((row) => row > 18)).toBe(true);
  });

  test('finds nothing in a uniform image', () => {
    const plain = { width: 9, height: 7, values: new Float32Array(63).fill(80) };
    expect(Math.max(...canny(plain, { deviation: 1.5, low: 0.1, high: 0.2 }))).toBe(0);
  });
});

describe('windows', () => {
  test('are split by 2-means, and vote only for a step between two large clusters', () => {
    const found = twoMeans([10, 12, 11, 100, 104]);
    expect(found.means[0]).toBeCloseTo(11);
    expect(found.means[1]).toBeCloseTo(102);
    expect([...found.bright]).toEqual([0, 0, 0, 1, 1]);
    expect(hasBoundary(found, 50)).toBe(true);
    expect(hasBoundary(found, 95)).toBe(false);
    expect(hasBoundary(twoMeans([...new Array(24).fill(10), 100]), 50)).toBe(false);
    expect(twoMeans([7, 7, 7]).means).toEqual([7, 7]);
  });

  test('are clipped by the image', () => {
    const picture = { width: 10, height: 8, values: [] };
    expect(windowAt(picture, 5, 4, 2)).toHaveLength(25);
    expect(windowAt(picture, 0, 0, 2)).toEqual([0, 1, 2, 10, 11, 12, 20, 21, 22]);
  });

  test('of a slice vote for the faces of a step, and for nothing else', () => {
    // Bright from column 6 on.
    const values = Float32Array.from({ length: 12 * 9 }, (_, i) => (i % 12 >= 6 ? 150 : 60));
    const faces = sliceVotes({ width: 12, height: 9, values }, 2, 50);
    expect(new Set(faces.map(({ x }) => x))).toEqual(new Set([6]));
    expect(Math.max(...faces.map(({ weight }) => weight))).toBe(1);
    expect(sliceVotes({ width: 12, height: 9, values }, 2, 90)).toEqual([]);
  });

  test('are summed per pixel with the square roots of their votes', () => {
    const faces = [
      { x: 0.75, y: 0.25, weight: 0.25 },
      { x: 0.25, y: 0.75, weight: 1 },
      { x: 9, y: 9, weight: 1 },
    ];
    expect([...boundaryImage({ width: 2, height: 1 }, faces)]).toEqual([1.5, 0]);
  });
});

describe('cross-sections', () => {
  test('of a ball are a circle with a plane, and two points with a line', () => {
    const ball = Mesh.icosphere({ center: [0, 0, 0], radius: 10, maxEdge: 1 });
    const cut = crossSection(surfaceOf(ball), { origin: [0, 0, 3], normal: [0, 0, 1] });
    expect(cut.length).toBeGreaterThan(6 * 20);
    for (let i = 0; i < cut.length; i += 3) {
      expect(cut[i + 2]).toBeCloseTo(3, 4);
      expect(Math.hypot(cut[i] ?? 0, cut[i + 1] ?? 0)).toBeCloseTo(Math.sqrt(91), 0);
    }
    const flat = Float32Array.from({ length: (cut.length / 3) * 2 }, (_, i) => cut[3 * (i >> 1) + (i % 2)] ?? 0);
    const [left, right, ...more] = intersectionsWithRow(flat, 0.1);
    expect(more).toEqual([]);
    expect(left).toBeCloseTo(-Math.sqrt(91), 0);
    expect(right).toBeCloseTo(Math.sqrt(91), 0);
    ball.free();
  });

  test('filter the boundary votes near the surface', () => {
    const ball = Mesh.icosphere({ center: [0, 0, 0], radius: 10, maxEdge: 1 });
    const votes = { frame: 0, points: Float32Array.of(10, 0, 0, 0, 0, 0), weights: Float32Array.of(0.5, 1) };
    expect([...votesNear(votes, surfaceOf(ball), 2).weights]).toEqual([0.5]);
    ball.free();
  });
});

describe('boxes', () => {
  test('in voxels are exact if the image is aligned with the world', () => {
    const affine = [2, 0, 0, 0, 0, -2, 0, 0, 0, 0, 5, 0, 7, 8, 9, 1];
    const region = { low: [3, 0, 4], high: [20, 11, 9] } as Parameters<typeof boxOf>[0];
    expect(voxelsOf(boxOf(region, affine), invert(affine), [30, 30, 12])).toEqual(region);
  });

  test('and if it is oblique', () => {
    const c = Math.SQRT1_2;
    const affine = [c, c, 0, 0, -c, c, 0, 0, 0, 0, 3, 0, 1, 2, 3, 1];
    const region = { low: [10, 20, 5], high: [29, 39, 9] } as Parameters<typeof boxOf>[0];
    const found = voxelsOf(boxOf(region, affine), invert(affine), [60, 60, 20]);
    expect(found).toEqual(region);
  });
});

describe('links', () => {
  const view = viewOf(IMAGES[0]);

  test('omit default settings', () => {
    const setup = setupOf(IMAGES[0]);
    expect(toHash(linkOf({ example: IMAGES[0], file: '', setup, view }))).toBe('#track');
    expect(fromHash('#track')).toBeUndefined();
    expect(fromHash('#sculpt?example=globe')).toBeUndefined();
  });

  test('restore all settings', () => {
    const example = IMAGES[1];
    const setup = {
      ...setupOf(example),
      preparation: { binning: 2 as const, enrichment: 'linear' as const, factor: 3 },
      box: { min: [1, 2, 3] as [number, number, number], max: [4, 5, 6.5] as [number, number, number] },
      at: undefined,
      params: { threshold: 42, prediction: false },
    };
    const linked = fromHash(
      toHash(linkOf({ example, file: '', setup, view: { ...view, below: 'time', edges: true, votes: 'all' } })),
    );
    expect(linked?.example).toBe(example?.id);
    expect(setupOf(example, linked)).toEqual({ ...setup, params: { ...example?.params, ...setup.params } });
    expect(linked?.view).toEqual({ below: 'time', edges: true, votes: 'all' });
  });

  test('name invalid settings', () => {
    const invalid = ['binning=7', 'enrichment=magic', 'factor=-2', 'box=1,2', 'at=x', 'colour=red'];
    const linked = fromHash(`#track?${invalid.join('&')}&p.threshold=abc`);
    expect(linked).toEqual({ params: { threshold: 'abc' }, preparation: {}, view: {}, unread: invalid });
    expect(fromHash('#track?cavity=shut')?.cavity).toBeUndefined();
  });

  test('from before cavities could be closed leave them open; those of closed ones are read as they were', () => {
    const [example] = IMAGES;
    expect(setupOf(example, fromHash('#track?binning=2'))).not.toHaveProperty('cavity');
    const setup = { ...setupOf(undefined), cavity: 'closed' as const };
    const linked = fromHash(toHash(linkOf({ example: undefined, file: 'a.nii', setup, view: viewOf(undefined) })));
    expect(setupOf(undefined, linked)).toEqual(setup);
  });

  test('to the user’s own image say that it is tracked as a whole, unless the lab asks for the object', () => {
    const given = { example: undefined, file: 'a.nii', setup: setupOf(undefined), view: viewOf(undefined) };
    expect(toHash(linkOf({ ...given, asks: true }))).toBe('#track?file=a.nii');
    const linked = fromHash(toHash(linkOf(given)));
    expect(linked?.box).toBe('whole');
    expect(setupOf(undefined, linked)).toEqual(given.setup);
    expect(fromHash('#track?box=whole&at=largest')).toMatchObject({ box: 'whole', at: 'largest' });
  });
});

describe('images', () => {
  const named = (...names: string[]) => names.map((name) => ({ name, bytes: new Uint8Array() }));

  test('from several files are frames in the order of their names, headers with their data', () => {
    const names = (files: string[]) => groupFiles(named(...files)).map((parts) => parts.map(({ name }) => name));
    expect(names(['f10.nii', 'f2.nii', 'f1.nii'])).toEqual([['f1.nii'], ['f2.nii'], ['f10.nii']]);
    expect(names(['b.raw', 'a.mhd', 'a.raw', 'b.mhd'])).toEqual([
      ['a.mhd', 'a.raw'],
      ['b.mhd', 'b.raw'],
    ]);
    expect(names(['voxels.raw', 'image.nhdr'])).toEqual([['image.nhdr', 'voxels.raw']]);
  });

  test('are assembled from their frames', async () => {
    const frame = (value: number) => {
      const volume = new Volume({ data: new Uint8Array(64).fill(value), dims: [4, 4, 4] });
      const bytes = volume.toNifti();
      volume.free();
      return bytes;
    };
    const files = [9, 7, 8].map((value) => ({ name: `frame-${value}.nii`, bytes: frame(value) }));
    const film = await openImage({ files });
    expect(film.frames).toBe(3);
    expect([0, 1, 2].map((index) => film.sample([1, 1, 1], index))).toEqual([7, 8, 9]);
    film.free();
  });

  test('of a single frame are refused before anything is computed', async () => {
    const still = new Volume({ data: new Uint8Array(64), dims: [4, 4, 4] });
    const files = [{ name: 'still.nii', bytes: still.toNifti() }];
    still.free();
    await expect(openImage({ files })).rejects.toThrow('through at least two frames, and this image has one.');
  });

  test('of small files are refused where slices between would take the memory of the page', () => {
    const image = { dims: [400, 400, 50] as [number, number, number], frames: 2 };
    const thick = { ...image, frames: 5, spacing: [1, 1, 16] as [number, number, number] };
    const flow = { binning: 1, enrichment: 'flow', factor: 0 } as const;
    const message = 'the image would have 120 million voxels; files of at most 128 KiB may have 67 million.';
    for (const preparation of [flow, { ...flow, factor: 3 }])
      expect(() => checkSmall(thick, preparation)).toThrow(message);
    for (const preparation of [
      { ...flow, binning: 2 },
      { ...flow, factor: 1 },
      { ...flow, enrichment: 'none' },
    ] as const)
      checkSmall(thick, preparation);
    checkSmall({ ...thick, spacing: [1, 1, 2] }, flow);
  });

  test('are binned and enriched with slices as requested', async () => {
    const film = Volume.parse(new Uint8Array(await readFile(at('www/public/data/heart.nii.gz'))));
    expect([...film.dims, film.frames]).toEqual([64, 64, 20, 20]);
    const told: string[] = [];
    const volume = prepare(film, { binning: 2, enrichment: 'linear', factor: 2 }, (what) => told.push(what));
    expect(volume.dims).toEqual([32, 32, 39]);
    expect(told).toHaveLength(2);
    expect(prepare(film, { binning: 1, enrichment: 'none', factor: 0 }, () => undefined)).toBe(film);
    volume.free();
    film.free();
  });

  test('have a slice between two others that is sharper with optical flow', () => {
    // A bright disc that moves sideways from one slice to the next.
    const disc = (x: number, y: number, z: number) => (Math.hypot(x - 13 - 3 * z, y - 16) < 7 ? 200 : 40);
    const data = Float32Array.from({ length: 32 * 32 * 3 }, (_, i) => disc(i % 32, Math.floor(i / 32) % 32, i >> 10));
    const volume = new Volume({ data, dims: [32, 32, 3] });
    const { linear, flow, before, rmsError } = interpolateSlice(volume, 0, 1, [0, 255]);
    const half = (values: Uint8Array) => values.reduce((sum, v) => sum + (v > 80 && v < 160 ? 1 : 0), 0);
    expect(before[16 * 32 + 13]).toBe(200);
    expect(half(flow)).toBeLessThan(0.7 * half(linear));
    expect(rmsError.flow).toBeLessThan(0.9 * rmsError.linear);
    expect(() => interpolateSlice(volume, 0, 2, [0, 255])).toThrow(/neighbours/);
    volume.free();
  });
});

test("every figure has an id of its own, and states the paper's result and its own", () => {
  expect(new Set([...IMAGES, ...TRACK_PRESETS].map(({ id }) => id)).size).toBe(IMAGES.length + TRACK_PRESETS.length);
  for (const { paperResult, variants } of TRACK_PRESETS)
    for (const { ourResult } of variants) {
      for (const text of [paperResult, ourResult]) expect(text).toMatch(/^\S.{40,}\.$/);
      expect(ourResult).toMatch(/^Here/);
    }
});
