// Data far from the origin of world space, such as surveyed coordinates: nothing is rounded without a word.
import vtkDataArray from '@kitware/vtk.js/Common/Core/DataArray.js';
import vtkImageData from '@kitware/vtk.js/Common/DataModel/ImageData.js';
import vtkPolyData from '@kitware/vtk.js/Common/DataModel/PolyData.js';
import vtkActor from '@kitware/vtk.js/Rendering/Core/Actor.js';
import * as THREE from 'three';
import { describe, expect, test } from 'vitest';
import { NiivueSurface } from '../../pkg/adapters/niivue.js';
import { ThreeSurface } from '../../pkg/adapters/three.js';
import { VtkLabelSurfaces, VtkSurface } from '../../pkg/adapters/vtk.js';
import {
  animationGlb,
  DeformableModel,
  ImplicitSurface,
  LabelSurfaces,
  Mesh,
  type MeshFormat,
  MultiresolutionModel,
  parsePoints,
  type Vec3,
  Volume,
} from '../../pkg/index.js';
import init, * as worker from '../../pkg/worker.js';
import { failure, HEALTHY, rejection, wrong } from './helpers.js';

/** Metres of a UTM zone, in Bavaria. */
const UTM: Vec3 = [512434, 5405590, 348];
const far = (radius = 5, edge = 1) => Mesh.icosphere({ center: UTM, radius, maxEdge: edge });

/** Points on a ball of 2 m around `UTM`, packed. */
function surveyed(count: number): Float64Array {
  const points = new Float64Array(3 * count);
  for (let i = 0; i < count; i++) {
    const z = 1 - (2 * (i + 0.5)) / count;
    const [turn, ring] = [Math.PI * (3 - Math.sqrt(5)) * i, Math.sqrt(1 - z * z)];
    points.set([UTM[0] + 2 * ring * Math.cos(turn), UTM[1] + 2 * ring * Math.sin(turn), UTM[2] + 2 * z], 3 * i);
  }
  return points;
}

const distance = (a: ArrayLike<number>, b: ArrayLike<number>) =>
  Math.hypot(...[0, 1, 2].map((k) => (a[k] ?? 0) - (b[k] ?? 0)));

describe('a mesh', () => {
  test('near the origin has none of its own, and its arrays are in world space', () => {
    const mesh = Mesh.icosphere({ center: [30, 0, 0], radius: 2, maxEdge: 1 });
    expect(mesh.origin).toEqual([0, 0, 0]);
    const { origin, ...relative } = mesh.arrays({ relative: true });
    expect(origin).toEqual([0, 0, 0]);
    expect(relative).toEqual(mesh.arrays());
  });

  test('far away is measured, remeshed, smoothed, cut and decimated as one that is near', () => {
    const mesh = far();
    expect(distance(mesh.origin, UTM)).toBeLessThan(20);
    mesh.remesh({ min: 0.3, max: 0.7 });
    mesh.smooth({ iterations: 5 });
    mesh.decimate(3000);
    const { volume, centroid, bounds } = mesh.info();
    expect(volume / ((4 / 3) * Math.PI * 125)).toBeCloseTo(1, 1);
    expect(distance(centroid, UTM)).toBeLessThan(0.02);
    expect(distance(bounds.min, [UTM[0] - 5, UTM[1] - 5, UTM[2] - 5])).toBeLessThan(0.2);
    expect(mesh.check()).toEqual(HEALTHY);
    mesh.cut({ origin: UTM, normal: [0, 0, 1] });
    expect(mesh.info().volume / volume).toBeCloseTo(0.5, 2);
  });

  test('whose edges single precision would bend gives arrays relative to its origin only', () => {
    const mesh = far();
    const error = failure(() => mesh.arrays());
    expect(error.code).toBe('precision');
    expect(error.message).toContain('relative');
    expect(failure(() => mesh.crossSection(UTM, [0, 0, 1])).code).toBe('precision');
    const { positions, origin } = mesh.arrays({ relative: true });
    expect(origin).toEqual(mesh.origin);
    const first = Array.from(positions.slice(0, 3), (x, k) => x + (origin?.[k] ?? 0));
    expect(distance(first, UTM)).toBeCloseTo(5, 5);
    const section = mesh.crossSection(UTM, [0, 0, 1], { relative: true });
    expect(section.length).toBeGreaterThan(60);
    const hit = mesh.pick([UTM[0], UTM[1], UTM[2] + 100], [0, 0, -1]);
    expect(hit?.point[2]).toBeCloseTo(UTM[2] + 5, 1);
    expect([...mesh.contains(Float64Array.of(...UTM, UTM[0] + 9, UTM[1], UTM[2]))]).toEqual([1, 0]);
  });

  test('of single precision is given back as it came', () => {
    const positions = Float32Array.of(5e6, 5e6, 0, 5e6 + 4, 5e6, 0, 5e6, 5e6 + 4, 0, 5e6, 5e6, 4);
    const mesh = Mesh.fromArrays(positions, Uint32Array.of(0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3));
    expect(mesh.arrays().positions).toEqual(positions);
    expect(mesh.info().volume).toBeCloseTo(32 / 3, 6);
  });

  test.each(['glb', 'ply', 'obj'] as MeshFormat[])('keeps its millimetres in %s', (format) => {
    const mesh = far();
    const read = Mesh.parse(mesh.toBytes(format));
    expect(read.distanceTo(mesh).hausdorff).toBeLessThan(1e-5);
    expect(read.info().centroid).toEqual(mesh.info().centroid.map((x) => expect.closeTo(x, 5)));
  });

  test('is not rounded into a file of single precision, unless it may be recentred', () => {
    const mesh = far();
    for (const format of ['stl', 'mz3'] as const) {
      expect(failure(() => mesh.toBytes(format)).code).toBe('precision');
    }
    const recentred = Mesh.parse(mesh.toBytes('stl', { recentre: true }));
    expect(Math.hypot(...recentred.info().centroid)).toBeLessThan(20);
    expect(recentred.info().volume).toBeCloseTo(mesh.info().volume, 3);
    const point = `(point ${mesh.origin.join(' ')})`;
    for (const format of ['stl', 'ply', 'obj', 'vtp', 'glb'] as const) {
      const text = new TextDecoder().decode(mesh.toBytes(format, { recentre: true }));
      expect(text).toContain(format === 'stl' ? `warnings: recentred ${point} ` : point);
      if (format !== 'stl')
        expect(text).toContain(`The surface was moved by ${mesh.origin.map((x) => -x).join(', ')}.`);
      const plain = format === 'stl' ? far().toBytes('ply') : mesh.toBytes(format);
      expect(new TextDecoder().decode(plain)).not.toContain('recentred');
    }
    expect(new TextDecoder().decode(mesh.toBytes('vtp'))).toContain('type="Float64" Name="Points"');
  });

  test('is transformed, compared and animated in double precision', () => {
    const near = Mesh.icosphere({ center: [0, 0, 0], radius: 5, maxEdge: 1 });
    near.transform([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, ...UTM, 1]);
    expect(near.distanceTo(far()).hausdorff).toBeLessThan(1e-5);
    const node = new TextDecoder().decode(animationGlb([near, far(4)])).match(/"translation":\[[^\]]*\]/g);
    expect(node).toHaveLength(2);
  });
});

describe('a volume', () => {
  test('keeps its place in NIfTI to double precision, in a file of version 2 if that is needed', () => {
    for (const [origin, side, version] of [
      [[512345.678, 5401234.567, 123.456], 0.01, 540],
      [[1e7 + 0.25, 0, 0], 0.1, 540],
      [[100.3, -80.2, 40], 1, 348],
    ] as [Vec3, number, number][]) {
      const volume = new Volume({ data: new Uint8Array(512), dims: [8, 8, 8], origin, spacing: [side, side, side] });
      const bytes = volume.toNifti();
      expect(new DataView(bytes.buffer).getInt32(0, true)).toBe(version);
      const { affine } = Volume.parse(bytes);
      const limit = version === 540 ? 0 : side / 1000;
      expect(affine.every((x, k) => Math.abs(x - (volume.affine[k] ?? 0)) <= limit)).toBe(true);
    }
  });
});

test('points in double precision are not rounded to find whether they are inside', () => {
  const faces = [
    0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5,
  ];
  for (const size of [1, 1e6, 1e7]) {
    const corners = Array.from({ length: 24 }, (_, i) => (((i / 3) >> (i % 3)) & 1) * size);
    const cube = Mesh.fromArrays(new Float64Array(corners), new Uint32Array(faces));
    const above = [-0.25, -0.02, 0.02, 0.25].map((d) => (d * size) / 1e7);
    const points = above.flatMap((d) => [size / 3, size / 5, size + d]);
    expect([...cube.contains(new Float64Array(points))], `${size}`).toEqual([1, 1, 0, 0]);
  }
});

describe('points', () => {
  test('of a survey are read in double precision, and others as before', () => {
    const text = (points: ArrayLike<number>) =>
      new TextEncoder().encode(Array.from(points, (x, i) => `${x}${i % 3 === 2 ? '\n' : ' '}`).join(''));
    const all = surveyed(40);
    const { points } = parsePoints(text(all));
    expect(points).toBeInstanceOf(Float64Array);
    expect(points.every((x, i) => Math.abs(x - (all[i] ?? 0)) < 1e-6)).toBe(true);
    expect(parsePoints(text([0, 1, 2, 3, 4, 5])).points).toBeInstanceOf(Float32Array);
  });

  test('become a surface where they are', () => {
    const surface = new ImplicitSurface({ points: surveyed(200), params: { cell: 0.3 } });
    while (!surface.step(50).done);
    const { volume, centroid } = surface.mesh.info();
    expect(volume / ((4 / 3) * Math.PI * 8)).toBeCloseTo(1, 1);
    expect(distance(centroid, UTM)).toBeLessThan(0.01);
    const [value = 0] = surface.evaluate(Float64Array.from(UTM));
    expect(value).toBeGreaterThan(0);
    const { surface: used } = surface.constraints();
    const all = surveyed(200);
    const nearest = Math.min(
      ...Array.from({ length: 200 }, (_, k) => distance(used.subarray(0, 3), all.subarray(3 * k))),
    );
    expect(nearest).toBeLessThan(1e-4);
    surface.setEdits({ added: Float64Array.of(UTM[0], UTM[1], UTM[2] + 2.2) });
    expect(distance(surface.edits.added, [UTM[0], UTM[1], UTM[2] + 2.2])).toBeLessThan(1e-6);
    const grid = surface.toVolume([20, 20, 20]);
    expect(grid.sample(UTM)).toBeGreaterThan(0);
    expect(distance(Mesh.marchingCubes(grid, 0).info().centroid, UTM)).toBeLessThan(0.02);
  });
});

test.each([1, 0.1])('volumes at voxels of %d give surfaces where they are', (s) => {
  const dims: Vec3 = [14, 15, 16];
  const data = Float32Array.from({ length: 14 * 15 * 16 }, (_, i) => {
    const at = [i % 14, Math.floor(i / 14) % 15, Math.floor(i / 210)];
    return 5 - Math.hypot((at[0] ?? 0) - 6.5, (at[1] ?? 0) - 7, (at[2] ?? 0) - 7.5);
  });
  const placed = { dims, origin: UTM, spacing: [s, s, s] as Vec3 };
  const volume = new Volume({ ...placed, data });
  const middle = [UTM[0] + 6.5 * s, UTM[1] + 7 * s, UTM[2] + 7.5 * s];
  const model = new DeformableModel({ volume, params: { iso: 0 } });
  while (!model.step(20).done);
  const labels = new LabelSurfaces({
    volume: new Volume({ ...placed, data: Uint8Array.from(data, (x) => Number(x > 0)) }),
  });
  while (!labels.step(20).done);
  for (const mesh of [Mesh.marchingCubes(volume, 0), model.mesh, labels.mesh(1)]) {
    const { volume: enclosed, centroid, components, genus } = mesh.info();
    expect(enclosed / ((4 / 3) * Math.PI * (5 * s) ** 3)).toBeCloseTo(1, 1);
    expect(distance(centroid, middle)).toBeLessThan(0.02 * s);
    expect([components, genus]).toEqual([1, 0]);
    expect(mesh.check()).toEqual(HEALTHY);
  }
});

test('a seed given in double precision is where it was put', () => {
  const spacing: Vec3 = [1, 1, 1];
  const volume = new Volume({ data: new Uint8Array(8 ** 3), dims: [8, 8, 8], spacing, origin: UTM });
  const seed = UTM.map((value) => value + 3.3);
  const start = { seeds: Float64Array.from(seed), radius: 2 };
  const model = new DeformableModel({ volume, params: { iso: 1 }, start });
  expect(distance(model.mesh.info().centroid, seed)).toBeLessThan(1e-3);
});

test('a lamp far away keeps its volume', () => {
  const at = (center: Vec3) =>
    new MultiresolutionModel({
      ellipsoids: [
        {
          center,
          axes: [
            [2, 0, 0],
            [0, 1, 0],
            [0, 0, 1],
          ],
        },
      ],
    });
  const [near, away] = [at([0, 0, 0]), at([1e6, -1e6, 0])];
  for (const model of [near, away]) for (let i = 0; i < 30 && !model.step().done; i++);
  expect(away.mesh.info().volume / near.mesh.info().volume).toBeCloseTo(1, 4);
  expect(away.ellipsoids[0]?.center).toEqual([1e6, -1e6, 0]);
  expect(distance(away.baseMesh.info().centroid, [1e6, -1e6, 0])).toBeLessThan(0.01);
});

const newActor = (): { setPosition(x: number, y: number, z: number): void; getPosition(): Vec3 } =>
  wrong(vtkActor.newInstance());

describe('in other software', () => {
  test('three.js gets the origin as the position of the object', () => {
    const object = new THREE.Mesh();
    const surface = new ThreeSurface(THREE, object);
    surface.update(far());
    expect(object.position.toArray()).toEqual(far().origin);
    expect(object.geometry.boundingSphere?.radius).toBeLessThan(30);
    const lps = new ThreeSurface(THREE, object, { space: 'RAS', worldSpace: 'LPS' });
    lps.update(far());
    expect(object.position.x).toBe(-far().origin[0]);
    surface.update(Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1 }));
    expect(object.position.toArray()).toEqual([0, 0, 0]);
  });

  test('vtk.js gets it as the position of an actor, without which it is refused', () => {
    // The declarations of vtk.js lack some of its own members.
    const classes = { vtkPolyData: wrong(vtkPolyData), vtkDataArray: wrong(vtkDataArray) };
    const refusal = failure(() => new VtkSurface(classes).update(far()));
    expect(refusal).toMatchObject({ code: 'precision', message: expect.stringMatching(/give the `actor`/) });
    const actor = newActor();
    new VtkSurface(classes, { actor }).update(far());
    expect(actor.getPosition()).toEqual(far().origin);
  });

  test('vtk.js gets actors for the surfaces of a label map, without which it is refused', () => {
    const classes = {
      ...{ Volume, LabelSurfaces },
      vtkPolyData: wrong(vtkPolyData),
      vtkDataArray: wrong(vtkDataArray),
    };
    const image = wrong(vtkImageData.newInstance({ spacing: [0.1, 0.1, 0.1], origin: [...UTM] }));
    image.setDimensions(8, 8, 8);
    const values = Uint8Array.from({ length: 512 }, (_, i) => ([2, 3, 4].includes(i % 8) && i > 99 && i < 400 ? 1 : 0));
    image.getPointData().setScalars(vtkDataArray.newInstance({ values }));
    expect(failure(() => new VtkLabelSurfaces(classes, image)).code).toBe('precision');
    const actors = new Map<number, ReturnType<typeof newActor>>();
    const actorOf = (label: number) => actors.set(label, newActor()).get(label) as ReturnType<typeof newActor>;
    const surfaces = new VtkLabelSurfaces(classes, image, { actorOf });
    expect([...actors.keys()]).toEqual([1]);
    expect(actors.get(1)?.getPosition()).toEqual(surfaces.mesh(1).origin);
    expect(distance(surfaces.mesh(1).info().centroid, UTM)).toBeLessThan(1);
    surfaces.dispose();
  });

  test('NiiVue, which draws in world space, refuses it or shows it recentred, with a warning', async () => {
    const meshes: { positions: Float32Array }[] = [];
    const nv = { addMesh: (mesh: never) => meshes.push(mesh), removeMesh: () => {}, meshes, view: {} };
    const error = await rejection(new NiivueSurface(nv, { outline: 0 }).update(far()));
    expect(error).toMatchObject({ code: 'precision', message: expect.stringMatching(/the option `recentre`/) });
    const surface = new NiivueSurface(nv, { outline: 0, recentre: true });
    await surface.update(far());
    expect(Math.max(...(meshes[0]?.positions ?? []))).toBeLessThan(50);
    expect(surface.warnings).toMatchObject([{ code: 'recentred', where: { point: far().origin } }]);
    await surface.dispose();
    expect(surface.warnings).toEqual([]);
  });

  test('NiiVue 1.0 gets a mesh anew when it is recentred or no longer, since its view keeps its centre', async () => {
    const meshes: object[] = [];
    const removeMesh = (index: number) => meshes.splice(index, 1);
    const nv = wrong({ addMesh: (mesh: object) => meshes.push(mesh), removeMesh, meshes, view: {} });
    const surface = new NiivueSurface(nv, { outline: 0, recentre: true });
    const shown = [];
    for (const mesh of [far(), far(), far(3), Mesh.icosphere({ center: [0, 0, 0], radius: 5, maxEdge: 1 })]) {
      await surface.update(mesh);
      expect(meshes.length).toBe(1);
      shown.push(meshes[0]);
    }
    expect(shown[1]).toBe(shown[0]);
    expect(shown[3]).not.toBe(shown[2]);
  });

  test('NiiVue shows no recentred mesh beside a volume that is far away, since its view would be empty', async () => {
    const nv = (offset: Vec3) => {
      const affine = [0, 1, 2].map((row) =>
        [0, 1, 2, 3].map((k) => (k === 3 ? (offset[row] ?? 0) : Number(k === row))),
      );
      const volumes = [{ hdr: { dims: [3, 20, 20, 20], affine } }];
      return { addMesh: () => {}, removeMesh: () => {}, meshes: [], view: {}, volumes };
    };
    const beside = new NiivueSurface(nv(UTM), { outline: 0, recentre: true });
    for (let i = 0; i < 2; i++) expect((await rejection(beside.update(far()))).message).toMatch(/has a volume far/);
    expect(beside.warnings).toEqual([]);
    expect(await new NiivueSurface(nv([100, -80, 40]), { outline: 0, recentre: true }).update(far())).toBe(true);
  });

  test('a worker gives the same', async () => {
    await init();
    const mesh = await worker.Mesh.icosphere({ center: UTM, radius: 5, maxEdge: 1 });
    expect(await mesh.origin).toEqual(far().origin);
    expect((await rejection(mesh.arrays())).code).toBe('precision');
    expect(await mesh.arrays({ relative: true })).toEqual(far().arrays({ relative: true }));
    const out = { positions: new Float32Array(), normals: new Float32Array(), indices: new Uint32Array() };
    await mesh.copyTo(out, { relative: true });
    expect(out).toEqual(far().arrays({ relative: true }));
    worker.terminate();
  });
});
