// Converts volumes of other libraries, with the libraries themselves: intensities at world points must agree.
import { readdir, readFile } from 'node:fs/promises';
import vtkDataArray from '@kitware/vtk.js/Common/Core/DataArray.js';
import vtkImageData from '@kitware/vtk.js/Common/DataModel/ImageData.js';
import vtkITKHelper from '@kitware/vtk.js/Common/DataModel/ITKHelper.js';
import { NVImage } from '@niivue/niivue';
import { Image, ImageType } from 'itk-wasm';
import NiiVue, { getImageDataRAS } from 'niivue-next/webgl2';
import { Vector3 } from 'three';
import { NRRDLoader } from 'three/addons/loaders/NRRDLoader.js';
import { expect, test } from 'vitest';
import { volumeFromNiivue } from '../../pkg/adapters/niivue.js';
import { volumeFromThree } from '../../pkg/adapters/three.js';
import { volumeFromItk, volumeFromVtk } from '../../pkg/adapters/vtk.js';
import { type Vec3, Volume, type VolumeInit } from '../../pkg/index.js';
import { failure, wrong } from './helpers.js';

const SIZE: Vec3 = [7, 6, 5];
const COUNT = SIZE[0] * SIZE[1] * SIZE[2];
const SPACING: Vec3 = [1.5, 0.75, 2.5];
const ORIGIN: Vec3 = [12, -34, 56];

/** Unit vectors along x, y and z of an oblique grid: rotated about z, then about x. */
const OBLIQUE: Vec3[] = [
  [0.8, 0.6 * 0.96, 0.6 * 0.28],
  [-0.6, 0.8 * 0.96, 0.8 * 0.28],
  [0, -0.28, 0.96],
];
const MIRRORED = OBLIQUE.map(([x, y, z], k) => (k === 1 ? [-x, -y, -z] : [x, y, z]) as Vec3);
const GRIDS: [string, Vec3[]][] = [
  ['oblique', OBLIQUE],
  ['mirrored', MIRRORED],
];

/** Returns voxels without any symmetry. */
const voxels = (frames = 1) => Int16Array.from({ length: COUNT * frames }, (_, i) => ((i * 7919) % 211) - 60);

const columns = (directions: Vec3[]) =>
  directions.map((one, k) => one.map((value) => value * (SPACING[k] ?? 0)) as Vec3);

const affine = (directions: Vec3[]) => [...columns(directions).flatMap((column) => [...column, 0]), ...ORIGIN, 1];

/** Yields the index of every voxel. */
function* indices(size: readonly number[] = SIZE): Generator<Vec3> {
  const [x = 0, y = 0, z = 0] = size;
  for (let k = 0; k < z; k++) for (let j = 0; j < y; j++) for (let i = 0; i < x; i++) yield [i, j, k];
}

interface Host {
  size?: readonly number[];
  world: (index: Vec3) => ArrayLike<number>;
  value: (index: Vec3, frame: number) => number;
}

/** Asserts that the volume has the host's value at the host's world point of every voxel. */
function agree(init: VolumeInit, { size, world, value }: Host): Volume {
  const volume = new Volume(init);
  for (let frame = 0; frame < volume.frames; frame++) {
    for (const index of indices(size)) {
      const point = Array.from(world(index)).slice(0, 3) as Vec3;
      expect(Math.abs(volume.sample(point, frame) - value(index, frame)), `${index} of frame ${frame}`).toBeLessThan(
        0.02,
      );
    }
  }
  return volume;
}

test('adapters import neither hosts nor the module', async () => {
  const folder = new URL('../../pkg/adapters/', import.meta.url);
  const own = ['check', 'error', 'kind', 'pause', 'room', 'stepper', 'warnings'];
  const files = (await readdir(folder)).filter((name) => name.endsWith('.js'));
  expect(files).toContain('source.js');
  for (const file of files) {
    const code = await readFile(new URL(file, folder), 'utf8');
    const imports = [...code.matchAll(/^(?:import|export) [^;]*?from '(.*)';$/gm)].map(([, from = '']) => from);
    expect(code.match(/^import|import\(/gm)?.length ?? 0, file).toBeLessThanOrEqual(imports.length);
    for (const from of imports)
      expect([...own.map((name) => `../${name}.js`), ...files.map((name) => `./${name}`)], file).toContain(from);
  }
});

// ── three.js

function nrrd(fields: string[], data: Uint8Array): Uint8Array {
  const lines = ['NRRD0004', ...fields, 'encoding: raw', '', ''].join('\n');
  return new Uint8Array([...new TextEncoder().encode(lines), ...data]);
}

const vector = (values: readonly number[]) => `(${values.join(',')})`;

/** Returns an NRRD file of the grid, with additional header fields. */
const scan = (space: string, directions: Vec3[], more: string[] = ['endian: little']) =>
  nrrd(
    [
      ...['type: short', 'dimension: 3', `space: ${space}`, `sizes: ${SIZE.join(' ')}`],
      `space directions: ${columns(directions).map(vector).join(' ')}`,
      ...[`space origin: ${vector(ORIGIN)}`, ...more],
    ],
    new Uint8Array(voxels().buffer),
  );

const loaded = (bytes: Uint8Array) => new NRRDLoader().parse(wrong(bytes.slice().buffer));

const SPACES = ['right-anterior-superior', 'left-posterior-superior', 'left-anterior-superior', 'RAS', 'LPS', 'LAS'];

test.each(SPACES.flatMap((space) => GRIDS.map(([name, grid]) => [space, name, grid] as const)))(
  'three: %s, %s, is placed as the file says',
  (space, _, grid) => {
    const bytes = scan(space, grid);
    const three = loaded(bytes);
    const volume = new Volume(volumeFromThree(three));
    const file = Volume.parse(bytes);
    expect(volume.space).toBe(file.space);
    expect(volume.dims).toEqual(file.dims);
    expect([...volume.affine]).toEqual([...file.affine].map((value) => expect.closeTo(value, 9)));
    agree(volumeFromThree(three), {
      world: ([i, j, k]) => place(file.affine, [i, j, k]),
      value: ([i, j, k]) => three.getData(i, j, k),
    });
  },
);

/** Transforms a point by a column-major matrix. */
const place = (matrix: ArrayLike<number>, [i, j, k]: Vec3): Vec3 =>
  [0, 1, 2].map((row) => {
    const [x = 0, y = 0, z = 0, at = 0] = [0, 4, 8, 12].map((first) => matrix[first + row] ?? 0);
    return x * i + y * j + z * k + at;
  }) as Vec3;

const AXES: Vec3[] = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];

test.each([
  ['right-anterior-superior', AXES],
  ['left-posterior-superior', AXES],
  ['left-posterior-superior', AXES.map((axis) => axis.map((value) => -value) as Vec3)],
])('three: in the world of its slices, %s, pixels are voxels', (space, axes) => {
  const fields = ['type: short', 'dimension: 3', `space: ${space}`, `sizes: ${SIZE.join(' ')}`, 'endian: little'];
  const directions = `space directions: ${axes.map(vector).join(' ')}`;
  const three = loaded(nrrd([...fields, directions], new Uint8Array(voxels().buffer)));
  const volume = new Volume(volumeFromThree(three, { world: 'slices' }));
  for (const axis of ['x', 'y', 'z'] as const) {
    const slice = wrong(three.extractPerpendicularPlane(axis, 2));
    for (let j = 0; j < slice.jLength; j++) {
      for (let i = 0; i < slice.iLength; i++) {
        const pixel = new Vector3(i - (slice.iLength - 1) / 2, (slice.jLength - 1) / 2 - j, 0).applyMatrix4(
          slice.matrix,
        );
        expect(volume.sample(pixel.toArray()), `${axis} ${i} ${j}`).toBeCloseTo(
          Number(three.data[slice.sliceAccess(i, j)]),
          6,
        );
      }
    }
  }
});

test('three: in the world of its slices an oblique grid is rotated as by its matrix', () => {
  const three = loaded(scan('right-anterior-superior', OBLIQUE));
  const middle = SIZE.map((count) => (count - 1) / 2);
  agree(volumeFromThree(three, { world: 'slices' }), {
    world: (index) =>
      new Vector3(...(index.map((at, k) => at - (middle[k] ?? 0)) as Vec3)).applyMatrix4(wrong(three.matrix)).toArray(),
    value: ([i, j, k]) => three.getData(i, j, k),
  });
});

test('three: frames', () => {
  const fields = (kinds: string) => [
    ...['type: short', 'dimension: 4', 'space: left-posterior-superior', `sizes: ${SIZE.join(' ')} 2`],
    `space directions: ${columns(OBLIQUE).map(vector).join(' ')} none`,
    ...[`kinds: ${kinds}`, 'endian: little', `space origin: ${vector(ORIGIN)}`],
  ];
  const frames = loaded(nrrd(fields('domain domain domain time'), new Uint8Array(voxels(2).buffer)));
  const volume = new Volume(volumeFromThree(frames));
  expect(volume.frames).toBe(2);
  expect([...volume.intensities(1)]).toEqual([...voxels(2).subarray(COUNT)]);
  const colours = loaded(nrrd(fields('RGB-color domain domain domain'), new Uint8Array(voxels(2).buffer)));
  expect(failure(() => volumeFromThree(colours)).message).toMatch(/one number per voxel/);
});

test('three: invalid arguments are refused', () => {
  expect(failure(() => volumeFromThree(wrong(undefined))).message).toMatch(/NRRDLoader/);
  expect(failure(() => volumeFromThree(wrong({ data: voxels() }))).message).toMatch(/xLength/);
  const big = loaded(scan('RAS', OBLIQUE, ['endian: big']));
  expect(failure(() => volumeFromThree(big)).message).toMatch(/Volume\.parse/);
  expect(failure(() => volumeFromThree(big, wrong({ world: 'somewhere' }))).code).toBe('invalid-argument');
  const few = Object.assign(loaded(scan('RAS', OBLIQUE)), { xLength: 4 });
  expect(failure(() => volumeFromThree(few)).message).toMatch(/4 × 6 × 5/);
});

// ── NiiVue

/** Returns a NIfTI file of two frames, with slope and intercept. */
const nifti = (directions: Vec3[]) =>
  new Volume({
    ...{ data: voxels(2), dims: [...SIZE, 2], affine: affine(directions) },
    ...{ slope: 0.5, intercept: 10, frameSeconds: 0.25 },
  }).toNifti();

test.each(GRIDS)('NiiVue 0.69: %s, the same value at every voxel', async (_, grid) => {
  const image = await wrong(NVImage).new(nifti(grid).slice().buffer, 'scan.nii');
  const size = image.dimsRAS?.slice(1) ?? [];
  const volume = agree(volumeFromNiivue(image), {
    size,
    world: (index) => image.vox2mm(index, wrong(image.matRAS)),
    value: ([i, j, k], frame) => image.getValue(i, j, k, frame),
  });
  expect(volume.frames).toBe(2);
  expect(volume.frameSeconds).toBeCloseTo(0.25);
  expect(volume.space).toBe('RAS');
});

test.each(GRIDS)('NiiVue 0.69: an LPS file, %s, is placed as the file says, in RAS', async (_, grid) => {
  const bytes = scan('left-posterior-superior', grid);
  const image = await wrong(NVImage).new(bytes.slice().buffer, 'scan.nrrd');
  const file = Volume.parse(bytes);
  agree(volumeFromNiivue(image), {
    world: (index) => {
      const [x, y, z] = place(file.affine, index);
      return [-x, -y, z];
    },
    value: ([i, j, k]) => voxels()[i + SIZE[0] * (j + SIZE[1] * k)] ?? 0,
  });
});

/** Converts a matrix stored by rows, as in NiiVue, to columns. */
const transposed = (rows: ArrayLike<number>) =>
  Array.from({ length: 16 }, (_, i) => rows[4 * (i % 4) + Math.floor(i / 4)] ?? 0);

test.each(GRIDS)('NiiVue 1.0: %s, the same value at every voxel', async (_, grid) => {
  const nv = new NiiVue();
  await nv.loadVolumes([{ url: new File([nifti(grid).slice()], 'scan.nii') }]);
  const [image] = nv.volumes;
  const [, x = 0, y = 0, z = 0] = image?.dimsRAS ?? [];
  const ras = getImageDataRAS(wrong(image)) ?? [];
  const volume = new Volume(volumeFromNiivue(image));
  expect(volume.frames).toBe(2);
  expect(volume.frameSeconds).toBeCloseTo(0.25);
  for (const [i, j, k] of indices([x, y, z])) {
    const there = 0.5 * Number(ras[i + x * (j + y * k)]) + 10;
    expect(volume.sample(place(transposed(image?.matRAS ?? []), [i, j, k]))).toBeCloseTo(there, 1);
  }
});

/** Returns a volume with the fields that NiiVue gives it. */
const niivue = (more: object, img: unknown = voxels()) => ({
  img,
  hdr: {
    ...{ dims: [3, ...SIZE, 1, 1, 1, 1], pixDims: [1, 1, 1, 1, 2, 0, 0, 0], datatypeCode: 4, xyzt_units: 10 },
    ...{ scl_slope: 0, scl_inter: Number.NaN },
    affine: [
      [1, 0, 0, 0],
      [0, 1, 0, 0],
      [0, 0, 1, 0],
      [0, 0, 0, 1],
    ],
    ...more,
  },
});

test('NiiVue: no slope, and units of time', () => {
  expect([...new Volume(volumeFromNiivue(niivue({}))).intensities()]).toEqual([...voxels()]);
  const seconds = (xyzt_units: number) => new Volume(volumeFromNiivue(niivue({ xyzt_units }, voxels(3)))).frameSeconds;
  expect([2, 8 + 2, 16 + 2, 24 + 2, 32].map(seconds)).toEqual([2, 2, 2e-3, 2e-6, 0]);
  expect(volumeFromNiivue(niivue({}))).not.toHaveProperty('frameSeconds');
});

test('NiiVue: invalid arguments are refused', () => {
  for (const nothing of [undefined, {}, { hdr: null }, niivue({}, null)]) {
    expect(failure(() => volumeFromNiivue(wrong(nothing))).message).toMatch(/a loaded volume of NiiVue/);
  }
  const colours = niivue({ datatypeCode: 128 }, new Uint8Array(3 * COUNT));
  expect(failure(() => volumeFromNiivue(colours)).message).toMatch(/RGB; only one number per voxel/);
  expect(failure(() => volumeFromNiivue(niivue({}, new Uint8Array(COUNT + 1)))).message).toMatch(/7 × 6 × 5/);
  expect(failure(() => volumeFromNiivue(niivue({}, [...voxels()]))).message).toMatch(/Uint8Array/);
});

// ── vtk.js and itk-wasm

/**
 * Returns the image in vtk.js, with an extent that does not begin at 0. The types of its base classes cannot be
 * resolved from Node's modules.
 */
function vtkImage(directions: Vec3[], values = voxels(), numberOfComponents = 1) {
  const image = wrong(vtkImageData.newInstance({ spacing: SPACING, origin: ORIGIN }));
  image.setDirection(directions.flat());
  image.setExtent(2, 1 + SIZE[0], -3, SIZE[1] - 4, 5, 4 + SIZE[2]);
  image.getPointData().setScalars(vtkDataArray.newInstance({ values, numberOfComponents }));
  return image;
}

test.each(GRIDS)('vtk.js: %s, extents that do not begin at 0, the same value at every voxel', (_, grid) => {
  const image = vtkImage(grid);
  const inExtent = ([i, j, k]: Vec3) => [i + 2, j - 3, k + 5];
  const scalars = image.getPointData().getScalars();
  const volume = agree(volumeFromVtk(image), {
    world: (index) => image.indexToWorld(inExtent(index)),
    value: (index) => scalars.getComponent(image.computeOffsetIndex(inExtent(index)), 0),
  });
  expect(volume.space).toBe('LPS');
  expect(new Volume(volumeFromVtk(image, { space: 'RAS' })).space).toBe('RAS');
});

test('vtk.js: invalid arguments are refused', () => {
  expect(failure(() => volumeFromVtk(wrong({}))).message).toMatch(/a vtkImageData/);
  expect(failure(() => volumeFromVtk(wrong(vtkImageData.newInstance()))).message).toMatch(/no scalars/);
  const colours = vtkImage(OBLIQUE, Int16Array.from({ length: 3 * COUNT }), 3);
  expect(failure(() => volumeFromVtk(colours)).message).toMatch(/3 numbers per voxel; only one/);
  expect(failure(() => volumeFromVtk(vtkImage(OBLIQUE), wrong({ space: 'LAS' }))).message).toMatch(/RAS/);
});

/** Returns the image in itk-wasm; in 4D with two frames. */
function itkImage(directions: Vec3[], dimension = 3): Image {
  const image = new Image(new ImageType(dimension, 'int16', 'Scalar', 1));
  const more = <T>(values: T[], last: T) => [...values, last].slice(0, dimension);
  for (const [column, one] of directions.entries()) {
    for (const [row, value] of one.entries()) image.direction[column + row * dimension] = value;
  }
  return Object.assign(image, {
    ...{ size: more([...SIZE], 2), spacing: more([...SPACING], 3), origin: more([...ORIGIN], 0) },
    data: voxels(dimension - 2),
  });
}

test.each(GRIDS)('itk-wasm: %s, the same position as in vtk.js', (_, grid) => {
  const image = itkImage(grid);
  const vtk = vtkITKHelper.convertItkToVtkImage(wrong(image));
  const volume = agree(volumeFromItk(image), {
    world: (index) => vtk.indexToWorld(index) as number[],
    value: ([i, j, k]) => Number(vtk.getPointData().getScalars().getData()[i + SIZE[0] * (j + SIZE[1] * k)]),
  });
  expect(volume.space).toBe('LPS');
  expect([...volume.affine]).toEqual(affine(grid).map((value) => expect.closeTo(value, 9)));
});

test('itk-wasm: 4D has frames', () => {
  const volume = new Volume(volumeFromItk(itkImage(MIRRORED, 4)));
  expect(volume.frames).toBe(2);
  expect([...volume.affine]).toEqual(affine(MIRRORED).map((value) => expect.closeTo(value, 9)));
  expect([...volume.intensities(1)]).toEqual([...voxels(2).subarray(COUNT)]);
});

test('itk-wasm: invalid arguments are refused', () => {
  expect(failure(() => volumeFromItk(wrong(null))).message).toMatch(/an Image of itk-wasm/);
  expect(failure(() => volumeFromItk(new Image())).message).toMatch(/3D or 4D image, got 2D/);
  const colours = new Image(new ImageType(3, 'uint8', 'RGB', 3));
  expect(failure(() => volumeFromItk(colours)).message).toMatch(/3 numbers per voxel, RGB/);
  expect(failure(() => volumeFromItk(Object.assign(itkImage(OBLIQUE), { data: null }))).message).toMatch(
    /unsupported voxel type/,
  );
  const wide = Object.assign(itkImage(OBLIQUE), { data: new BigInt64Array(COUNT) });
  expect(failure(() => volumeFromItk(wide)).message).toMatch(/unsupported voxel type/);
});
