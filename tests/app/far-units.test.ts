/** Computations on the page with data far from the origin of world space: the same as beside the origin. */
import { beforeAll, describe, expect, test, vi } from 'vitest';
import startReaders, { parseVolume } from '../../pkg/import/index.js';
import init, { Mesh, Volume } from '../../pkg/index.js';
import { literal } from '../../www/src/engine/literal';
import { originOf, placed, relativeTo, shortened } from '../../www/src/engine/placing';
import type { Surface, Vec3 } from '../../www/src/engine/protocol';
import { fileOf } from '../../www/src/engine/volumes';
import { place } from '../../www/src/kit/format';
import { initialOptions } from '../../www/src/kit/view';
import { fromHash, linkOf, toHash } from '../../www/src/labs/extract/link';
import { EXTRACT_VIEW } from '../../www/src/labs/extract/view';
import * as cloudLink from '../../www/src/labs/reconstruct/link';
import { applyEdits } from '../../www/src/labs/reconstruct/model';
import { distances } from '../../www/src/labs/reconstruct/nearest';
import { CLOUD_VIEW } from '../../www/src/labs/reconstruct/view';
import { deformSurface } from '../../www/src/labs/sculpt/deform';
import { ball, moved } from '../../www/src/labs/sculpt/ellipsoids';
import { fitted } from '../../www/src/labs/sculpt/fit';
import * as sculptLink from '../../www/src/labs/sculpt/link';
import { SCULPT_VIEW } from '../../www/src/labs/sculpt/view';
import { toGlb } from '../../www/src/labs/segment/glb';
import { regionEdges } from '../../www/src/labs/track/region';
import { votesNear } from '../../www/src/labs/track/votes';
import { invert, sliceOrientations } from '../../www/src/scene/anatomy';
import { crossSection } from '../../www/src/scene/cross-section';
import { projectSegments } from '../../www/src/scene/slicing';
import { ballPoints, FAR } from './far';

beforeAll(async () => {
  await init();
  await startReaders();
});

const add = (one: Vec3, other: Vec3) => one.map((value, axis) => value + (other[axis] ?? 0)) as Vec3;

function surfaceOf(mesh: Mesh): Surface {
  const { positions, normals, indices } = mesh.arrays({ relative: true });
  const counts = { vertices: positions.length / 3, triangles: indices.length / 3 };
  return { positions, normals, indices, ...counts, origin: mesh.origin };
}

/** The methods of a browser that the writer of GLB calls. */
class BlobReader {
  result: ArrayBuffer | undefined;
  onloadend: () => void = () => undefined;

  readAsArrayBuffer(blob: Blob): void {
    void blob.arrayBuffer().then((result) => {
      this.result = result;
      this.onloadend();
    });
  }
}

/** The largest difference of two lists of numbers. */
const off = (one: ArrayLike<number>, other: ArrayLike<number>) =>
  Math.max(...Array.from(one, (value, i) => Math.abs(value - (other[i] ?? Number.NaN))));

describe('points are drawn relative to an origin', () => {
  test('that is 0 beside the origin of world space, where the array is the same', () => {
    const near = Float32Array.from(ballPoints([3, -20, 60], 5, 1));
    expect(placed(near)).toEqual({ points: near, origin: [0, 0, 0] });
    expect(placed(near).points).toBe(near);
    expect(originOf([])).toEqual([0, 0, 0]);
    expect(originOf([Number.POSITIVE_INFINITY, 0, 0])).toEqual([0, 0, 0]);
  });

  test('that is near them where they are far away, and the package has the same', () => {
    const points = ballPoints(FAR, 5, 1);
    const { origin, points: drawn } = placed(points);
    expect(Math.max(...drawn.map(Math.abs))).toBeLessThan(20);
    expect(
      off(
        Array.from(drawn, (value, i) => value + (origin[i % 3] ?? 0)),
        points,
      ),
    ).toBeLessThan(1e-6);
    expect(Mesh.icosphere({ center: FAR, radius: 5, maxEdge: 1 }).origin).toEqual(
      originOf([...add(FAR, [-5, -5, -5]), ...add(FAR, [5, 5, 5])]),
    );
    expect(off(placed(FAR).points, [0, 0, 0])).toBeLessThan(1);
  });
});

describe('a surface far away', () => {
  // Twice as long as wide.
  const egg = ([x, y, z]: Vec3) => {
    const { positions, indices } = Mesh.icosphere({ center: [0, 0, 0], radius: 5, maxEdge: 0.5 }).arrays();
    const place = (value: number, i: number) => (i % 3 === 0 ? x + 2 * value : value + (i % 3 === 1 ? y : z));
    return Mesh.fromArrays(Float64Array.from(positions, place), indices);
  };
  const near = () => egg([0.5, 0.25, 0.125]);
  const far = () => egg(add(FAR, [0.5, 0.25, 0.125]));

  test('has the same cross-sections, and the same outlines on slices', () => {
    const plane = (at: Vec3) => ({ origin: add(at, [0, 0, 1.03]), normal: [0, 0.6, 0.8] as Vec3 });
    const [one, other] = [
      crossSection(surfaceOf(near()), plane([0, 0, 0])),
      crossSection(surfaceOf(far()), plane(FAR)),
    ];
    expect(one).toBeInstanceOf(Float32Array);
    expect(off(relativeTo(FAR, other), one)).toBeLessThan(1e-4);
    const grid = (at: Vec3) => ({
      ...{ dims: [20, 20, 20] as Vec3, spacing: [1, 1, 1] as Vec3, space: 'RAS' as const },
      affine: Float64Array.of(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, ...at, 1),
    });
    const drawn = ([at, section]: readonly [Vec3, ArrayLike<number>]) => {
      const [axial] = sliceOrientations(grid(at)).slice(2);
      if (!axial) throw new Error('no orientation');
      return projectSegments(section, invert(grid(at).affine), grid(at), axial);
    };
    expect(off(drawn([FAR, other]), drawn([[0, 0, 0], one]))).toBeLessThan(1e-4);
  });

  test('is moved by dragged ellipsoids, and has ellipsoids fitted, as beside the origin', () => {
    const pose = (at: Vec3) => [moved(ball(-2, 0, 0, 2), at), moved(ball(2, 0, 0, 2), at)];
    const dragged = (at: Vec3) => [moved(ball(-2, 0, 1, 2), at), moved(ball(2, 0, 0, 2.5), at)];
    const [one, other] = [surfaceOf(near()), surfaceOf(far())];
    const moves = [
      deformSurface(one, pose([0, 0, 0]), dragged([0, 0, 0])),
      deformSurface(other, pose(FAR), dragged(FAR)),
    ] as const;
    const inWorld = (positions: Float32Array, origin: Vec3) =>
      Array.from(positions, (value, i) => value + (origin[i % 3] ?? 0));
    expect(off(relativeTo(FAR, inWorld(moves[1], other.origin)), moves[0])).toBeLessThan(1e-4);
    const [here, there] = [near(), far()].map((mesh) => fitted(mesh).map(({ center }) => center));
    // The row may begin at either end.
    const sorted = (centres: Vec3[] = []) => centres.sort((a, b) => a[0] - b[0]).flat();
    expect(off(relativeTo(FAR, sorted(there)), sorted(here))).toBeLessThan(1e-2);
  });

  test('has the same distances from points, and boundary votes near it', () => {
    const mesh = far();
    const points = ballPoints(FAR, 6, 0.5);
    const found = distances(surfaceOf(mesh).positions, relativeTo(mesh.origin, points));
    const expected = distances(surfaceOf(near()).positions, relativeTo(FAR, points));
    expect(off(found, expected)).toBeLessThan(1e-3);
    const at = (x: number) => add(FAR, [x, 0, 0]);
    const votes = { frame: 0, points: Float64Array.from([...at(10.5), ...at(0.5)]), weights: Float32Array.of(0.5, 1) };
    const kept = votesNear(votes, surfaceOf(mesh), 1);
    expect([...kept.weights]).toEqual([0.5]);
    expect([...kept.points]).toEqual(at(10.5));
  });

  test('keeps its place in a GLB of labels', async () => {
    vi.stubGlobal('FileReader', BlobReader);
    const surface = surfaceOf(far());
    const label = { value: 1, name: 'one', color: '#ff0000', visible: true };
    for (const [given, space, unit] of [
      [{}, undefined, undefined],
      [{ space: 'LPS', unit: 'mm' }, 'LPS', 'mm'],
      [{ space: 'RAS' }, 'RAS', undefined],
    ] as const) {
      const mesh = Mesh.parse(await toGlb([label], new Map([[1, surface]]), [], given));
      expect(off(mesh.info().centroid, far().info().centroid)).toBeLessThan(1e-4);
      expect([mesh.space, mesh.unit]).toEqual([space, unit]);
    }
  });
});

test('edges of a region, and points with edits, keep double precision', () => {
  const affine = Float64Array.of(0.1, 0, 0, 0, 0, 0.1, 0, 0, 0, 0, 0.1, 0, ...FAR, 1);
  const edges = regionEdges({ low: [1, 1, 1], high: [3, 3, 3] }, affine);
  expect(edges.slice(0, 3)).toEqual(add(FAR, [0.05, 0.05, 0.05]));
  const points = ballPoints(FAR, 5, 2);
  const edited = applyEdits(points, { added: [FAR], removed: [0], outside: [] });
  expect(edited).toEqual(Float64Array.of(...points.subarray(3), ...FAR));
  expect(literal(edited.subarray(0, 3))).toBe(`new Float64Array([${points.subarray(3, 6).join(', ')}])`);
});

test('a volume far away is saved as NRRD, whose numbers are exact', () => {
  const data = Float32Array.from({ length: 24 }, (_, i) => Math.sin(i));
  const volume = (origin: Vec3) =>
    new Volume({ data, dims: [2, 3, 4], spacing: [0.1, 0.2, 0.3], origin, space: 'LPS' });
  const { extension, bytes } = fileOf(volume(FAR));
  expect(extension).toBe('nrrd');
  const { affine, dims, space, ...read } = parseVolume(bytes);
  expect({ affine, dims, space }).toEqual({ affine: volume(FAR).affine, dims: [2, 3, 4], space: 'LPS' });
  expect(read.data).toEqual(data);
  expect(fileOf(volume([0.1, 100.3, -20.7])).extension).toBe('nii');
});

describe('coordinates as text', () => {
  test('have few digits beside the origin, and far away as many decimals as say as much', () => {
    expect(shortened(12.34567, 4, 10)).toBe(12.35);
    expect(shortened(159.9996, 4, 10)).toBe(160);
    expect(shortened(5_405_590.456123, 4, 10)).toBe(5_405_590.456);
    expect(shortened(5_405_590.456, 4, 1e7)).toBe(5_406_000);
    expect(shortened(5_405_590.456, 6, 0)).toBe(5_405_590);
    expect(place(FAR, 10)).toBe('500000.123, 5405590.456, 350.789');
    expect(place([1, 20.03, -5.1234], 10)).toBe('1, 20.03, -5.123');
  });

  test('are kept in links', () => {
    const clicked = add(FAR, [0.000123456, 0.25, -0.25]);
    const cloud = {
      ...{ example: undefined, file: 'survey.xyz', choice: { maxPoints: undefined, keepComponents: undefined } },
      ...{ params: {}, defaults: {}, size: 17, view: initialOptions(CLOUD_VIEW), photo: undefined },
    };
    const edits = { added: [clicked], removed: [3], outside: [FAR] };
    const read = cloudLink.fromHash(cloudLink.toHash(cloudLink.linkOf({ ...cloud, edits })));
    expect(off(read?.edits.added.flat() ?? [], clicked)).toBeLessThan(1e-5);
    expect(read?.edits.outside).toEqual([FAR]);
    const settings = {
      ...{
        example: undefined,
        file: 'survey.nrrd',
        frame: 0,
        params: {},
        defaults: {},
        view: initialOptions(EXTRACT_VIEW),
      },
      choice: { kind: 'sphere', bubbles: 5, levels: 1, edge: undefined } as const,
      sphere: { center: clicked, radius: 1 },
      attractors: [{ point: FAR, strength: 0.1, radius: 2 }],
    };
    const volume = fromHash(toHash(linkOf(settings)));
    expect(off(volume?.sphere?.center ?? [], clicked)).toBeLessThan(1e-5);
    expect(volume?.attractors).toEqual(settings.attractors);
    const pose = [moved(ball(0, 0, 0, 3), clicked)];
    const scene = {
      ...{ example: undefined, file: 'house.obj', params: {}, usual: {}, film: undefined },
      ...{ support: 'membrane' as const, start: [] },
    };
    const hash = sculptLink.toHash(sculptLink.linkOf({ ...scene, pose, view: initialOptions(SCULPT_VIEW) }));
    expect(off(sculptLink.fromHash(hash)?.pose?.[0]?.center ?? [], clicked)).toBeLessThan(1e-3);
  });
});
