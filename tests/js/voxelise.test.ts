// Mesh.toVolume, contains, smooth and transform.
import { expect, test } from 'vitest';
import { DeformableModel, Mesh, Volume } from '../../pkg/index.js';
import { ball, failure, HEALTHY } from './helpers.js';

const sphere = (radius: number, edge: number) => Mesh.icosphere({ center: [0, 0, 0], radius, maxEdge: edge });

/** Returns an empty volume of `size`³ voxels of side `spacing`, centred at the world's origin. */
function grid(size: number, spacing = 1): Volume {
  const origin = (-(size - 1) / 2) * spacing;
  return new Volume({
    data: new Uint8Array(size ** 3),
    dims: [size, size, size],
    spacing: [spacing, spacing, spacing],
    origin: [origin, origin, origin],
    space: 'LPS',
  });
}

/** Returns the world positions of the voxel centres of `grid`, packed. */
function centers(size: number, spacing: number): Float32Array {
  const at = (index: number) => (index - (size - 1) / 2) * spacing;
  const points: number[] = [];
  for (let z = 0; z < size; z++) {
    for (let y = 0; y < size; y++) for (let x = 0; x < size; x++) points.push(at(x), at(y), at(z));
  }
  return Float32Array.from(points);
}

const sum = (values: Float32Array) => values.reduce((total, value) => total + value, 0);

test('a mask is on the grid of the volume, and contains the centres that the mesh contains', () => {
  const [mesh, like] = [sphere(3, 0.5), grid(20, 0.5)];
  const mask = mesh.toVolume(like);
  expect([mask.dims, mask.spacing, mask.space, mask.frames]).toEqual([[20, 20, 20], [0.5, 0.5, 0.5], 'LPS', 1]);
  expect(mask.affine).toEqual(like.affine);
  const inside = mesh.contains(centers(20, 0.5));
  expect(mask.intensities()).toEqual(Float32Array.from(inside));
  expect(sum(mask.intensities()) / (((4 / 3) * Math.PI * 27) / 0.125)).toBeCloseTo(1, 1);
  expect(mesh.contains(new Float32Array())).toEqual(new Uint8Array());
});

test('the value of a mask', () => {
  const mesh = sphere(2, 1);
  for (const value of [1, 255, 256, 65_536, 4_294_967_295]) {
    expect(mesh.toVolume(grid(6), { value }).range).toEqual([0, value]);
  }
});

test('coverage sums to the enclosed volume', () => {
  const mesh = sphere(3, 0.5);
  const coverage = mesh.toVolume(grid(16, 0.5), { kind: 'coverage' });
  expect(coverage.range).toEqual([0, 1]);
  expect((sum(coverage.intensities()) * 0.125) / mesh.info().volume).toBeCloseTo(1, 4);
});

test('distances are signed, in world units', () => {
  const distances = sphere(3, 0.2).toVolume(grid(21, 0.5), { kind: 'distance' });
  for (const at of [0, 1, 2.5, 4, 5]) {
    expect(distances.sample([at, 0, 0])).toBeCloseTo(at - 3, 1);
  }
});

test('a mesh from a mask has the same mask', () => {
  const mask = sphere(6, 1).toVolume(grid(20));
  const again = Mesh.marchingCubes(mask, 0.5).toVolume(mask);
  expect(again.intensities()).toEqual(mask.intensities());
});

test('smoothing removes noise, keeps the volume and adds no self-intersections', () => {
  const { positions, indices } = sphere(5, 0.5).arrays();
  const rough = (mesh: Mesh) => {
    const { positions } = mesh.arrays();
    let squares = 0;
    for (let at = 0; at < positions.length; at += 3) {
      squares += (Math.hypot(...positions.subarray(at, at + 3)) - 5) ** 2;
    }
    return Math.sqrt((3 * squares) / positions.length);
  };
  const mesh = Mesh.fromArrays(
    positions.map((value, at) => value + 0.1 * Math.sin(at * at)),
    indices,
  );
  const [volume, noise] = [mesh.info().volume, rough(mesh)];
  mesh.smooth({ iterations: 10 });
  expect(rough(mesh)).toBeLessThan(0.4 * noise);
  expect(mesh.info().volume / volume).toBeCloseTo(1, 5);
  expect(mesh.check()).toEqual(HEALTHY);
  const version = mesh.geometryVersion;
  mesh.smooth({ iterations: 1, keepVolume: false });
  expect(mesh.geometryVersion).toBeGreaterThan(version);
});

/** Scales by -1, 2 and 1, and moves along z. */
const MIRROR = Float64Array.from([-1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1, 0, 0, 0, 7, 1]);

test('transforms: a reflection stays outward, for lists and editable meshes', () => {
  const list = Mesh.parse(sphere(2, 0.5).toBytes('ply'));
  const editable = sphere(2, 0.5);
  for (const mesh of [list, editable]) {
    const before = mesh.info();
    const [topology, geometry] = [mesh.topologyVersion, mesh.geometryVersion];
    mesh.transform(MIRROR);
    const after = mesh.info();
    expect(after.volume / before.volume).toBeCloseTo(2, 4);
    expect(after.bounds.min[2]).toBeCloseTo(5, 1);
    expect(mesh.check()).toEqual(HEALTHY);
    expect(mesh.topologyVersion).toBeGreaterThan(topology);
    expect(mesh.geometryVersion).toBeGreaterThan(geometry);
    const { positions, normals } = mesh.arrays();
    for (let at = 0; at < positions.length; at += 3) {
      const [x, y, z] = positions.subarray(at, at + 3) as unknown as [number, number, number];
      const [a, b, c] = normals.subarray(at, at + 3) as unknown as [number, number, number];
      expect(x * a + y * b + (z - 7) * c).toBeGreaterThan(0.9);
    }
  }
  const version = list.geometryVersion;
  list.refine();
  expect(list.geometryVersion).toBeGreaterThan(version);
});

test('a transform keeps texture coordinates', () => {
  const { positions, indices } = sphere(1, 1).arrays();
  const uvs = Float32Array.from({ length: (2 * positions.length) / 3 }, (_, at) => at / 64);
  const mesh = Mesh.fromArrays(positions, indices, { uvs });
  mesh.transform(MIRROR);
  expect(mesh.arrays().uvs).toEqual(uvs);
});

test('invalid arguments are named, and change nothing', () => {
  const mesh = sphere(2, 1);
  const { positions } = mesh.arrays();
  const like = grid(4);
  const refused = (work: () => unknown, text: string) =>
    expect(failure(work)).toMatchObject({ code: 'invalid-argument', message: expect.stringContaining(text) });
  refused(() => mesh.transform([...MIRROR.slice(0, 15)]), 'matrix');
  refused(() => mesh.transform(MIRROR.with(3, 1)), 'matrix: must have the last row');
  refused(() => mesh.transform(MIRROR.with(0, 0)), 'matrix: must be invertible');
  refused(() => mesh.transform(MIRROR.with(0, Number.NaN)), 'matrix');
  refused(() => mesh.transform(MIRROR.with(0, 1e39)), 'matrix: moves vertex');
  refused(() => mesh.smooth({ iterations: -1 }), 'iterations');
  refused(() => mesh.smooth({ iterations: 10_001 }), 'iterations');
  refused(() => mesh.smooth({ iterations: 1, keepVolume: 1 as unknown as boolean }), 'keepVolume');
  refused(() => mesh.contains(new Float32Array(4)), 'points');
  refused(() => mesh.contains(Float32Array.of(0, 0, Number.NaN)), 'points');
  refused(() => mesh.toVolume(mesh as unknown as Volume), 'like');
  refused(() => mesh.toVolume(like, { kind: 'sdf' as 'mask' }), 'kind');
  refused(() => mesh.toVolume(like, { value: 0 }), 'value');
  refused(() => mesh.toVolume(like, { value: 1.5 }), 'value');
  refused(() => mesh.toVolume(like, { kind: 'coverage', value: 2 }), 'value');
  expect(mesh.arrays().positions).toEqual(positions);
});

test('open meshes have no inside, and the mesh of a model is read-only', () => {
  const open = Mesh.fromArrays(Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0]), Uint32Array.from([0, 1, 2]));
  for (const work of [
    () => open.toVolume(grid(4)),
    () => open.contains(new Float32Array(3)),
    () => open.smooth({ iterations: 1 }),
  ]) {
    expect(failure(work).code).toBe('not-closed');
  }
  open.transform(MIRROR);
  const model = new DeformableModel({ volume: ball(12, 4), params: { iso: 100 } });
  expect(failure(() => model.mesh.transform(MIRROR)).message).toContain('clone()');
  expect(failure(() => model.mesh.smooth({ iterations: 1 })).message).toContain('clone()');
  expect(model.mesh.toVolume(grid(12)).range).toEqual([0, 1]);
  model.free();
});
