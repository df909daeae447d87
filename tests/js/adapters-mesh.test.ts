// Displays meshes with the adapters, in the classes of the real libraries.
import vtkDataArray from '@kitware/vtk.js/Common/Core/DataArray.js';
import vtkPolyData from '@kitware/vtk.js/Common/DataModel/PolyData.js';
import { NVMesh } from '@niivue/niivue';
import * as THREE from 'three';
import { beforeEach, expect, test } from 'vitest';
import { NiivueSurface } from '../../pkg/adapters/niivue.js';
import { type MeshSource, ThreeSurface } from '../../pkg/adapters/three.js';
import { VtkSurface } from '../../pkg/adapters/vtk.js';
import { DeformableModel, Mesh, type MeshArrays, Volume } from '../../pkg/index.js';
import { failure, PAPER, rejection, wrong } from './helpers.js';

/** A mesh source that is not one of the library's classes, with version counters of its own. */
class Plain implements MeshSource {
  topologyVersion = 1;
  geometryVersion = 1;
  constructor(private made: MeshArrays) {}

  arrays(): MeshArrays {
    return this.made;
  }

  /** Moves all vertices along x. */
  move(by: number): void {
    const positions = this.made.positions.map((value, i) => (i % 3 === 0 ? value + by : value));
    this.made = { ...this.made, positions };
    this.geometryVersion++;
  }

  /** Replaces the surface by another one. */
  become(made: MeshArrays): void {
    this.made = made;
    this.topologyVersion++;
    this.geometryVersion++;
  }
}

const sphere = (maxEdge: number): MeshArrays => Mesh.icosphere({ center: [3, 2, 1], radius: 2, maxEdge }).arrays();

let source: Plain;
beforeEach(() => {
  source = new Plain(sphere(1));
});

/** Returns six times the enclosed volume; positive if triangles face outwards. */
function signedVolume(positions: ArrayLike<number>, indices: ArrayLike<number>): number {
  const corner = (i: number) => new THREE.Vector3().fromArray(positions as number[], 3 * (indices[i] ?? 0));
  let sum = 0;
  for (let i = 0; i < indices.length; i += 3) sum += corner(i).dot(corner(i + 1).cross(corner(i + 2)));
  return sum;
}

/** Returns a model of a bright ball in a mirrored LPS volume, whose triangles must still face outwards. */
function mirrored(): DeformableModel {
  const data = new Uint8Array(16 ** 3).map((_, i) => {
    const [x, y, z] = [i % 16, Math.floor(i / 16) % 16, Math.floor(i / 256)];
    return 128 + 20 * (5 - Math.hypot(x - 8, y - 8, z - 8));
  });
  const volume = new Volume({
    data,
    dims: [16, 16, 16],
    affine: [-2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 9, 9, 9, 1],
    space: 'LPS',
  });
  return new DeformableModel({ volume, start: 'enclosing', params: { iso: 128, isoForce: -1, ...PAPER } });
}

// ── three.js

const scene = () => {
  const object = new THREE.Mesh();
  return { object, surface: new ThreeSurface(THREE, object) };
};

const values = (object: THREE.Mesh, name: string) => object.geometry.getAttribute(name) as THREE.BufferAttribute;
const index = (object: THREE.Mesh) => object.geometry.index as THREE.BufferAttribute;
const inUse = (object: THREE.Mesh) => [...index(object).array].slice(0, object.geometry.drawRange.count);

test('three: vertices, normals and triangles equal those of the mesh', () => {
  const { object, surface } = scene();
  expect(surface.update(source)).toBe(true);
  const { positions, normals, indices } = source.arrays();
  expect([...values(object, 'position').array].slice(0, positions.length)).toEqual([...positions]);
  expect([...values(object, 'normal').array].slice(0, normals.length)).toEqual([...normals]);
  expect(inUse(object)).toEqual([...indices]);
  expect(object.geometry.drawRange.start).toBe(0);
});

test('three: nothing is uploaded if nothing changed', () => {
  const { object, surface } = scene();
  surface.update(source);
  const before = [values(object, 'position').version, values(object, 'normal').version, index(object).version];
  expect(surface.update(source)).toBe(false);
  expect([values(object, 'position').version, values(object, 'normal').version, index(object).version]).toEqual(before);
});

test('three: triangles are uploaded only if they changed', () => {
  const { object, surface } = scene();
  surface.update(source);
  const [moved, turned] = [values(object, 'position').version, index(object).version];
  source.move(10);
  expect(surface.update(source)).toBe(true);
  expect(values(object, 'position').version).toBeGreaterThan(moved);
  expect(index(object).version).toBe(turned);
  expect(object.geometry.boundingSphere?.center.x).toBeCloseTo(13);
  source.become(sphere(0.9));
  surface.update(source);
  expect(index(object).version).toBeGreaterThan(turned);
  expect(inUse(object)).toEqual([...source.arrays().indices]);
});

test('three: only the used part of a buffer is uploaded, and bounds are those of the displayed vertices', () => {
  const { object, surface } = scene();
  surface.update(new Plain(sphere(0.5)));
  source.move(10);
  surface.update(source);
  const { positions, indices } = source.arrays();
  expect(values(object, 'position').updateRanges).toEqual([{ start: 0, count: positions.length }]);
  expect(index(object).updateRanges).toEqual([{ start: 0, count: indices.length }]);
  const box = new THREE.Box3().setFromObject(object);
  expect([...box.min.toArray(), ...box.max.toArray()]).toEqual(
    [11, 0, -1, 15, 4, 3].map((at) => expect.closeTo(at, 1)),
  );
  const { center, radius } = object.geometry.boundingSphere ?? new THREE.Sphere();
  for (let i = 0; i < positions.length; i += 3) {
    expect(new THREE.Vector3().fromArray(positions, i).distanceTo(center)).toBeLessThanOrEqual(radius + 1e-6);
  }
});

test('three: a mesh that outgrows its buffers gets new ones, and the old ones are disposed of', () => {
  const { object, surface } = scene();
  surface.update(source);
  const first = object.geometry;
  let disposed = 0;
  first.addEventListener('dispose', () => disposed++);
  source.become(sphere(0.9));
  surface.update(source);
  expect(object.geometry).toBe(first);
  source.become(sphere(0.2));
  surface.update(source);
  expect(object.geometry).not.toBe(first);
  expect(disposed).toBe(1);
  expect(inUse(object)).toEqual([...source.arrays().indices]);
  expect(values(object, 'position').array.length).toBeLessThanOrEqual(1.25 * source.arrays().positions.length + 3);
});

test('three: a snapshot is shown without a copy, in the same buffers while it fits', () => {
  const { object, surface } = scene();
  const mesh = Mesh.icosphere({ center: [1, 2, 3], radius: 2, maxEdge: 0.5 });
  const [first, second] = [mesh.snapshot(), mesh.snapshot()];
  expect(surface.update(first)).toBe(true);
  expect(values(object, 'position').array).toBe(first.positions);
  const { geometry } = object;
  expect(surface.update(second)).toBe(true);
  expect(object.geometry).toBe(geometry);
  expect([values(object, 'position').array, index(object).array]).toEqual([second.positions, second.indices]);
  expect(values(object, 'normal').array).toBe(second.normals);
  expect(inUse(object)).toEqual([...mesh.arrays().indices]);
  // The arrays of a snapshot are never written to.
  const kept = second.positions.slice();
  surface.update(Mesh.icosphere({ center: [0, 0, 0], radius: 2, maxEdge: 0.5 }));
  expect(second.positions).toEqual(kept);
  expect(values(object, 'position').array).not.toBe(second.positions);
});

test('three: a snapshot moves the object to its origin; a host that cannot is told how', () => {
  const far = Mesh.icosphere({ center: [1e6, 0, 0], radius: 2, maxEdge: 0.5 }).snapshot({}, { relative: true });
  const { object, surface } = scene();
  surface.update(far);
  expect(object.position.toArray()).toEqual(far.origin);
  const fixed = new ThreeSurface(THREE, { geometry: new THREE.BufferGeometry() });
  expect(failure(() => fixed.update(far)).message).toMatch(/position/);
});

test('three: colours can be added and removed', () => {
  const { object, surface } = scene();
  surface.update(source);
  expect(object.geometry.getAttribute('color')).toBeUndefined();
  const made = source.arrays();
  const colors = made.positions.map((_, i) => (i % 3) / 2);
  source.become({ ...made, colors });
  surface.update(source);
  expect([...values(object, 'color').array].slice(0, 6)).toEqual([0, 0.5, 1, 0, 0.5, 1]);
  source.become(made);
  surface.update(source);
  expect(object.geometry.getAttribute('color')).toBeUndefined();
});

test('three: the mesh of a model faces outwards, also when converted to another space', () => {
  const model = mirrored();
  const { object, surface } = scene();
  const turned = new THREE.Mesh();
  const other = new ThreeSurface(THREE, turned, { space: 'LPS', worldSpace: 'RAS' });
  const topologies = new Set<number>();
  for (let i = 0; i < 40; i++) {
    model.step();
    surface.update(model.mesh);
    other.update(model.mesh);
    topologies.add(model.mesh.topologyVersion);
    const { positions, normals } = model.mesh.arrays();
    expect(signedVolume(values(object, 'position').array, inUse(object))).toBeGreaterThan(0);
    expect(signedVolume(values(turned, 'position').array, inUse(turned))).toBeGreaterThan(0);
    for (const [name, list] of [
      ['position', positions],
      ['normal', normals],
    ] as const) {
      const there = values(turned, name);
      const [x = 0, y = 0, z = 0] = list;
      expect([there.getX(0), there.getY(0), there.getZ(0)]).toEqual([-x, -y, z]);
    }
  }
  expect(topologies.size).toBeGreaterThan(10);
});

test('three: the arrays of a mesh source are not modified', () => {
  const { positions } = source.arrays();
  const before = [...positions];
  new ThreeSurface(THREE, new THREE.Mesh(), { space: 'LPS', worldSpace: 'RAS' }).update(source);
  expect([...positions]).toEqual(before);
});

test('three: a disposed surface can be used again', () => {
  const { object, surface } = scene();
  surface.update(source);
  let disposed = 0;
  object.geometry.addEventListener('dispose', () => disposed++);
  surface.dispose();
  surface.dispose();
  expect(disposed).toBe(1);
  expect(surface.update(source)).toBe(true);
});

test('three: invalid arguments are refused', () => {
  expect(failure(() => new ThreeSurface(wrong({ ...THREE, Box3: undefined }), new THREE.Mesh())).message).toMatch(
    /Box3/,
  );
  expect(failure(() => new ThreeSurface(THREE, wrong(new THREE.Group()))).message).toMatch(/THREE\.Mesh/);
  const { surface } = scene();
  for (const nothing of [undefined, {}, { arrays: () => source.arrays() }]) {
    expect(failure(() => surface.update(wrong(nothing))).message).toMatch(/must be a Mesh/);
  }
  const spaces = { space: wrong('LAS') };
  expect(failure(() => new ThreeSurface(THREE, new THREE.Mesh(), spaces)).message).toMatch(/'RAS', 'LPS'/);
});

// ── vtk.js

const vtk = { vtkPolyData: wrong(vtkPolyData), vtkDataArray: wrong(vtkDataArray) };

/** Returns the vertex indices of a vtkPolyData's triangles, without the counts between them. */
const triangles = (polyData: { getPolys(): unknown }) =>
  [...wrong(polyData).getPolys().getData()].filter((_, i) => i % 4 > 0);

test('vtk.js: points, normals and polygons equal those of the mesh', () => {
  const surface = new VtkSurface(vtk);
  expect(surface.update(source)).toBe(true);
  const polyData = wrong(surface.polyData);
  const { positions, normals, indices } = source.arrays();
  expect([...polyData.getPoints().getData()]).toEqual([...positions]);
  expect([...polyData.getPointData().getNormals().getData()]).toEqual([...normals]);
  expect(polyData.getPointData().getNormals().getNumberOfTuples()).toBe(positions.length / 3);
  expect(triangles(polyData)).toEqual([...indices]);
  expect(polyData.getNumberOfCells()).toBe(indices.length / 3);
  expect(polyData.getBounds()).toEqual([1, 5, 0, 4, -1, 3].map((at) => expect.closeTo(at, 1)));
});

test('vtk.js: nothing is updated if nothing changed, and polygons only if they changed', () => {
  const surface = new VtkSurface(vtk);
  surface.update(source);
  const polyData = wrong(surface.polyData);
  const before = polyData.getMTime();
  let told = 0;
  polyData.onModified(() => told++);
  expect(surface.update(source)).toBe(false);
  expect([polyData.getMTime(), told]).toEqual([before, 0]);
  const polygons = polyData.getPolys().getMTime();
  source.move(10);
  surface.update(source);
  expect(polyData.getMTime()).toBeGreaterThan(before);
  expect(polyData.getPolys().getMTime()).toBe(polygons);
  expect(told).toBe(1);
  expect(polyData.getBounds()[0]).toBeCloseTo(11, 1);
  source.become(sphere(0.5));
  surface.update(source);
  expect(triangles(polyData)).toEqual([...source.arrays().indices]);
});

test('vtk.js: arrays passed to it are not modified afterwards', () => {
  const model = mirrored();
  const surface = new VtkSurface(vtk);
  model.step();
  surface.update(model.mesh);
  const given = wrong(surface.polyData).getPoints().getData();
  const before = [...given];
  for (let i = 0; i < 20; i++) {
    model.step();
    surface.update(model.mesh);
  }
  expect([...given]).toEqual(before);
  const now = wrong(surface.polyData).getPoints().getData();
  expect([...now]).toEqual([...model.mesh.arrays().positions]);
  expect(signedVolume(now, triangles(surface.polyData) as number[])).toBeGreaterThan(0);
});

test('vtk.js: dispose, and invalid arguments', () => {
  const surface = new VtkSurface(vtk);
  surface.update(source);
  surface.dispose();
  expect(wrong(surface.polyData).isDeleted()).toBe(true);
  expect(failure(() => new VtkSurface(wrong({ vtkPolyData }))).message).toMatch(/vtkDataArray/);
  expect(failure(() => new VtkSurface(vtk).update(wrong(null))).message).toMatch(/must be a Mesh/);
});

// ── NiiVue 0.69

/** Returns a fake WebGL context that records the last upload to each buffer, as bytes. */
function recordingGl() {
  const uploads = new Map<unknown, Uint8Array<ArrayBuffer>>();
  const bound = new Map<unknown, unknown>();
  let made = 0;
  const gl = {
    ...{
      ARRAY_BUFFER: 1,
      ELEMENT_ARRAY_BUFFER: 2,
      STATIC_DRAW: 3,
      DYNAMIC_DRAW: 4,
      FLOAT: 5,
      BYTE: 6,
      UNSIGNED_BYTE: 7,
    },
    ...{ createBuffer: () => ({ id: made++ }), createVertexArray: () => ({ id: made++ }) },
    ...{ bindVertexArray() {}, enableVertexAttribArray() {}, vertexAttribPointer() {} },
    bindBuffer: (target: number, buffer: unknown) => bound.set(target, buffer),
    getBufferParameter: (target: number) => uploads.get(bound.get(target))?.length,
    bufferData(target: number, data: ArrayBuffer | Uint8Array) {
      const bytes = ArrayBuffer.isView(data)
        ? new Uint8Array(data.buffer, data.byteOffset, data.byteLength)
        : new Uint8Array(data);
      uploads.set(bound.get(target), bytes.slice());
    },
  };
  return { gl, uploads };
}

/** Returns the parts of NiiVue 0.69 that work without a canvas; its meshes are real. */
function niivue() {
  const { gl, uploads } = recordingGl();
  const meshes: object[] = [];
  const removeMesh = (mesh: object) => meshes.splice(meshes.indexOf(mesh), 1);
  const nv = { gl, meshes, addMesh: (mesh: object) => meshes.push(mesh), removeMesh };
  const surface = new NiivueSurface(wrong(nv), { NVMesh: wrong(NVMesh), color: [1, 0.5, 0.25, 1] });
  return { nv, gl: wrong(gl), surface, uploads };
}

/** Decodes uploaded vertex records. */
function records(bytes: Uint8Array = new Uint8Array()) {
  const floats = new Float32Array(bytes.buffer);
  const signed = new Int8Array(bytes.buffer);
  const vertices = [...Array(bytes.length / 20).keys()];
  const three = (list: ArrayLike<number>, at: number) =>
    [list[at], list[at + 1], list[at + 2]] as [number, number, number];
  return {
    positions: vertices.flatMap((v) => three(floats, 5 * v)),
    normals: vertices.map((v) => new THREE.Vector3(...three(signed, 20 * v + 12))),
    colors: vertices.flatMap((v) => [...bytes.subarray(20 * v + 16, 20 * v + 20)]),
  };
}

test('NiiVue 0.69: packed records equal those of its own updateMesh', async () => {
  const { gl, surface, uploads } = niivue();
  expect(await surface.update(source)).toBe(true);
  source.become(sphere(0.6));
  expect(await surface.update(source)).toBe(true);
  const mesh = wrong(surface.mesh);
  const ours = records(uploads.get(mesh.vertexBuffer));
  const indices = uploads.get(mesh.indexBuffer);
  const counts = [mesh.indexCount, mesh.vertexCount];
  mesh.updateMesh(gl);
  const theirs = records(uploads.get(mesh.vertexBuffer));
  expect(ours.positions).toEqual(theirs.positions);
  expect(ours.colors).toEqual(theirs.colors);
  expect(ours.colors.slice(0, 4)).toEqual([255, 128, 64, 255]);
  for (const [v, normal] of ours.normals.entries())
    expect(normal.angleTo(theirs.normals[v] ?? normal)).toBeLessThan(0.1);
  expect(indices).toEqual(uploads.get(mesh.indexBuffer));
  expect(counts).toEqual([mesh.indexCount, mesh.vertexCount]);
});

test('NiiVue 0.69: nothing is uploaded if nothing changed, and triangles only if they changed', async () => {
  const { surface, uploads } = niivue();
  await surface.update(source);
  uploads.clear();
  expect(await surface.update(source)).toBe(false);
  expect(uploads.size).toBe(0);
  source.move(10);
  await surface.update(source);
  const mesh = wrong(surface.mesh);
  expect(uploads.has(mesh.vertexBuffer)).toBe(true);
  expect(uploads.has(mesh.indexBuffer)).toBe(false);
});

test('NiiVue 0.69: bounds are updated, and layers are dropped with the vertices they belong to', async () => {
  const { surface } = niivue();
  await surface.update(source);
  const mesh = wrong(surface.mesh);
  source.move(10);
  await surface.update(source);
  expect([...mesh.extentsMin, ...mesh.extentsMax]).toEqual([11, 0, -1, 15, 4, 3].map((at) => expect.closeTo(at, 1)));
  expect(mesh.furthestVertexFromOrigin).toBeCloseTo(Math.hypot(13, 2, 1) + 2, 1);
  expect([...mesh.pts]).toEqual([...source.arrays().positions]);
  mesh.layers = [{ opacity: 0 }];
  source.become(sphere(0.5));
  await surface.update(source);
  expect(mesh.layers).toEqual([]);
  expect([...mesh.tris]).toEqual([...source.arrays().indices]);
});

test('NiiVue 0.69: records of another length are left to its own updateMesh', async () => {
  const { surface, uploads } = niivue();
  await surface.update(source);
  const mesh = wrong(surface.mesh);
  mesh.f32PerVertex = 7;
  source.become(sphere(0.6));
  await surface.update(source);
  expect(uploads.get(mesh.vertexBuffer)?.length).toBe((28 * source.arrays().positions.length) / 3);
});

test('NiiVue 0.69: colours of the mesh, and the mesh of an LPS volume', async () => {
  const { gl, nv, uploads } = niivue();
  const surface = new NiivueSurface(wrong({ ...nv, gl }), { NVMesh: wrong(NVMesh), space: 'LPS' });
  const made = source.arrays();
  source.become({ ...made, colors: made.positions.map((_, i) => (i % 3) / 2) });
  await surface.update(source);
  source.become({ ...made, colors: made.positions.map((_, i) => 1 - (i % 3) / 2) });
  await surface.update(source);
  const { positions, colors } = records(uploads.get(wrong(surface.mesh).vertexBuffer));
  expect(colors.slice(0, 8)).toEqual([255, 128, 0, 255, 255, 128, 0, 255]);
  const [x = 0, y = 0, z = 0] = source.arrays().positions;
  expect(positions.slice(0, 3)).toEqual([-x, -y, z].map((at) => expect.closeTo(at)));
  expect(signedVolume(positions, made.indices)).toBeGreaterThan(0);
});

test('NiiVue 0.69: a surface can be removed and added again', async () => {
  const { nv, surface } = niivue();
  await surface.update(source);
  expect(nv.meshes).toEqual([surface.mesh]);
  await surface.dispose();
  expect(nv.meshes).toEqual([]);
  expect(surface.mesh).toBeUndefined();
  expect(await surface.update(source)).toBe(true);
  expect(nv.meshes).toEqual([surface.mesh]);
});

// ── NiiVue 1.0

/** Returns the parts of NiiVue 1.0 that the adapter calls; their effect is tested in a browser. */
function next(view: object) {
  const calls: string[] = [];
  const meshes: object[] = [];
  const noted = (name: string) => () => void calls.push(name);
  const nv = {
    ...{ meshes, view, updateGLVolume: noted('updateGLVolume') },
    addMesh: async (mesh: object) => void meshes.push(mesh),
    removeMesh: async (place: number) => void meshes.splice(place, 1),
  };
  return { nv, calls, noted, surface: new NiivueSurface(wrong(nv)) };
}

test('NiiVue 1.0: only meshes are rebuilt, if it has a method for that', async () => {
  const view: Record<string, unknown> = {};
  const { calls, noted, surface } = next(view);
  await surface.update(source);
  expect(calls).toEqual([]);
  source.become(sphere(0.6));
  await surface.update(source);
  expect(calls).toEqual(['updateGLVolume']);
  view._rebuildMeshResources = noted('meshes');
  source.move(1);
  expect([await surface.update(source), await surface.update(source)]).toEqual([true, false]);
  expect(calls).toEqual(['updateGLVolume', 'meshes']);
  const { positions, indices } = source.arrays();
  const mesh = wrong(surface.mesh);
  expect([...mesh.positions]).toEqual([...positions]);
  expect([...mesh.indices]).toEqual([...indices]);
  expect(mesh.colors.length).toBe(positions.length / 3);
  expect([...mesh.extentsMin, ...mesh.extentsMax]).toEqual([2, 0, -1, 6, 4, 3].map((at) => expect.closeTo(at, 1)));
});

test('NiiVue 1.0: buffers are filled directly if their record layout is known', async () => {
  const { gl, uploads } = recordingGl();
  const meshResources = new Map();
  let rebuilt = 0;
  const { calls, surface } = next({ gl, meshResources, _rebuildMeshResources: () => rebuilt++ });
  await surface.update(source);
  const buffers = { vao: {}, vertexBuffer: {}, indexBuffer: {}, indexCount: 0 };
  meshResources.set(surface.mesh, buffers);
  const length = (28 * source.arrays().positions.length) / 3;
  uploads.set(buffers.vertexBuffer, new Uint8Array(length + 28));
  source.move(1);
  await surface.update(source);
  expect(rebuilt).toBe(1);
  uploads.set(buffers.vertexBuffer, new Uint8Array(length));
  source.become(sphere(0.6));
  await surface.update(source);
  expect([rebuilt, calls]).toEqual([1, []]);
  const { positions, normals, indices } = source.arrays();
  const floats = new Float32Array(uploads.get(buffers.vertexBuffer)?.buffer ?? []);
  expect(floats.length).toBe((7 * positions.length) / 3);
  for (const v of [0, 7]) {
    expect([...floats.subarray(7 * v, 7 * v + 3)]).toEqual([...positions.subarray(3 * v, 3 * v + 3)]);
    expect([...floats.subarray(7 * v + 3, 7 * v + 6)]).toEqual([...normals.subarray(3 * v, 3 * v + 3)]);
  }
  expect([...new Uint8Array(floats.buffer).subarray(24, 28)]).toEqual([255, 224, 191, 255]);
  expect([...new Uint32Array(uploads.get(buffers.indexBuffer)?.buffer ?? [])]).toEqual([...indices]);
  expect(buffers.indexCount).toBe(indices.length);
});

test('NiiVue 1.0: a surface can be removed', async () => {
  const { nv, surface } = next({});
  nv.meshes.push({});
  await surface.update(source);
  await surface.dispose();
  expect(nv.meshes).toEqual([{}]);
});

test('NiiVue: invalid arguments are refused', async () => {
  expect(failure(() => new NiivueSurface(wrong(undefined))).message).toMatch(/must be a Niivue/);
  expect(failure(() => new NiivueSurface(wrong({ ...niivue().nv, gl: null }))).message).toMatch(/attach one first/);
  expect(failure(() => new NiivueSurface(wrong(niivue().nv))).message).toMatch(/import \{ Niivue, NVMesh \}/);
  expect((await rejection(niivue().surface.update(wrong({})))).message).toMatch(/must be a Mesh/);
});
