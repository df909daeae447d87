// Surfaces of hosts' label maps and drawings: a voxel's centre, where the host itself says that it is, must be inside of
// the surface of its label and of no other.
import vtkDataArray from '@kitware/vtk.js/Common/Core/DataArray.js';
import vtkImageData from '@kitware/vtk.js/Common/DataModel/ImageData.js';
import vtkPolyData from '@kitware/vtk.js/Common/DataModel/PolyData.js';
import { NVImage, NVMesh } from '@niivue/niivue';
import NiiVue from 'niivue-next/webgl2';
import { expect, test, vi } from 'vitest';
import { CornerstoneSurfaces, cornerstoneAddOn, volumeFromCornerstone } from '../../pkg/adapters/cornerstone.js';
import { changedRegion } from '../../pkg/adapters/label-map.js';
import { followDrawing } from '../../pkg/adapters/niivue.js';
import { Outline } from '../../pkg/adapters/niivue-outline.js';
import { VtkLabelSurfaces, volumeFromVtk, vtkFromVolume } from '../../pkg/adapters/vtk.js';
import { LabelSurfaces, Mesh, type SliceOptions, type Vec3, Volume } from '../../pkg/index.js';
import { failure, rejection, wrong } from './helpers.js';

const SIZE: Vec3 = [14, 12, 10];
const [NX, NY, NZ] = SIZE;
const SPACING: Vec3 = [1.5, 0.75, 2.5];
const ORIGIN: Vec3 = [12, -34, 56];
/** Unit vectors along x, y and z of an oblique, mirrored grid. */
const AXES: Vec3[] = [
  [0.8, 0.6 * 0.96, 0.6 * 0.28],
  [0.6, -0.8 * 0.96, -0.8 * 0.28],
  [0, -0.28, 0.96],
];

const at = (x: number, y: number, z: number): number => x + NX * (y + NY * z);

/** Yields the index of every voxel. */
function* indices(): Generator<Vec3> {
  for (let z = 0; z < NZ; z++) for (let y = 0; y < NY; y++) for (let x = 0; x < NX; x++) yield [x, y, z];
}

/** Labels the voxels of a box; the boxes of the tests have no symmetry. */
function box(labels: Uint8Array | Uint16Array, label: number, [x0, y0, z0]: Vec3, [x1, y1, z1]: Vec3): void {
  for (const [x, y, z] of indices()) {
    if (x >= x0 && y >= y0 && z >= z0 && x < x1 && y < y1 && z < z1) labels[at(x, y, z)] = label;
  }
}

/** Returns an L of label 1 that touches a box of label 2. */
function labelMap(): Uint8Array<ArrayBuffer> {
  const labels = new Uint8Array(NX * NY * NZ);
  box(labels, 1, [2, 2, 1], [9, 4, 4]);
  box(labels, 1, [2, 4, 1], [4, 9, 3]);
  box(labels, 2, [9, 2, 1], [12, 5, 6]);
  return labels;
}

/** Returns whether each point, packed xyz, is inside of a mesh: whether its triangles fill the sphere around the point. */
function contained(mesh: Mesh | undefined, points: ArrayLike<number>): boolean[] {
  const { positions, indices } = mesh?.arrays() ?? { positions: [], indices: [] };
  return Array.from({ length: points.length / 3 }, (_, p) => {
    const corner = (i: number) =>
      [0, 1, 2].map((k) => (positions[3 * (indices[i] ?? 0) + k] ?? 0) - (points[3 * p + k] ?? 0)) as Vec3;
    let angle = 0;
    for (let i = 0; i < indices.length; i += 3) angle += solidAngle(corner(i), corner(i + 1), corner(i + 2));
    return angle > 2 * Math.PI;
  });
}

/** After Van Oosterom and Strackee. */
function solidAngle(a: Vec3, b: Vec3, c: Vec3): number {
  const dot = (u: Vec3, v: Vec3) => u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  const [la, lb, lc] = [Math.hypot(...a), Math.hypot(...b), Math.hypot(...c)];
  const cross: Vec3 = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
  return 2 * Math.atan2(dot(a, cross), la * lb * lc + dot(a, b) * lc + dot(a, c) * lb + dot(b, c) * la);
}

/** Asserts that the surface of each label contains the centres of its voxels, at `world`, and no others. */
function agree(labels: ArrayLike<number>, meshOf: (label: number) => Mesh, world: (index: Vec3) => ArrayLike<number>) {
  const places = Float32Array.from([...indices()].flatMap((index) => Array.from(world(index)).slice(0, 3)));
  for (const label of new Set(Array.from(labels).filter((one) => one !== 0))) {
    expect(contained(meshOf(label), places), `label ${label}`).toEqual(Array.from(labels, (one) => one === label));
  }
}

const classes = { Volume, LabelSurfaces };

test.each([Uint8Array, Int16Array, Float32Array])('the box around changed voxels, %o', (Kind) => {
  let seed = 7;
  const random = (below: number) => {
    seed = (seed * 1103515245 + 12345) % 2 ** 31;
    return Math.floor((seed / 2 ** 31) * below);
  };
  for (let round = 0; round < 300; round++) {
    const dims: Vec3 = [1 + random(9), 1 + random(9), 1 + random(9)];
    const count = dims[0] * dims[1] * dims[2];
    const before = new Kind(count);
    // Also where the voxels do not begin at a multiple of four bytes.
    const shift = random(2);
    const now = new Kind(count + shift).subarray(shift);
    const first = random(dims[2]);
    const slices = random(2) ? { first, last: first + random(dims[2] - first) } : undefined;
    const changed: Vec3[] = [];
    for (let k = random(4); k > 0; k--) {
      const place: Vec3 = [random(dims[0]), random(dims[1]), random(dims[2])];
      now[place[0] + dims[0] * (place[1] + dims[1] * place[2])] = 1;
      if (!slices || (place[2] >= slices.first && place[2] <= slices.last)) changed.push(place);
    }
    const low = ([0, 1, 2] as const).map((axis) => Math.min(...changed.map((place) => place[axis])));
    const high = ([0, 1, 2] as const).map((axis) => Math.max(...changed.map((place) => place[axis])));
    const wanted = { min: low, dims: high.map((value, axis) => value - (low[axis] ?? 0) + 1) };
    expect(changedRegion(before, now, dims, slices)).toEqual(changed.length > 0 ? wanted : undefined);
  }
});

// ── vtk.js

const vtk = { vtkPolyData: wrong(vtkPolyData), vtkDataArray: wrong(vtkDataArray), vtkImageData: wrong(vtkImageData) };

/** Returns a vtkImageData with an extent that does not begin at 0. */
function vtkImage(values: Uint8Array | Float32Array | Uint32Array) {
  const image = wrong(vtkImageData.newInstance({ spacing: SPACING, origin: ORIGIN }));
  image.setDirection(AXES.flat());
  image.setExtent(2, 1 + NX, -3, NY - 4, 5, 4 + NZ);
  image.getPointData().setScalars(vtkDataArray.newInstance({ values }));
  return image;
}

test('vtk.js: each label has a poly data, which follows the voxels', () => {
  const labels = labelMap();
  const image = vtkImage(labels);
  const surfaces = new VtkLabelSurfaces({ ...classes, ...vtk }, image);
  const world = ([x, y, z]: Vec3) => image.indexToWorld([x + 2, y - 3, z + 5]);
  const check = () => agree(labels, (label) => surfaces.mesh(label), world);
  expect(surfaces.labels).toEqual([1, 2]);
  check();
  const first = wrong(surfaces.polyData(1));
  const points = () => [...wrong(surfaces.polyData(1)).getPoints().getData()];
  expect(points()).toEqual([...surfaces.mesh(1).arrays().positions]);
  expect(surfaces.update()).toBe(false);
  box(labels, 0, [2, 6, 1], [4, 9, 3]);
  box(labels, 1, [6, 2, 4], [8, 4, 7]);
  box(labels, 5, [3, 8, 6], [6, 11, 9]);
  expect(surfaces.update()).toBe(true);
  expect(surfaces.labels).toEqual([1, 2, 5]);
  check();
  expect(surfaces.polyData(1)).toBe(first);
  expect(points()).toEqual([...surfaces.mesh(1).arrays().positions]);
  labels.fill(0);
  surfaces.update();
  expect(surfaces.labels).toEqual([]);
  expect(first.getNumberOfCells()).toBe(0);
  surfaces.dispose();
  expect(first.isDeleted()).toBe(true);
});

test('vtk.js: invalid arguments are refused, and change nothing', () => {
  expect(failure(() => new VtkLabelSurfaces(wrong({ ...vtk, Volume }), vtkImage(labelMap()))).message).toMatch(
    /LabelSurfaces: needs the class of this library/,
  );
  const floats = vtkImage(new Float32Array(NX * NY * NZ));
  expect(failure(() => new VtkLabelSurfaces({ ...classes, ...vtk }, floats)).code).toBe('invalid-argument');
  const labels = labelMap();
  const image = vtkImage(labels);
  const surfaces = new VtkLabelSurfaces({ ...classes, ...vtk }, image);
  const before = surfaces.mesh(1).geometryVersion;
  image.getPointData().setScalars(vtkDataArray.newInstance({ values: Uint32Array.from(labels) }));
  expect(failure(() => surfaces.update()).message).toMatch(/type and the number/);
  expect(surfaces.mesh(1).geometryVersion).toBe(before);
  const none = failure(() => surfaces.polyData(3));
  expect(none.message).toMatch(/got 3/);
});

test.each(['LPS', 'RAS'] as const)('vtk.js: a label map in %s becomes an image at the same place', (space) => {
  const affine = [...AXES.flatMap((axis, k) => [...axis.map((one) => one * (SPACING[k] ?? 1)), 0]), ...ORIGIN, 1];
  const labels = labelMap();
  const volume = new Volume({ data: labels, dims: SIZE, affine, space });
  const image = wrong(vtkFromVolume(volume, vtk));
  const scalars = image.getPointData().getScalars();
  expect(scalars.getData()).toEqual(labels);
  expect(scalars.getName()).toBe('labels');
  const back = new Volume(volumeFromVtk(image));
  const sign = space === 'LPS' ? 1 : -1;
  const wanted = affine.map((value, i) => (i % 4 < 2 ? sign : 1) * value);
  expect([...back.affine]).toEqual(wanted.map((value) => expect.closeTo(value, 5)));
  const stays = wrong(vtkFromVolume(volume, vtk, { worldSpace: space }));
  expect([...new Volume(volumeFromVtk(stays, { space })).affine]).toEqual(affine.map((one) => expect.closeTo(one, 5)));
});

test('vtk.js: scalars are of the smallest type that holds the labels', () => {
  const typeOf = (data: Int16Array | Int32Array) => {
    const image = wrong(vtkFromVolume(new Volume({ data, dims: [data.length, 1, 1] }), vtk));
    expect([...image.getPointData().getScalars().getData()]).toEqual([...data]);
    return image.getPointData().getScalars().getData().constructor.name;
  };
  expect(typeOf(Int16Array.of(0, 255))).toBe('Uint8Array');
  expect(typeOf(Int16Array.of(0, 256))).toBe('Uint16Array');
  expect(typeOf(Int32Array.of(0, 65536))).toBe('Uint32Array');
  expect(typeOf(Int16Array.of(-1, 1))).toBe('Int32Array');
  const floats = new Volume({ data: Float32Array.of(0.5, 1), dims: [2, 1, 1] });
  expect(failure(() => vtkFromVolume(floats, vtk)).code).toBe('invalid-argument');
  expect(failure(() => vtkFromVolume(floats, wrong({ vtkImageData }))).message).toMatch(/vtkDataArray/);
});

// ── NiiVue

/** Returns an LPS file on the oblique grid. */
function lpsFile(): Uint8Array {
  const affine = [...AXES.flatMap((axis, k) => [...axis.map((one) => one * (SPACING[k] ?? 1)), 0]), ...ORIGIN, 1];
  const data = Int16Array.from({ length: NX * NY * NZ }, (_, i) => i % 97);
  return new Volume({ data, dims: SIZE, affine, space: 'LPS' }).toBytes('nrrd');
}

/** The members of NiiVue 0.69 that work without a canvas; its image and meshes are real. */
class Drawer extends EventTarget {
  meshes: object[] = [];
  drawBitmap: Uint8Array | null = null;
  drawLut = { lut: Uint8Array.of(0, 0, 0, 0, 255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255) };
  refreshed = 0;
  readonly gl = new Proxy({}, { get: () => () => ({}) });
  readonly volumes: unknown[];
  constructor(volume: unknown) {
    super();
    this.volumes = [volume];
  }
  addMesh(mesh: object) {
    this.meshes.push(mesh);
  }
  removeMesh(mesh: object) {
    this.meshes.splice(this.meshes.indexOf(mesh), 1);
  }
  refreshDrawing() {
    this.refreshed++;
  }
  drawScene() {}
}

/** Runs callbacks of animation frames when told. */
function frames() {
  const waiting: (() => void)[] = [];
  vi.stubGlobal('requestAnimationFrame', (work: () => void) => waiting.push(work));
  vi.stubGlobal('cancelAnimationFrame', () => {});
  return () => waiting.splice(0).forEach((work) => void work());
}

test('NiiVue 0.69: surfaces follow a drawing on an oblique LPS volume', async () => {
  const run = frames();
  const image = await wrong(NVImage).new(lpsFile().slice().buffer, 'scan.nrrd');
  // Axes are reordered and flipped, which the test is about.
  expect(image.permRAS.toString()).not.toBe('1,2,3');
  const [, nx, ny, nz] = image.dimsRAS;
  const nv = new Drawer(image);
  const told: (readonly number[])[] = [];
  const drawing = followDrawing(wrong(nv), {
    ...{ ...classes, NVMesh: wrong(NVMesh), outline: 0 },
    onChange: (labels) => told.push(labels),
  });
  run();
  await drawing.update();
  expect([drawing.meshes.size, nv.meshes.length]).toEqual([0, 0]);
  const bitmap = new Uint8Array(nx * ny * nz);
  nv.drawBitmap = bitmap;
  const places = (label: number) => {
    const points: number[] = [];
    const wanted: boolean[] = [];
    for (let i = 0; i < bitmap.length; i++) {
      const index = [i % nx, Math.floor(i / nx) % ny, Math.floor(i / (nx * ny))];
      points.push(...Array.from(image.vox2mm(index, image.matRAS) as number[]).slice(0, 3));
      wanted.push(bitmap[i] === label);
    }
    expect(contained(drawing.meshes.get(label), points)).toEqual(wanted);
  };
  const paint = (label: number, [x0, y0, z0]: Vec3, [x1, y1, z1]: Vec3) => {
    for (let z = z0; z < z1; z++)
      for (let y = y0; y < y1; y++) for (let x = x0; x < x1; x++) bitmap[x + nx * (y + ny * z)] = label;
  };
  paint(1, [1, 2, 1], [6, 4, 3]);
  paint(2, [6, 2, 1], [8, 7, 3]);
  // The method that NiiVue calls under the pen.
  nv.refreshDrawing();
  expect(nv.refreshed).toBe(1);
  run();
  await drawing.update();
  places(1);
  places(2);
  const colors = nv.meshes.map((mesh) => [...(wrong(mesh).rgba255 as Uint8Array)].slice(0, 4));
  expect(colors).toEqual([
    [255, 0, 0, 255],
    [0, 255, 0, 255],
  ]);
  const shown = wrong(nv.meshes[0]).pts as Float32Array;
  expect([...shown]).toEqual([...(drawing.meshes.get(1)?.arrays().positions ?? [])]);
  // A stroke, and then undo, which puts another array in the place of the drawing.
  const before = bitmap.slice();
  paint(1, [1, 4, 1], [3, 8, 2]);
  nv.refreshDrawing();
  run();
  await drawing.update();
  places(1);
  bitmap.set(before);
  nv.drawBitmap = bitmap.slice();
  nv.dispatchEvent(new Event('drawingChanged'));
  run();
  await drawing.update();
  places(1);
  // Erased, recoloured, closed.
  nv.drawBitmap.forEach((label, i, all) => {
    if (label === 2) all[i] = 0;
  });
  nv.drawLut = { lut: Uint8Array.of(0, 0, 0, 0, 9, 8, 7, 255) };
  await drawing.update();
  expect([...drawing.meshes.keys()]).toEqual([1]);
  expect(nv.meshes.map((mesh) => [...wrong(mesh).rgba255].slice(0, 4))).toEqual([[9, 8, 7, 255]]);
  nv.drawBitmap = null;
  await drawing.update();
  expect([drawing.meshes.size, nv.meshes.length]).toEqual([0, 0]);
  expect(told.at(-1)).toEqual([]);
  await drawing.stop();
  expect(Object.hasOwn(nv, 'refreshDrawing')).toBe(false);
  vi.unstubAllGlobals();
});

test('NiiVue 1.0: surfaces follow its drawing volume on an oblique LPS volume', async () => {
  const run = frames();
  const nv = wrong(new NiiVue());
  await nv.loadVolumes([{ url: new File([lpsFile().slice()], 'scan.nrrd') }]);
  nv.createEmptyDrawing();
  const drawn = nv.drawingVolume;
  const [, nx, ny, nz] = drawn.dimsRAS;
  const noop = () => {};
  nv.view = new Proxy(
    { gl: null, meshResources: undefined, _rebuildMeshResources: noop },
    { get: (known, name) => (name in known ? wrong(known)[name] : noop) },
  );
  const drawing = followDrawing(nv, { ...classes, outline: 0 });
  for (let z = 1; z < 4; z++)
    for (let y = 2; y < 5; y++) for (let x = 1; x < 7; x++) drawn.img[x + nx * (y + ny * z)] = 3;
  nv._drawLut = { lut: Uint8Array.of(1, 2, 3, 255, 255, 0, 255, 255), min: 2 };
  await drawing.update();
  const points: number[] = [];
  const m = drawn.matRAS as number[];
  for (let i = 0; i < nx * ny * nz; i++) {
    const [x, y, z] = [i % nx, Math.floor(i / nx) % ny, Math.floor(i / (nx * ny))];
    for (const row of [0, 4, 8]) {
      points.push((m[row] ?? 0) * x + (m[row + 1] ?? 0) * y + (m[row + 2] ?? 0) * z + (m[row + 3] ?? 0));
    }
  }
  expect(contained(drawing.meshes.get(3), points)).toEqual([...drawn.img].map((label) => label === 3));
  expect(nv.meshes[0].color).toEqual([1, 0, 1, 1]);
  await drawing.stop();
  expect(nv.meshes.length).toBe(0);
  run();
  vi.unstubAllGlobals();
});

test('NiiVue: what cannot be followed is refused', async () => {
  frames();
  const nv = new Drawer({ dimsRAS: [3, 2, 2, 2], matRAS: new Float32Array(16) });
  const options = { ...classes, NVMesh: wrong(NVMesh) };
  expect(failure(() => followDrawing(wrong({}), options)).message).toMatch(/a Niivue that can draw/);
  expect(failure(() => followDrawing(wrong(nv), wrong({ NVMesh, Volume }))).message).toMatch(/LabelSurfaces: needs/);
  expect(failure(() => followDrawing(wrong(nv), classes)).message).toMatch(/NVMesh/);
  const drawing = followDrawing(wrong(nv), options);
  nv.drawBitmap = new Uint8Array(9);
  expect((await rejection(drawing.update())).message).toMatch(/one byte for each voxel/);
  nv.drawBitmap = null;
  await drawing.update();
  await drawing.stop();
  vi.unstubAllGlobals();
});

test('NiiVue: the page is told of a drawing too far away to be shown, also after strokes', async () => {
  const run = frames();
  const matRAS = Float32Array.of(...[1, 0, 0, 5e5, 0, 1, 0, 5e6], ...[0, 0, 1, 100, 0, 0, 0, 1]);
  const nv = new Drawer({ dimsRAS: [3, 6, 6, 6], matRAS });
  const errors: unknown[] = [];
  const onError = (error: unknown) => errors.push(error);
  const drawing = followDrawing(wrong(nv), { ...classes, NVMesh: wrong(NVMesh), outline: 0, onError });
  nv.drawBitmap = Uint8Array.from({ length: 216 }, (_, i) => Number(i % 6 > 1 && i % 6 < 4 && i > 80 && i < 140));
  expect((await rejection(drawing.update())).code).toBe('precision');
  nv.refreshDrawing();
  run();
  await vi.waitFor(() => expect(errors).toMatchObject([{ code: 'precision' }]));
  await drawing.stop();
  vi.unstubAllGlobals();
});

test('NiiVue: outlines are closed, also through vertices', () => {
  const { positions, indices } = Mesh.icosphere({ center: [0, 0, 0], radius: 2, maxEdge: 0.4 }).arrays();
  const outline = new Outline([1, 0, 0], 1);
  outline.set(positions.slice(), indices.slice());
  for (const offset of [0, 0.3, -1.1, positions[3 * 7 + 2] ?? 0]) {
    const ends = new Map<string, number>();
    const segments = outline.segments({ normal: [0, 0, 1], offset });
    expect(segments.length).toBeGreaterThan(60);
    let length = 0;
    for (let i = 0; i < segments.length; i += 6) {
      const [a, b] = [segments.subarray(i, i + 3), segments.subarray(i + 3, i + 6)];
      length += Math.hypot((a[0] ?? 0) - (b[0] ?? 0), (a[1] ?? 0) - (b[1] ?? 0));
      for (const end of [a, b]) {
        expect(end[2]).toBeCloseTo(offset, 5);
        const key = Array.from(end).join();
        ends.set(key, (ends.get(key) ?? 0) + 1);
      }
    }
    // Segments of length 0 meet themselves.
    expect([...ends.values()].every((count) => count % 2 === 0)).toBe(true);
    expect(length).toBeCloseTo(2 * Math.PI * Math.sqrt(4 - offset ** 2), 0);
  }
  expect(outline.segments({ normal: [0, 0, 1], offset: 3 }).length).toBe(0);
});

// ── Cornerstone3D

const cornerstoneVolume = (labels: Uint8Array | Uint16Array) => ({
  ...{ dimensions: SIZE, spacing: SPACING, origin: ORIGIN, direction: AXES.flat() },
  metadata: { FrameOfReferenceUID: '1.2' },
  // Cornerstone returns a new array at each call.
  voxelManager: { getCompleteScalarDataArray: () => labels.slice() },
});

/** Returns the world point of a voxel, as Cornerstone computes it. */
const cornerstoneWorld = (index: Vec3) =>
  [0, 1, 2].map((row) =>
    index.reduce(
      (sum, i, k) => sum + i * (SPACING[k] ?? 0) * (AXES[k]?.[row as 0 | 1 | 2] ?? 0),
      ORIGIN[row as 0 | 1 | 2],
    ),
  );

test('Cornerstone: geometry of each segment, which follows the slices that have changed', () => {
  const labels = labelMap();
  const surfaces = new CornerstoneSurfaces(classes, cornerstoneVolume(labels));
  expect(surfaces.segments).toEqual([1, 2]);
  const check = () => agree(labels, (segment) => surfaces.mesh(segment), cornerstoneWorld);
  check();
  const { points, polys } = surfaces.geometry(2);
  const { positions, indices } = surfaces.mesh(2).arrays();
  expect([...points]).toEqual([...positions]);
  expect([...polys].filter((_, i) => i % 4 > 0)).toEqual([...indices]);
  expect([...polys].filter((_, i) => i % 4 === 0).every((corners) => corners === 3)).toBe(true);
  expect(surfaces.update()).toEqual([]);
  box(labels, 2, [9, 6, 7], [12, 9, 9]);
  // In other slices nothing has changed.
  expect(surfaces.update([0, 1, 2])).toEqual([]);
  expect(surfaces.update([7, 8])).toContain(2);
  check();
  box(labels, 4, [1, 9, 7], [3, 11, 9]);
  expect(surfaces.update()).toContain(4);
  check();
  expect(surfaces.geometry(9).points.length).toBe(0);
  expect(surfaces.frameOfReferenceUID).toBe('1.2');
});

test('Cornerstone: invalid arguments are refused', () => {
  expect(failure(() => volumeFromCornerstone(wrong(undefined))).message).toMatch(/cache\.getVolume/);
  const empty = { ...cornerstoneVolume(labelMap()), voxelManager: {} };
  expect(failure(() => volumeFromCornerstone(empty)).message).toMatch(/has no voxels/);
  expect(failure(() => cornerstoneAddOn(wrong({ ...classes, core: {} }))).message).toMatch(/tools: needs the module/);
});

/** The parts of Cornerstone that the add-on uses; the live page has the real ones. */
function cornerstone(labels: Uint8Array) {
  const cache = new Map<string, { data: Record<string, ArrayLike<number>> }>();
  const representationData: Record<string, unknown> = { Labelmap: {} };
  const drawn: string[] = [];
  const eventTarget = new EventTarget();
  const core = {
    eventTarget,
    cache: { getGeometry: (id: string) => cache.get(id) },
    geometryLoader: {
      createAndCacheGeometry: (id: string, { geometryData }: never) => cache.set(id, { data: geometryData }),
    },
    Enums: { GeometryType: { SURFACE: 'SURFACE' } },
  };
  const tools = {
    Enums: { Events: { SEGMENTATION_DATA_MODIFIED: 'modified', SEGMENTATION_REMOVED: 'removed' } },
    segmentation: {
      state: { getSegmentation: () => ({ representationData }) },
      triggerSegmentationEvents: { triggerSegmentationModified: (id: string) => drawn.push(id) },
    },
    utilities: { segmentation: { getOrCreateSegmentationVolume: () => cornerstoneVolume(labels) } },
  };
  return { core: wrong(core), tools: wrong(tools), cache, representationData, drawn, eventTarget };
}

test('Cornerstone: the add-on converts a label map once, and then follows events', async () => {
  const run = frames();
  const labels = labelMap();
  const { core, tools, cache, representationData, drawn, eventTarget } = cornerstone(labels);
  const other = { computeContourData: () => 'contours', canComputeRequestedRepresentation: () => false };
  const addOn = cornerstoneAddOn({ ...classes, core, tools }, other);
  addOn.init();
  expect(addOn.computeContourData()).toBe('contours');
  expect(addOn.canComputeRequestedRepresentation('heart', 'Surface')).toBe(true);
  expect(addOn.canComputeRequestedRepresentation('heart', 'Contour')).toBe(false);
  const data = await addOn.computeSurfaceData('heart');
  representationData.Surface = data;
  expect([...data.geometryIds.keys()]).toEqual([1, 2]);
  const id = data.geometryIds.get(2) ?? '';
  const lengths = () => [cache.get(id)?.data.points?.length, cache.get(id)?.data.polys?.length];
  const [before, vertices] = [lengths(), addOn.surfaces('heart')?.mesh(2).vertexCount ?? 0];
  expect(before[0]).toBe(3 * vertices);
  const modified = (slices?: number[]) => {
    const detail = { segmentationId: 'heart', modifiedSlicesToUse: slices };
    eventTarget.dispatchEvent(Object.assign(new Event('modified'), { detail }));
  };
  // Moved by one voxel, it has as many vertices as before; Cornerstone sees by the lengths that it has changed.
  box(labels, 0, [9, 2, 1], [12, 5, 6]);
  box(labels, 2, [9, 6, 1], [12, 9, 6]);
  modified([1, 2, 3]);
  modified([4, 5]);
  expect(drawn).toEqual([]);
  run();
  expect(drawn).toEqual(['heart']);
  expect(contained(addOn.surfaces('heart')?.mesh(2), cornerstoneWorld([10, 7, 3]))).toEqual([true]);
  expect(lengths()).not.toEqual(before);
  // A new segment.
  box(labels, 7, [1, 9, 7], [4, 11, 9]);
  modified();
  run();
  expect([...data.geometryIds.keys()]).toEqual([1, 2, 7]);
  expect(cache.get(data.geometryIds.get(7) ?? '')?.data.segmentIndex).toBe(7);
  eventTarget.dispatchEvent(Object.assign(new Event('removed'), { detail: { segmentationId: 'heart' } }));
  expect(addOn.surfaces('heart')).toBeUndefined();
  addOn.dispose();
  vi.unstubAllGlobals();
});

test('Cornerstone: what changes while the surfaces are created is followed, and a removal ends their creation', async () => {
  frames();
  const labels = labelMap();
  const { core, tools, eventTarget } = cornerstone(labels);
  const asked: string[] = [];
  const addOn = cornerstoneAddOn(
    { ...classes, core, tools },
    { updateSurfaceData: async (id: string) => void asked.push(id) },
  );
  addOn.init();
  const making = addOn.computeSurfaceData('heart');
  box(labels, 2, [9, 6, 1], [12, 9, 6]);
  // Another add-on has nothing to do with them.
  await addOn.updateSurfaceData('heart');
  expect(asked).toEqual([]);
  await making;
  expect(contained(addOn.surfaces('heart')?.mesh(2), cornerstoneWorld([10, 7, 3]))).toEqual([true]);
  const again = addOn.computeSurfaceData('heart');
  expect(addOn.surfaces('heart')).toBeUndefined();
  eventTarget.dispatchEvent(Object.assign(new Event('removed'), { detail: { segmentationId: 'heart' } }));
  await expect(again).rejects.toThrow(/abort/);
  expect(addOn.surfaces('heart')).toBeUndefined();
  const last = addOn.computeSurfaceData('heart');
  addOn.dispose();
  await expect(last).rejects.toThrow(/abort/);
  vi.unstubAllGlobals();
});

// ── In slices

/** Returns the adapters of label maps, created in slices: the surface of a label, and an update after changes. */
const inSlices = {
  'vtk.js': async (labels: Uint8Array, slices: SliceOptions) => {
    const image = vtkImage(labels);
    const made = await VtkLabelSurfaces.create({ ...classes, ...vtk }, image, {}, slices);
    const shown = (label: number) => [...wrong(made.polyData(label)).getPoints().getData()];
    return { made, shown, world: ([x, y, z]: Vec3) => image.indexToWorld([x + 2, y - 3, z + 5]) };
  },
  Cornerstone: async (labels: Uint8Array, slices: SliceOptions) => {
    const made = await CornerstoneSurfaces.create(classes, cornerstoneVolume(labels), {}, slices);
    return { made, shown: (label: number) => [...made.geometry(label).points], world: cornerstoneWorld };
  },
};

test.each(['vtk.js', 'Cornerstone'] as const)('%s: surfaces are created in slices, and follow', async (host) => {
  const labels = labelMap();
  let turns = 0;
  let isMade = false;
  const count = () => {
    turns++;
    if (!isMade) setImmediate(count);
  };
  count();
  const { made, shown, world } = await inSlices[host](labels, { budgetMs: 0.001 });
  isMade = true;
  expect(turns).toBeGreaterThan(10);
  const check = () => agree(labels, (label) => made.mesh(label), world);
  check();
  for (const label of [1, 2]) expect(shown(label)).toEqual([...made.mesh(label).arrays().positions]);
  // They are settled: nothing is left to do.
  const before = shown(1);
  made.update();
  expect(shown(1)).toEqual(before);
  box(labels, 2, [9, 6, 7], [12, 9, 9]);
  made.update();
  check();
  made.dispose();
});

test.each(['vtk.js', 'Cornerstone'] as const)('%s: the creation can be aborted', async (host) => {
  const reason = new Error('closed');
  const aborting = new AbortController();
  const making = inSlices[host](labelMap(), { signal: aborting.signal, budgetMs: 0.001 });
  setImmediate(() => aborting.abort(reason));
  await expect(making).rejects.toBe(reason);
  await expect(inSlices[host](labelMap(), { signal: aborting.signal })).rejects.toBe(reason);
  expect((await rejection(inSlices[host](labelMap(), { budgetMs: -1 }))).message).toMatch(/budgetMs/);
});

test('NiiVue: a drawing that is no longer followed while its surfaces are created is no error', async () => {
  const run = frames();
  const matRAS = Float32Array.of(...[1, 0, 0, 0, 0, 1, 0, 0], ...[0, 0, 1, 0, 0, 0, 0, 1]);
  const nv = new Drawer({ dimsRAS: [3, 6, 6, 6], matRAS });
  const errors: unknown[] = [];
  const onError = (error: unknown) => errors.push(error);
  const drawing = followDrawing(wrong(nv), { ...classes, NVMesh: wrong(NVMesh), outline: 0, onError });
  nv.drawBitmap = Uint8Array.from({ length: 216 }, (_, i) => Number(i % 6 > 1 && i % 6 < 4 && i > 80 && i < 140));
  nv.refreshDrawing();
  run();
  const update = drawing.update();
  await drawing.stop();
  await update;
  expect([errors, nv.meshes.length, drawing.meshes.size]).toEqual([[], 0, 0]);
  vi.unstubAllGlobals();
});
