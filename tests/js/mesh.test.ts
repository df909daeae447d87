import { describe, expect, test } from 'vitest';
import { Mesh, type MeshArrays, type MeshFormat } from '../../pkg/index.js';
import { ball, failure, HEALTHY, wrong } from './helpers.js';

const sphere = (radius = 1, edge = 0.2) => Mesh.icosphere({ center: [0, 0, 0], radius, maxEdge: edge });

/** A tetrahedron with a corner at the origin; without its last face it is open. */
const CORNERS = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]);
const FACES = Uint32Array.from([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]);
const open = () => Mesh.fromArrays(CORNERS, FACES.slice(0, 9));

/** Returns two meshes as one, the second moved along x. */
function joined(a: MeshArrays, b: MeshArrays, shift: number): Mesh {
  const moved = b.positions.map((value, index) => (index % 3 === 0 ? value + shift : value));
  const first = a.positions.length / 3;
  return Mesh.fromArrays(
    Float32Array.from([...a.positions, ...moved]),
    Uint32Array.from([...a.indices, ...b.indices.map((index) => index + first)]),
  );
}

test('an iso value that no surface has gives none, or the border of the image, with a warning', () => {
  const volume = ball(8, 3);
  const [low, high] = volume.range;
  for (const iso of [low - 1, high + 1]) {
    const mesh = Mesh.marchingCubes(volume, iso);
    const text = expect.stringContaining(`${low} to ${high}`);
    expect(mesh.warnings).toEqual([{ code: 'no-boundary', text }]);
    expect(mesh.vertexCount > 0).toBe(iso < low);
  }
  expect(Mesh.marchingCubes(volume, (low + high) / 2).warnings).toEqual([]);
});

test('an icosphere is a sphere', () => {
  const mesh = sphere(2, 0.2);
  const info = mesh.info();
  expect(info).toMatchObject({ components: 1, euler: 2, genus: 0, vertices: mesh.vertexCount });
  expect(info.triangles).toBe(mesh.triangleCount);
  expect(info.area / (16 * Math.PI)).toBeCloseTo(1, 1);
  expect(info.volume / ((32 / 3) * Math.PI)).toBeCloseTo(1, 1);
  expect(info.edge.max).toBeLessThanOrEqual(0.2);
  expect(info.inertia).toHaveLength(9);
  expect(mesh.check()).toEqual(HEALTHY);
});

test('arrays: outward unit normals, indices in range, no absent attributes', () => {
  const { positions, normals, indices, ...rest } = sphere().arrays();
  expect(rest).toEqual({});
  expect(Math.max(...indices)).toBe(positions.length / 3 - 1);
  for (let at = 0; at < positions.length; at += 3) {
    const [x, y, z] = positions.subarray(at, at + 3) as unknown as [number, number, number];
    const [a, b, c] = normals.subarray(at, at + 3) as unknown as [number, number, number];
    expect(Math.hypot(a, b, c)).toBeCloseTo(1, 5);
    expect(x * a + y * b + z * c).toBeGreaterThan(0.99);
  }
});

test('copyTo keeps buffers that are long enough', () => {
  const mesh = sphere();
  const out = mesh.arrays();
  const room = { ...out, positions: new Float32Array(out.positions.length + 10), indices: new Uint32Array(3) };
  const { positions, normals, indices } = room;
  const counts = mesh.copyTo(room);
  expect(counts).toEqual({ vertices: mesh.vertexCount, triangles: mesh.triangleCount });
  expect(room.positions).toBe(positions);
  expect(room.normals).toBe(normals);
  expect(room.indices).not.toBe(indices);
  expect(room.positions.subarray(0, out.positions.length)).toEqual(out.positions);
  expect(room.indices).toEqual(out.indices);
});

describe('snapshots', () => {
  test('have room, which is not much, and seldom changes while a mesh grows', () => {
    const lengths = new Set<number>();
    for (let triangles = 1; triangles <= 400; triangles++) {
      const indices = Uint32Array.from({ length: 3 * triangles }, (_, corner) => corner % 3);
      const snapshot = Mesh.fromArrays(CORNERS, indices).snapshot();
      expect(snapshot).toMatchObject({ triangles, vertices: 4, origin: [0, 0, 0] });
      expect(snapshot.indices.length).toBeLessThanOrEqual(1.25 * 3 * triangles + 3);
      expect(snapshot.indices.subarray(0, 3 * triangles)).toEqual(indices);
      lengths.add(snapshot.indices.length);
    }
    expect(lengths.size).toBeLessThan(30);
  });

  test('use arrays again that are long enough, and not much too long', () => {
    const mesh = sphere();
    const first = mesh.snapshot();
    expect(first.positions.subarray(0, 3 * first.vertices)).toEqual(mesh.arrays().positions);
    const second = mesh.snapshot(first);
    expect([second.positions, second.normals, second.indices]).toEqual([first.positions, first.normals, first.indices]);
    expect(second.positions).toBe(first.positions);
    const finer = mesh.clone();
    finer.refine();
    const third = finer.snapshot(second);
    expect(third.positions).not.toBe(second.positions);
    expect(third.indices.subarray(0, 3 * third.triangles)).toEqual(finer.arrays().indices);
    finer.refine();
    finer.refine();
    expect(mesh.snapshot(finer.snapshot()).positions.length).toBe(first.positions.length);
  });

  test('have colours and texture coordinates, with room', () => {
    const uvs = Float32Array.from([0, 0, 1, 0, 0, 1, 1, 1]);
    const colors = CORNERS.map((x) => x / 2);
    const snapshot = Mesh.fromArrays(CORNERS, FACES, { uvs, colors }).snapshot();
    expect(snapshot.uvs?.subarray(0, 8)).toEqual(uvs);
    expect(snapshot.colors?.subarray(0, 12)).toEqual(colors);
    expect(snapshot.colors?.length).toBe(snapshot.positions.length);
  });

  test('are relative to an origin if that is asked for', () => {
    const mesh = Mesh.icosphere({ center: [1e6, 0, 0], radius: 1, maxEdge: 0.5 });
    const { positions, origin } = mesh.snapshot({}, { relative: true });
    expect(origin).toEqual(mesh.origin);
    expect(positions.subarray(0, 3 * mesh.vertexCount)).toEqual(mesh.arrays({ relative: true }).positions);
  });

  test('of wrong properties are refused', () => {
    expect(failure(() => sphere().snapshot({ values: 1 } as never)).message).toContain('values');
  });
});

test('from arrays, with texture coordinates', () => {
  const uvs = Float32Array.from([0, 0, 1, 0, 0, 1, 1, 1]);
  const mesh = Mesh.fromArrays(CORNERS, FACES, { uvs });
  expect(mesh.info().volume).toBeCloseTo(1 / 6, 6);
  expect(mesh.check()).toEqual(HEALTHY);
  const arrays = mesh.arrays();
  expect(arrays.positions).toEqual(CORNERS);
  expect(arrays.indices).toEqual(FACES);
  expect(arrays.uvs).toEqual(uvs);
});

test('an open mesh is accepted, reported, and refused if a closed one is needed', () => {
  expect(open().check()).toMatchObject({ closed: false, oriented: true });
  expect(failure(() => open().refine()).code).toBe('not-closed');
});

test('self-intersections are counted', () => {
  const tetrahedron = Mesh.fromArrays(CORNERS, FACES).arrays();
  expect(joined(tetrahedron, tetrahedron, 0.25).check().selfIntersections).toBeGreaterThan(0);
  expect(joined(tetrahedron, tetrahedron, 2).check().selfIntersections).toBe(0);
});

test('components', () => {
  const tetrahedron = Mesh.fromArrays(CORNERS, FACES).arrays();
  const parts = joined(tetrahedron, tetrahedron, 5).components();
  expect(parts.map((part) => part.triangleCount)).toEqual([4, 4]);
  expect(parts.map((part) => part.info().bounds.min[0])).toEqual([0, 5]);
});

test('refining triples the triangles and increases versions', () => {
  const mesh = sphere();
  const [triangles, topology, geometry] = [mesh.triangleCount, mesh.topologyVersion, mesh.geometryVersion];
  mesh.refine();
  expect(mesh.triangleCount).toBe(3 * triangles);
  expect(mesh.topologyVersion).toBeGreaterThan(topology);
  expect(mesh.geometryVersion).toBeGreaterThan(geometry);
  expect(mesh.check()).toEqual(HEALTHY);
});

/** Returns a torus about z with `along` × `around` vertices. */
function torus(around: number, along: number): Mesh {
  const positions: number[] = [];
  const indices: number[] = [];
  const at = (i: number, j: number) => (i % around) * along + (j % along);
  for (let i = 0; i < around; i++) {
    for (let j = 0; j < along; j++) {
      const [u, v] = [(2 * Math.PI * i) / around, (2 * Math.PI * j) / along];
      const ring = 3 + Math.cos(v);
      positions.push(ring * Math.cos(u), ring * Math.sin(u), Math.sin(v));
      indices.push(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  return Mesh.fromArrays(Float32Array.from(positions), Uint32Array.from(indices));
}

test('decimation reaches the target and keeps the shape', () => {
  for (const [mesh, euler] of [
    [sphere(1, 0.1), 2],
    [torus(60, 30), 0],
    [Mesh.marchingCubes(ball(24, 8), 100), 2],
  ] as const) {
    const before = mesh.info();
    const [topology, geometry] = [mesh.topologyVersion, mesh.geometryVersion];
    const target = mesh.triangleCount / 4 + 0.9;
    mesh.decimate(target);
    expect(target - mesh.triangleCount).toBeLessThan(2);
    expect(mesh.triangleCount).toBeLessThanOrEqual(target);
    expect(mesh.check()).toEqual(HEALTHY);
    expect(mesh.info().euler).toBe(euler);
    expect(mesh.info().volume / before.volume).toBeCloseTo(1, 2);
    expect(mesh.topologyVersion).toBeGreaterThan(topology);
    expect(mesh.geometryVersion).toBeGreaterThan(geometry);
  }
});

test('decimation: a target already met, one out of reach, and open meshes', () => {
  const uvs = Float32Array.from([0, 0, 1, 0, 0, 1, 1, 1]);
  const mesh = Mesh.fromArrays(CORNERS, FACES, { uvs });
  for (const target of [4, 5, 1e12]) mesh.decimate(target);
  expect(mesh.arrays()).toMatchObject({ positions: CORNERS, indices: FACES, uvs });
  expect(mesh.topologyVersion).toBe(0);
  const small = sphere();
  small.decimate(1);
  expect(small.triangleCount).toBe(4);
  for (const target of [1, 2, 3, 1000]) expect(failure(() => open().decimate(target)).code).toBe('not-closed');
});

test('decimation within a distance, which is that of both surfaces', () => {
  const before = sphere(1, 0.1);
  const counts = [0.003, 0.01, 0.03].map((maxDistance) => {
    const mesh = before.clone();
    mesh.decimateWithin(maxDistance);
    expect(mesh.check()).toEqual(HEALTHY);
    expect(mesh.distanceTo(before).hausdorff).toBeLessThanOrEqual(maxDistance * 1.000001);
    return mesh.triangleCount;
  });
  expect(counts).toEqual([...counts].sort((a, b) => b - a));
  expect(counts[2]).toBeLessThan(before.triangleCount / 4);
  const mesh = before.clone();
  mesh.decimateWithin(1, { targetTriangles: before.triangleCount / 2 });
  expect(mesh.triangleCount / before.triangleCount).toBeCloseTo(0.5, 2);
  for (const distance of [0, 1]) expect(failure(() => open().decimateWithin(distance)).code).toBe('not-closed');
});

test('remeshing: even triangles, the shape kept', () => {
  for (const [mesh, euler] of [
    [sphere(2, 0.2), 2],
    [torus(120, 20), 0],
  ] as const) {
    const before = mesh.clone();
    const [topology, geometry] = [mesh.topologyVersion, mesh.geometryVersion];
    mesh.remesh({ min: 0.2, max: 0.45 });
    expect(mesh.check()).toEqual(HEALTHY);
    const { edge, minAngleDegrees, euler: after, components } = mesh.info();
    expect([after, components]).toEqual([euler, 1]);
    expect(edge.mean).toBeGreaterThan(0.2);
    expect(edge.max).toBeLessThanOrEqual(0.45 * 1.000001);
    expect(minAngleDegrees).toBeGreaterThan(25);
    expect(mesh.distanceTo(before).hausdorff).toBeLessThan(0.15);
    expect(mesh.topologyVersion).toBeGreaterThan(topology);
    expect(mesh.geometryVersion).toBeGreaterThan(geometry);
  }
});

test('remeshing: open meshes and results too large are refused and unchanged', () => {
  expect(failure(() => open().remesh({ min: 0.1, max: 0.3 })).code).toBe('not-closed');
  const mesh = sphere();
  const before = mesh.arrays();
  expect(failure(() => mesh.remesh({ min: 1e-7, max: 1e-6 })).code).toBe('too-large');
  expect(mesh.arrays()).toEqual(before);
});

test('decimation, refining and remeshing drop texture coordinates', () => {
  const edits = [
    (mesh: Mesh) => mesh.decimate(100),
    (mesh: Mesh) => mesh.refine(),
    (mesh: Mesh) => mesh.remesh({ min: 0.2, max: 0.5 }),
  ];
  for (const edit of edits) {
    const { positions, indices } = sphere().arrays();
    const mesh = Mesh.fromArrays(positions, indices, { uvs: new Float32Array((2 * positions.length) / 3) });
    edit(mesh);
    expect(mesh.arrays().uvs).toBeUndefined();
  }
});

test('curvature of a ball, of a cavity and of a torus', () => {
  const { positions, indices } = sphere(2, 0.2).arrays();
  const cavity = Mesh.fromArrays(positions, indices.slice().reverse());
  for (const [mesh, sign] of [
    [sphere(2, 0.2), 1],
    [cavity, -1],
  ] as const) {
    const [mean, gaussian] = [mesh.curvature('mean'), mesh.curvature('gaussian')];
    expect([mean.length, gaussian.length]).toEqual([mesh.vertexCount, mesh.vertexCount]);
    for (const h of mean) expect(h * sign).toBeCloseTo(0.5, 2);
    for (const k of gaussian) expect(k).toBeCloseTo(0.25, 1);
  }
  const k = torus(120, 40).curvature('gaussian');
  expect(k[0]).toBeCloseTo(1 / 4, 2);
  expect(k[10]).toBeCloseTo(0, 2);
  expect(k[20]).toBeCloseTo(-1 / 2, 2);
});

test('geodesic distance: great circles, other components, straight lines', () => {
  const mesh = sphere(1, 0.1);
  const { positions } = mesh.arrays();
  const distances = mesh.geodesic(3);
  expect(distances).toHaveLength(mesh.vertexCount);
  const [x, y, z] = positions.subarray(9, 12) as unknown as [number, number, number];
  distances.forEach((distance, v) => {
    const [a, b, c] = positions.subarray(3 * v, 3 * v + 3) as unknown as [number, number, number];
    const arc = Math.acos(Math.min(1, Math.max(-1, a * x + b * y + c * z)));
    expect(Math.abs(distance - arc)).toBeLessThan(0.05);
    expect(distance).toBeGreaterThanOrEqual(Math.hypot(a - x, b - y, c - z) - 1e-6);
  });
  const tetrahedron = Mesh.fromArrays(CORNERS, FACES).arrays();
  expect([...joined(tetrahedron, tetrahedron, 5).geodesic(4)].slice(0, 5)).toEqual([
    Infinity,
    Infinity,
    Infinity,
    Infinity,
    0,
  ]);
});

test('distance between concentric spheres, to itself, and in the other direction', () => {
  const [inner, outer] = [sphere(1, 0.1), sphere(1.5, 0.15)];
  const { perVertex, ...there } = inner.distanceTo(outer);
  const { perVertex: other, ...back } = outer.distanceTo(inner);
  expect(perVertex).toBeInstanceOf(Float32Array);
  expect([perVertex.length, other.length]).toEqual([inner.vertexCount, outer.vertexCount]);
  expect(there).toEqual(back);
  expect(Object.keys(there).sort()).toEqual(['hausdorff', 'mean', 'p95', 'rms']);
  for (const distance of [...perVertex, ...Object.values(there)]) expect(distance).toBeCloseTo(0.5, 2);
  expect(there.mean).toBeLessThanOrEqual(there.rms);
  expect(there.p95).toBeLessThanOrEqual(there.hausdorff);
  expect(inner.distanceTo(inner)).toEqual({
    perVertex: new Float32Array(inner.vertexCount),
    mean: 0,
    rms: 0,
    p95: 0,
    hausdorff: 0,
  });
});

test('distance to and from an empty mesh', () => {
  const nothing = Mesh.fromArrays(new Float32Array(), new Uint32Array());
  for (const [mesh, other, named] of [
    [sphere(), nothing, 'other'],
    [nothing, sphere(), 'mesh'],
  ] as const) {
    const error = failure(() => mesh.distanceTo(other));
    expect(error.code).toBe('invalid-argument');
    expect(error.message).toContain(named);
  }
  expect(nothing.curvature('mean')).toEqual(new Float32Array());
  expect(failure(() => nothing.geodesic(0)).message).toContain('fromVertex');
});

test('a clone is independent', () => {
  const mesh = sphere();
  const copy = mesh.clone();
  mesh.refine();
  expect(mesh.triangleCount).toBe(3 * copy.triangleCount);
  mesh.free();
  expect(copy.check()).toEqual(HEALTHY);
});

test('marching cubes of a ball', () => {
  const mesh = Mesh.marchingCubes(ball(24, 8), 100);
  expect(mesh.check()).toEqual(HEALTHY);
  const { volume, euler, centroid } = mesh.info();
  expect(euler).toBe(2);
  expect(volume / ((4 / 3) * Math.PI * 8 ** 3)).toBeCloseTo(1, 1);
  for (const coordinate of centroid) expect(coordinate).toBeCloseTo(0, 3);
});

test('picking', () => {
  const hit = sphere(1, 0.1).pick([5, 0.01, 0.02], [-3, 0, 0]);
  expect(hit?.point[0]).toBeCloseTo(1, 2);
  expect(hit?.distance).toBeCloseTo(4, 2);
  expect(hit?.barycentric.reduce((sum, weight) => sum + weight)).toBeCloseTo(1, 5);
  expect(sphere().pick([5, 0, 0], [1, 0, 0])).toBeUndefined();
});

test('a cross-section is as long as the circle it approximates', () => {
  const segments = sphere(1, 0.05).crossSection([0, 0, 0.1], [0, 0, 2]);
  let length = 0;
  for (let at = 0; at < segments.length; at += 6) {
    const [ax, ay, az, bx, by, bz] = segments.subarray(at, at + 6) as unknown as number[] & { length: 6 };
    length += Math.hypot((ax as number) - (bx as number), (ay as number) - (by as number));
    expect(az).toBeCloseTo(0.1, 5);
    expect(bz).toBeCloseTo(0.1, 5);
  }
  expect(length / (2 * Math.PI * Math.sqrt(0.99))).toBeCloseTo(1, 2);
});

test.each(['glb', 'ply', 'stl', 'obj'] as const)('%s: written and read back', (format) => {
  const mesh = Mesh.marchingCubes(ball(16, 5), 100);
  const back = Mesh.parse(mesh.toBytes(format));
  expect(back.check()).toEqual(HEALTHY);
  expect(back.vertexCount).toBe(mesh.vertexCount);
  expect(back.triangleCount).toBe(mesh.triangleCount);
  expect(back.info().volume).toBeCloseTo(mesh.info().volume, 2);
});

test('vtp: the arrays are in the file', () => {
  const text = new TextDecoder().decode(sphere().toBytes('vtp'));
  expect(text).toContain('type="PolyData"');
  expect(text).toContain(`NumberOfPoints="${sphere().vertexCount}"`);
  expect(text).toContain(`NumberOfPolys="${sphere().triangleCount}"`);
});

test('mz3: magic number, counts, arrays', () => {
  const mesh = sphere();
  const bytes = mesh.toBytes('mz3');
  const view = new DataView(bytes.buffer, bytes.byteOffset);
  expect(view.getUint16(0, true)).toBe(0x5a4d);
  expect(view.getUint32(4, true)).toBe(mesh.triangleCount);
  expect(view.getUint32(8, true)).toBe(mesh.vertexCount);
  const skip = view.getUint32(12, true);
  expect(bytes.length).toBeGreaterThanOrEqual(16 + skip + 12 * (mesh.triangleCount + mesh.vertexCount));
});

const REFUSED: [string, string, () => unknown][] = [
  ['no centre', 'center', () => Mesh.icosphere({ center: wrong(undefined), radius: 1, maxEdge: 1 })],
  ['no sphere', 'sphere', () => Mesh.icosphere(wrong(undefined))],
  ['a misspelled option', 'edge', () => Mesh.icosphere(wrong({ center: [0, 0, 0], radius: 1, edge: 1 }))],
  ['a radius of 0', 'radius', () => Mesh.icosphere({ center: [0, 0, 0], radius: 0, maxEdge: 1 })],
  ['NaN for an edge', 'maxEdge', () => Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: Number.NaN })],
  ['plain numbers', 'positions', () => Mesh.fromArrays(wrong([0, 0, 0]), FACES)],
  ['half a vertex', 'positions', () => Mesh.fromArrays(CORNERS.slice(1), FACES)],
  [
    'NaN for a position',
    'positions',
    () =>
      Mesh.fromArrays(
        CORNERS.map(() => Number.NaN),
        FACES,
      ),
  ],
  ['half a triangle', 'indices', () => Mesh.fromArrays(CORNERS, FACES.slice(1))],
  ['an index too far', 'indices', () => Mesh.fromArrays(CORNERS, Uint32Array.of(0, 1, 4))],
  ['too few texture coordinates', 'uvs', () => Mesh.fromArrays(CORNERS, FACES, { uvs: new Float32Array(6) })],
  ['a misspelled extra', 'uv', () => Mesh.fromArrays(CORNERS, FACES, wrong({ uv: CORNERS }))],
  ['no volume', 'volume', () => Mesh.marchingCubes(wrong({}), 1)],
  ['no iso value', 'iso', () => Mesh.marchingCubes(ball(4, 1), wrong(undefined))],
  ['a frame too far', 'frame', () => Mesh.marchingCubes(ball(4, 1), 1, { frame: 1 })],
  ['a ray to nowhere', 'direction', () => sphere().pick([0, 0, 0], [0, 0, 0])],
  ['a plane without normal', 'normal', () => sphere().crossSection([0, 0, 0], [0, 0, 0])],
  ['half a triangle as a target', 'targetTriangles', () => sphere().decimate(0.5)],
  ['no triangle as a target', 'targetTriangles', () => sphere().decimate(0)],
  ['less than none as a target', 'targetTriangles', () => sphere().decimate(-4)],
  ['NaN as a target', 'targetTriangles', () => sphere().decimate(Number.NaN)],
  ['no target', 'targetTriangles', () => sphere().decimate(wrong(undefined))],
  ['a distance below 0', 'maxDistance', () => sphere().decimateWithin(-1)],
  ['an infinite distance', 'maxDistance', () => sphere().decimateWithin(Number.POSITIVE_INFINITY)],
  ['half a triangle within a distance', 'targetTriangles', () => sphere().decimateWithin(1, { targetTriangles: 0.5 })],
  ['a lower bound of 0', 'edge.min', () => sphere().remesh({ min: 0, max: 1 })],
  ['a lower bound below 0', 'edge.min', () => sphere().remesh({ min: -1, max: 1 })],
  ['NaN as a lower bound', 'edge.min', () => sphere().remesh({ min: Number.NaN, max: 1 })],
  ['no upper bound', 'edge.max', () => sphere().remesh(wrong({ min: 1 }))],
  ['an endless upper bound', 'edge.max', () => sphere().remesh({ min: 1, max: Number.POSITIVE_INFINITY })],
  ['bounds too near each other', 'edge.max', () => sphere().remesh({ min: 1, max: 2 })],
  ['bounds too near each other when rounded', 'edge', () => sphere().remesh({ min: 1, max: 2 + 1e-12 })],
  ['bounds of another name', 'least', () => sphere().remesh(wrong({ least: 1, max: 3 }))],
  ['a number as bounds', 'edge', () => sphere().remesh(wrong(1))],
  ['no bounds', 'edge', () => sphere().remesh(wrong(undefined))],
  ['another curvature', 'kind', () => sphere().curvature(wrong('principal'))],
  ['half a vertex as a start', 'fromVertex', () => sphere().geodesic(0.5)],
  ['a vertex too far', 'fromVertex', () => sphere().geodesic(sphere().vertexCount)],
  ['a vertex below none', 'fromVertex', () => sphere().geodesic(-1)],
  ['no other mesh', 'other', () => sphere().distanceTo(wrong({}))],
  ['another format', 'format', () => sphere().toBytes('fbx' as MeshFormat)],
  ['new', 'Mesh', () => new (wrong(Mesh))()],
];

test.each(REFUSED)('%s is refused, naming %s', (_, parameter, work) => {
  const error = failure(work);
  expect(error.code).toBe('invalid-argument');
  expect(error.message).toContain(parameter);
});

test('invalid files are refused', () => {
  const whole = sphere().toBytes('glb');
  const broken = [new Uint8Array(), new TextEncoder().encode('not a mesh'), whole.slice(0, 30), whole.slice(0, -50)];
  for (const bytes of broken) expect(failure(() => Mesh.parse(bytes)).code).toBe('bad-file');
});

test('more triangles than fit into memory are refused', { tags: ['long'] }, () => {
  expect(failure(() => Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 1e-6 })).code).toBe('too-large');
});

test('use after free is refused', () => {
  const mesh = sphere();
  mesh.free();
  mesh.free();
  const uses = [
    () => mesh.arrays(),
    () => mesh.vertexCount,
    () => mesh.clone(),
    () => mesh.toBytes('ply'),
    () => mesh.decimate(10),
    () => mesh.remesh({ min: 1, max: 3 }),
    () => mesh.curvature('mean'),
    () => mesh.geodesic(0),
    () => mesh.distanceTo(sphere()),
    () => sphere().distanceTo(mesh),
  ];
  for (const use of uses) {
    expect(failure(use).code).toBe('freed');
  }
});

test('directions of any length are accepted', () => {
  const sphere = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.3 });
  for (const length of [1e-60, 1, 1e60, 1e300]) {
    expect(sphere.pick([0, 0, 3], [0, 0, -length])?.distance).toBeCloseTo(2, 1);
    expect(sphere.crossSection([0, 0, 0.05], [0, 0, length]).length).toBeGreaterThan(50);
  }
});

test('arrays are copied from an object of arrays only', () => {
  const sphere = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.5 });
  expect(failure(() => sphere.copyTo(null as never)).code).toBe('invalid-argument');
});
