// Warnings of volumes, meshes and models, in files, and in a worker.
import { expect, test } from 'vitest';
import { ThreeSurface } from '../../pkg/adapters/three.js';
import startReaders, { parseVolume } from '../../pkg/import/index.js';
import {
  animationGlb,
  DeformableModel,
  LabelSurfaces,
  Mesh,
  type MeshFormat,
  MultiresolutionModel,
  Volume,
  type Warning,
} from '../../pkg/index.js';
import * as worker from '../../pkg/worker.js';
import { ball, failure, wrong } from './helpers.js';

const LONG: Warning = { code: 'anisotropic', text: 'Voxels of 1×1×6 mm.' };
const SECOND: Warning = { code: 'reader', text: 'A slice is missing.', where: { frame: 1 } };
const CORNER: Warning = { code: 'reader', text: 'A voxel is wrong.', where: { point: [3, 3, 3] } };
const LABEL: Warning = { code: 'thin-label', text: 'It is thin.', where: { label: 2 } };
const ALL = [LONG, SECOND, CORNER, LABEL];

const volume = (warnings?: Warning[]) => {
  const data = Uint8Array.from({ length: 128 }, (_, i) => ([21, 22, 25, 26].includes(i % 64) ? 200 : 0));
  return new Volume({ data, dims: [4, 4, 4, 2], ...(warnings && { warnings }) });
};
const text = (bytes: Uint8Array) => new TextDecoder('latin1').decode(bytes);

test('a volume has the warnings it was made with, and passes on those that hold', () => {
  const all = volume(ALL);
  expect(volume().warnings).toEqual([]);
  expect(all.warnings).toEqual(ALL);
  expect(all.crop({ min: [0, 0, 0], max: [3, 3, 3] }).warnings).toEqual([LONG, SECOND, LABEL]);
  expect(all.frame(0).warnings).toEqual([LONG, CORNER, LABEL]);
  expect(all.frame(1).warnings).toEqual([LONG, { code: 'reader', text: SECOND.text }, CORNER, LABEL]);
  expect(all.binned([2, 2, 2]).warnings).toEqual([SECOND, CORNER, LABEL]);
  expect(Volume.fromFrames([volume(), volume([LABEL])]).warnings).toEqual([LABEL]);
});

test('wrong warnings are named', () => {
  const refused = (warning: unknown) => failure(() => volume([warning as Warning])).message;
  expect(refused({ ...LONG, code: 'odd' })).toMatch(/^warnings\[0\]\.code: must be one of ends-in-frame, .*'reader'/);
  expect(refused({ ...LONG, text: ' ' })).toMatch(/^warnings\[0\]\.text: /);
  expect(refused({ ...LONG, text: 'x'.repeat(2001) })).toMatch(/^warnings\[0\]\.text: /);
  expect(refused({ ...LONG, where: {} })).toMatch(/^warnings\[0\]\.where: must have one of/);
  expect(refused({ ...LONG, where: { frame: -1 } })).toMatch(/^warnings\[0\]\.where\.frame: /);
  expect(refused({ ...LONG, where: { point: [1, 2] } })).toMatch(/^warnings\[0\]\.where\.point: /);
  expect(refused({ ...LONG, place: 1 })).toMatch(/^place: unknown property/);
  expect(
    failure(() => new Volume({ data: new Uint8Array(1), dims: [1, 1, 1], warnings: wrong(LONG) })).message,
  ).toMatch(/^warnings: must be an array/);
});

test('a mesh has the warnings of what it was made of, in all its copies', () => {
  const surface = Mesh.marchingCubes(volume(ALL), 100);
  expect(surface.warnings).toEqual([LONG, CORNER, LABEL]);
  const copy = surface.clone();
  copy.refine();
  expect([copy, ...copy.components()].map(({ warnings }) => warnings)).toEqual([surface.warnings, surface.warnings]);
  expect(copy.toVolume(volume(), { kind: 'mask' }).warnings).toEqual(surface.warnings);
  const { positions, indices } = surface.arrays();
  expect(Mesh.fromArrays(positions, indices, { warnings: [LONG] }).warnings).toEqual([LONG]);
  expect(Mesh.fromArrays(positions, indices).warnings).toEqual([]);
  copy.free();
  expect(failure(() => copy.warnings).code).toBe('freed');
});

test('the mesh of a model has the warnings of its data', () => {
  const model = new DeformableModel({ volume: volume([LONG]).frame(0), params: { iso: 100 } });
  expect(model.mesh.warnings).toEqual([LONG]);
  const { warnings } = model.step();
  expect(model.mesh.warnings).toEqual([LONG, ...warnings.filter(({ code }) => code !== LONG.code)]);
  const sphere = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.5 }).arrays();
  const detail = Mesh.fromArrays(sphere.positions, sphere.indices, { warnings: [CORNER] });
  const ellipsoids = [
    {
      center: [0, 0, 0],
      axes: [
        [0.5, 0, 0],
        [0, 0.5, 0],
        [0, 0, 0.5],
      ],
    },
  ];
  expect(new MultiresolutionModel({ detail, ellipsoids } as never).mesh.warnings).toEqual([CORNER]);
});

test('the surface of a label has the warnings that concern it', () => {
  const data = Uint8Array.from({ length: 64 }, (_, i) => (i === 21 ? 1 : i === 42 ? 2 : 0));
  const surfaces = new LabelSurfaces({ volume: new Volume({ data, dims: [4, 4, 4], warnings: [LONG, LABEL] }) });
  expect(surfaces.mesh(1).warnings).toEqual([LONG]);
  expect(surfaces.mesh(2).warnings).toEqual([LONG, LABEL]);
});

test('files of a mesh have its warnings and those given, and are read as without them', () => {
  const surface = Mesh.marchingCubes(volume([LONG]), 100);
  const { positions, indices } = surface.arrays();
  const plain = Mesh.fromArrays(positions, indices);
  const bytes = (format: MeshFormat) => surface.toBytes(format, { warnings: [LONG, CORNER] });
  expect(text(bytes('ply'))).toContain(
    '\ncomment warning anisotropic: Voxels of 1x1x6 mm.\ncomment warning reader: A voxel is wrong. (point 3 3 3)\n',
  );
  expect(text(bytes('obj'))).toContain('# warning anisotropic: ');
  expect(text(bytes('vtp'))).toContain('<!-- warning anisotropic: ');
  expect(text(bytes('stl').subarray(0, 80))).toMatch(/^binary STL, SPACE=RAS, warnings: anisotropic reader +$/);
  const glb = new TextDecoder().decode(bytes('glb'));
  expect(glb).toContain('"extras":{"warnings":["anisotropic: Voxels of 1×1×6 mm.","reader: A voxel is wrong.');
  expect(animationGlb([surface, surface]).length).toBeGreaterThan(animationGlb([plain, plain]).length);
  for (const format of ['ply', 'obj', 'stl', 'glb'] as const) {
    expect(Mesh.parse(bytes(format)).arrays()).toEqual(Mesh.parse(surface.toBytes(format)).arrays());
  }
});

test('what has no warnings is as ever', async () => {
  await startReaders();
  const none = ball(16, 5);
  const model = new DeformableModel({ volume: none, params: { iso: 100 } });
  expect([none.warnings, model.step(5).warnings, model.mesh.warnings]).toEqual([[], [], []]);
  expect('warnings' in parseVolume(none.toNifti())).toBe(false);
  expect(text(model.mesh.toBytes('ply')).match(/comment.*/g)).toEqual(['comment SPACE=RAS']);
});

test('they come out of a worker', async () => {
  await worker.default();
  const made = new worker.Volume({ data: new Uint8Array(128).fill(1, 60, 70), dims: [4, 4, 4, 2], warnings: ALL });
  expect(await made.warnings).toEqual(ALL);
  const surface = await worker.Mesh.marchingCubes(made, 0.5, { frame: 1 });
  expect(await surface.warnings).toEqual(ALL);
  expect(text((await surface.toBytes('ply')) as Uint8Array)).toContain('comment warning thin-label');
  worker.terminate();
});

test('an adapter passes on those of its mesh', () => {
  class Box {
    min = { set: () => undefined };
    max = { set: () => undefined };
    center = { set: () => undefined };
    radius = 0;
  }
  class Geometry {
    boundingSphere = null;
    boundingBox = null;
    setAttribute(): void {}
    setIndex(): void {}
    setDrawRange(): void {}
    dispose(): void {}
  }
  class BufferAttribute {
    needsUpdate = false;
    clearUpdateRanges(): void {}
    addUpdateRange(): void {}
  }
  const three = { BufferGeometry: Geometry, BufferAttribute, Sphere: Box, Box3: Box };
  const surface = new ThreeSurface(three as never, { geometry: new Geometry() });
  expect(surface.warnings).toEqual([]);
  surface.update(Mesh.marchingCubes(volume([LONG]), 100));
  expect(surface.warnings).toEqual([LONG]);
});
