import { expect, test } from 'vitest';
import { LabelSurfaces, Mesh, paramSpecs, type Vec3, Volume } from '../../pkg/index.js';
import { ball, failure, noise, rejection } from './helpers.js';

const DIMS: Vec3 = [12, 10, 8];

/** Returns a label map of three blocks that touch, with labels 1, 2 and 300. */
function blocks(more: object = {}): Volume {
  const data = new Uint16Array(DIMS[0] * DIMS[1] * DIMS[2]);
  const label = (x: number, y: number) => (x < 6 ? 1 : y < 5 ? 2 : 300);
  for (let z = 1; z < 7; z++)
    for (let y = 1; y < 9; y++) for (let x = 1; x < 11; x++) data[x + DIMS[0] * (y + DIMS[1] * z)] = label(x, y);
  return new Volume({ data, dims: DIMS, ...more });
}

test('each label has a closed surface, in world space, that crosses no other', async () => {
  const volume = blocks({ spacing: [1, 2, 0.5], origin: [5, 0, -3], space: 'LPS' });
  const surfaces = new LabelSurfaces({ volume });
  expect(surfaces.labels).toEqual([1, 2, 300]);
  const report = await surfaces.run();
  expect([report.done, report.components, report.euler]).toEqual([true, 3, 6]);
  const meshes = surfaces.labels.map((label) => surfaces.mesh(label));
  expect(surfaces.mesh(2)).toBe(meshes[1]);
  for (const [index, mesh] of meshes.entries()) {
    expect(mesh.check()).toMatchObject({ closed: true, oriented: true, nonManifoldEdges: 0, selfIntersections: 0 });
    const voxels = volume.labels()[index]?.voxels ?? 0;
    expect(mesh.info().volume / voxels).toBeGreaterThan(0.97);
    expect(mesh.info().volume / voxels).toBeLessThan(1.001);
  }
  const all = meshes.map((mesh) => mesh.arrays());
  const positions = all.flatMap((mesh) => [...mesh.positions]);
  let start = 0;
  const indices = all.flatMap((mesh) => {
    const shifted = [...mesh.indices].map((index) => index + start);
    start += mesh.positions.length / 3;
    return shifted;
  });
  const joined = Mesh.fromArrays(Float32Array.from(positions), Uint32Array.from(indices));
  expect(joined.check()).toMatchObject({ closed: true, selfIntersections: 0 });
  surfaces.free();
  expect(failure(() => meshes[0]?.info()).code).toBe('freed');
  expect(failure(() => surfaces.labels).code).toBe('freed');
});

test('surfaces follow what is written to the volume, and live meshes show it', () => {
  const volume = blocks();
  using surfaces = new LabelSurfaces({ volume, smoothing: 10 });
  surfaces.step(20);
  const [one, version] = [surfaces.mesh(1), surfaces.mesh(1).topologyVersion];
  const region = { min: [2, 2, 2] as Vec3, dims: [2, 3, 2] as Vec3 };
  volume.write({ ...region, data: new Uint16Array(12).fill(7) });
  surfaces.refresh(region);
  expect(surfaces.labels).toEqual([1, 2, 7, 300]);
  expect(one.topologyVersion).toBeGreaterThan(version);
  expect(surfaces.step(5).done).toBe(true);
  // The new label lies in a cavity of the first.
  expect([one.info().components, surfaces.mesh(7).info().components]).toEqual([2, 1]);
  expect(one.check().selfIntersections).toBe(0);
  volume.write({ ...region, data: new Uint16Array(12).fill(1) });
  surfaces.refresh(region);
  expect(surfaces.labels).toEqual([1, 2, 300]);
  expect([one.info().components, surfaces.mesh(7).vertexCount]).toEqual([1, 0]);
});

test('versions of a mesh increase only when its own surface changes', () => {
  const dims: Vec3 = [60, 8, 8];
  const label = (x: number, y: number, z: number) =>
    y % 7 > 0 && z % 7 > 0 && x % 20 > 3 ? 1 + Math.floor(x / 20) : 0;
  const data = Uint8Array.from({ length: 60 * 64 }, (_, i) =>
    label(i % 60, Math.floor(i / 60) % 8, Math.floor(i / 480)),
  );
  const volume = new Volume({ data, dims });
  using surfaces = new LabelSurfaces({ volume });
  surfaces.step(50);
  const versions = () =>
    [1, 2, 3].map((value) => [surfaces.mesh(value).topologyVersion, surfaces.mesh(value).geometryVersion]);
  const sizes = () => [1, 2, 3].map((value) => [surfaces.mesh(value).vertexCount, surfaces.mesh(value).triangleCount]);
  const [before, size] = [versions(), sizes()];
  volume.write({ min: [10, 3, 3], dims: [2, 2, 2], data: new Uint8Array(8) });
  surfaces.refresh({ min: [10, 3, 3], dims: [2, 2, 2] });
  surfaces.step(50);
  const [after, other] = [versions(), sizes()];
  expect(after[0]?.every((version, i) => version > (before[0]?.[i] ?? version))).toBe(true);
  expect([after.slice(1), other.slice(1)]).toEqual([before.slice(1), size.slice(1)]);
  const arrays = surfaces.mesh(1).arrays();
  expect(other[0]).toEqual([arrays.positions.length / 3, arrays.indices.length / 3]);
  expect(other[0]?.[0]).toBeGreaterThan(size[0]?.[0] ?? 0);
});

test('a saved state continues with the same bits', () => {
  const volume = blocks();
  using surfaces = new LabelSurfaces({ volume, labels: [300, 1] });
  surfaces.setParams({ smoothing: 45 });
  surfaces.step();
  using other = new LabelSurfaces({ volume, labels: [1, 300] });
  other.restore(surfaces.save());
  expect(other.params).toEqual({ smoothing: 45, edge: 1 });
  for (const each of [surfaces, other]) each.step(9);
  for (const label of [1, 300]) expect(other.mesh(label).arrays()).toEqual(surfaces.mesh(label).arrays());
  expect(failure(() => other.restore(surfaces.save().slice(1))).code).toBe('bad-file');
});

test('bad input is named, and nothing changes', () => {
  const volume = blocks();
  using surfaces = new LabelSurfaces({ volume });
  const before = surfaces.save();
  const bad: [() => unknown, string][] = [
    [() => new LabelSurfaces({ volume: ball(8, 2), labels: [] }), 'labels'],
    [() => new LabelSurfaces({ volume, labels: [4] }), 'labels'],
    [() => new LabelSurfaces({ volume, labels: ['1'] as never }), 'labels'],
    [() => new LabelSurfaces({ volume, smoothing: -1 }), 'smoothing'],
    [() => new LabelSurfaces({ volume, colour: 'red' } as never), 'colour'],
    [() => new LabelSurfaces({ volume: new Volume({ data: Float32Array.of(1), dims: [1, 1, 1] }) }), 'volume'],
    [() => new LabelSurfaces({} as never), 'volume'],
    [() => surfaces.mesh(5), 'label'],
    [() => surfaces.mesh('1' as never), 'label'],
    [() => surfaces.refresh({ min: [0, 0, 7], dims: [1, 1, 2] }), 'region'],
    [() => surfaces.refresh({ min: [0, 0, 0.5], dims: [1, 1, 1] }), 'region.min'],
    [() => surfaces.refresh({ min: [0, 0, 0] } as never), 'region.dims'],
    [() => surfaces.setParams({ smoothing: 1000 }), 'smoothing'],
    [() => surfaces.setParams({ edge: 0.5 }), 'edge'],
    [() => new LabelSurfaces({ volume, edge: '2' as never }), 'edge'],
    [() => surfaces.step(0), 'iterations'],
  ];
  for (const [work, name] of bad) {
    const error = failure(work);
    expect([error.code, error.message.split(':')[0]]).toEqual(['invalid-argument', name]);
  }
  expect(surfaces.save()).toEqual(before);
  volume.free();
  expect(failure(() => surfaces.refresh({ min: [0, 0, 0], dims: [1, 1, 1] })).code).toBe('freed');
});

test('its parameters are described', () => {
  expect(paramSpecs('labels').map(({ name, default: value }) => [name, value])).toEqual([
    ['smoothing', 20],
    ['edge', 1],
  ]);
});

test('longer edges give fewer triangles, and the same voxels, also after a change', () => {
  const [side, radius] = [24, 9];
  const volume = ball(side, radius);
  const voxels = volume.intensities();
  const labels = Uint8Array.from(voxels, (value, i) => (value > 0 ? 1 + Number(i % side < side / 2) : 0));
  const map = new Volume({ data: labels, dims: [side, side, side] });
  using fine = new LabelSurfaces({ volume: map });
  using coarse = new LabelSurfaces({ volume: map, edge: 2 });
  const region = { min: [9, 9, 9] as Vec3, dims: [4, 4, 4] as Vec3 };
  for (const data of [undefined, new Uint8Array(64)]) {
    if (data) map.write({ ...region, data });
    for (const surfaces of [fine, coarse]) {
      if (data) surfaces.refresh(region);
      surfaces.step(10);
    }
    for (const { value, voxels } of map.labels()) {
      const [mesh, other] = [coarse.mesh(value), fine.mesh(value)];
      expect(mesh.triangleCount).toBeLessThan(0.5 * other.triangleCount);
      expect(mesh.check()).toMatchObject({ closed: true, selfIntersections: 0 });
      const mask = mesh.toVolume(map, { kind: 'mask' });
      expect([mask.dice(map.label(value), { label: 1 }), mask.labels()]).toEqual([1, [{ value: 1, voxels }]]);
    }
  }
  coarse.setParams({ edge: 1 });
  expect(coarse.mesh(1).arrays()).toEqual(fine.mesh(1).arrays());
});

test('they can be created in slices, with the same bits, and not if that is aborted', async () => {
  const volume = noise(16, 1);
  const whole = new LabelSurfaces({ volume });
  const sliced = await LabelSurfaces.create({ volume }, { budgetMs: 0.1 });
  expect(sliced).toBeInstanceOf(LabelSurfaces);
  expect(sliced.save()).toEqual(whole.save());
  const stop = new AbortController();
  // Runs only if the creation lets it.
  setTimeout(() => stop.abort(new Error('enough')));
  const options = { signal: stop.signal, budgetMs: 0.1 };
  await expect(LabelSurfaces.create({ volume }, options)).rejects.toThrow('enough');
  await expect(LabelSurfaces.create({ volume }, options)).rejects.toThrow('enough');
  const error = await rejection(LabelSurfaces.create({ volume, smoothing: -1 }));
  expect([error.code, error.message]).toEqual(['invalid-argument', expect.stringContaining('smoothing')]);
  expect((await rejection(LabelSurfaces.create({ volume }, { budget: 1 } as object))).message).toContain('budget');
});

test('a run that is aborted within a step leaves surfaces on which nothing is half done', async () => {
  const volume = noise(16, 1);
  const [whole, sliced] = [new LabelSurfaces({ volume }), new LabelSurfaces({ volume })];
  const reports: number[] = [];
  const stop = new AbortController();
  setTimeout(() => stop.abort(new Error('enough')));
  const onStep = () => reports.push(1);
  await expect(sliced.run({ signal: stop.signal, budgetMs: 0.1, onStep })).rejects.toThrow('enough');
  expect(reports).toEqual([]);
  // The step that was under way ends when someone looks.
  whole.step();
  expect(sliced.mesh(1).check()).toMatchObject({ closed: true, oriented: true, selfIntersections: 0 });
  expect(sliced.save()).toEqual(whole.save());
  expect((await sliced.run()).done).toBe(true);
  await whole.run();
  expect(sliced.save()).toEqual(whole.save());
});
