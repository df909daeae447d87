// Mesh files as people have them, and what those that are written state.
import { Box3, Vector3 } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { beforeAll, expect, test } from 'vitest';
import startReaders, { parseMesh } from '../../pkg/import/index.js';
import {
  animationGlb,
  DeformableModel,
  LabelSurfaces,
  Mesh,
  type MeshFormat,
  MultiresolutionModel,
  parsePoints,
  type Space,
  type SpaceOptions,
  SurfaceTracker,
  type Vec3,
  Volume,
} from '../../pkg/index.js';
import { failure, wrong } from './helpers.js';

beforeAll(async () => {
  await startReaders();
});

const bytes = (text: string) => new TextEncoder().encode(text);
const text = (file: Uint8Array) => new TextDecoder('latin1').decode(file);

/** A head of 160 × 180 × 200 mm in RAS, with its middle at (10, -20, 30). */
function head(): Mesh {
  const mesh = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.5 });
  mesh.transform(Float64Array.of(80, 0, 0, 0, 0, 90, 0, 0, 0, 0, 100, 0, 10, -20, 30, 1));
  return mesh;
}

const turned = (positions: Float32Array) => positions.map((x, at) => (at % 3 === 2 ? x : 0 - x));

const OBJ = 'v 0 0 0\nv 2 0 0\nv 0 3 0\nv 0 0 4\nf 1//1 3//1 2//1\nf 1 2 4\nf 2 3 4\nf 3 1 4\n';

test('what a reader leaves out is said by both readers, and kept', () => {
  const mesh = Mesh.parse(bytes(OBJ));
  expect(mesh.info().volume).toBeCloseTo(4);
  expect(mesh.warnings).toMatchObject([{ code: 'reader', text: expect.stringContaining('normals') }]);
  const { positions, indices, ...extra } = parseMesh(bytes(OBJ));
  expect(Mesh.fromArrays(positions, indices, extra).clone().warnings).toEqual(mesh.warnings);
  expect(Mesh.parse(bytes(OBJ.replaceAll('//1', ''))).warnings).toEqual([]);
  expect(parsePoints(bytes('v 0 0 0\nvn nan 0 0\n')).warnings).toMatchObject([{ code: 'reader' }]);
});

test('a glTF document is read with the files beside it', () => {
  const glb = head().toBytes('glb');
  const length = new DataView(glb.buffer).getUint32(12, true);
  const document = text(glb.subarray(20, 20 + length)).replace('"buffers":[{', '"buffers":[{"uri":"head.bin",');
  const files = [{ name: 'meshes/head.bin', bytes: glb.subarray(28 + length) }];
  expect(Mesh.parse(bytes(document), { files }).arrays()).toEqual(Mesh.parse(glb).arrays());
  expect(parseMesh(bytes(document), { files }).indices).toEqual(parseMesh(glb).indices);
  const error = failure(() => Mesh.parse(bytes(document)));
  expect(error).toMatchObject({ code: 'bad-file', message: expect.stringContaining("in the file 'head.bin'") });
  for (const wrongly of [{}, { name: 'head.bin' }, { name: 1, bytes: glb }, { name: 'a', bytes: glb, type: 'x' }]) {
    expect(failure(() => Mesh.parse(glb, wrong({ files: [wrongly] }))).code).toBe('invalid-argument');
  }
});

test('files of a mesh state its space as 3D Slicer reads it, and are read back', () => {
  const mesh = head();
  const { positions } = Mesh.parse(mesh.toBytes('stl')).arrays();
  for (const format of ['stl', 'ply', 'obj', 'glb'] as MeshFormat[]) {
    for (const as of [undefined, 'RAS', 'LPS'] as (Space | undefined)[]) {
      const file = mesh.toBytes(format, { space: 'RAS', unit: 'mm', ...(as && { as }) });
      const found = Mesh.parse(file);
      expect(found.space).toBe(as ?? 'RAS');
      expect(found.unit).toBe(format === 'glb' ? 'mm' : undefined);
      expect(text(file).includes(`SPACE=${as ?? 'RAS'}`)).toBe(format !== 'glb');
      expect(found.arrays().positions).toEqual(as === 'LPS' ? turned(positions) : positions);
      const { positions: points, indices, ...extra } = parseMesh(file);
      expect(extra).toMatchObject({ space: found.space });
      for (const copy of [found.clone(), ...found.components(), Mesh.fromArrays(points, indices, extra)]) {
        expect([copy.space, copy.unit]).toEqual([found.space, found.unit]);
      }
    }
    expect(Mesh.parse(mesh.toBytes(format)).space).toBeUndefined();
  }
  expect(text(mesh.toBytes('vtp', { space: 'LPS' }))).toContain('76 80 83 0');
});

/** Returns the box of a GLB in three.js. */
async function seen(glb: Uint8Array): Promise<Box3> {
  const { scene } = await new GLTFLoader().parseAsync(glb.buffer as ArrayBuffer, '');
  scene.updateMatrixWorld();
  return new Box3().setFromObject(scene);
}

test('a head is 0.2 m high in three.js, its nose towards z', async () => {
  const { bounds } = head().info();
  const size = [0, 1, 2].map((axis) => (bounds.max[axis] as number) - (bounds.min[axis] as number));
  expect(size[2]).toBeCloseTo(196.4, 1);
  const options: SpaceOptions[] = [
    { space: 'RAS', unit: 'mm' },
    { space: 'RAS', as: 'LPS', unit: 'mm' },
  ];
  const rounded = (vector: Vector3, scale: number) => vector.toArray().map((x) => Math.round(scale * x));
  for (const option of options) {
    for (const glb of [head().toBytes('glb', option), animationGlb([head()], option)]) {
      const box = await seen(glb);
      const [right, front, up] = size.map((x) => Math.round(10 * x));
      expect(rounded(box.getSize(new Vector3()), 1e4)).toEqual([right, up, front]);
      // The middle is 10 mm to the right, 20 to the back and 30 up.
      expect(rounded(box.getCenter(new Vector3()), 1e3)).toEqual([-10, 30, -20]);
    }
  }
  const plain = await seen(head().toBytes('glb'));
  expect(rounded(plain.getSize(new Vector3()), 1)).toEqual(size.map(Math.round));
});

test('meshes of volumes state the space and unit of the volume', async () => {
  const data = new Float32Array(1000).map(
    (_, at) => 4 - Math.hypot((at % 10) - 4, (Math.floor(at / 10) % 10) - 4, Math.floor(at / 100) - 5),
  );
  const grid = { dims: [10, 10, 10] as Vec3, affine: [20, 0, 0, 0, 0, 20, 0, 0, 0, 0, 20, 0, 0, 0, 0, 1] };
  const volume = new Volume({ ...grid, data, space: 'LPS', unit: 'mm' });
  const labels = new Volume({
    ...grid,
    data: new Uint8Array(data.map((x) => Number(x > 0))),
    space: 'LPS',
    unit: 'mm',
  });
  const frames = { affine: grid.affine, space: 'LPS' as Space, unit: 'mm' as const };
  const model = new DeformableModel({ volume });
  const surfaces = new LabelSurfaces({ volume: labels });
  const tracker = new SurfaceTracker({
    volume: new Volume({ ...frames, dims: [10, 10, 10, 2], data: Float32Array.of(...data, ...data) }),
  });
  const meshes = [Mesh.marchingCubes(volume, 1), model.mesh, surfaces.mesh(1), tracker.mesh];
  for (const mesh of meshes) expect([mesh.space, mesh.unit]).toEqual(['LPS', 'mm']);
  tracker.step(3);
  expect(tracker.meshAt(0).space).toBe('LPS');
  expect(Mesh.parse(tracker.toGlb()).unit).toBe('mm');

  const mesh = meshes[0] as Mesh;
  const axes: Vec3[] = [
    [50, 0, 0],
    [0, 50, 0],
    [0, 0, 50],
  ];
  const ball = { center: [80, 80, 100] as Vec3, axes: axes as [Vec3, Vec3, Vec3] };
  const sculpted = new MultiresolutionModel({ detail: mesh, ellipsoids: [ball] });
  expect([sculpted.mesh.space, sculpted.levelMeshes()[0]?.unit]).toEqual(['LPS', 'mm']);
  for (const format of ['stl', 'ply', 'obj'] as const) {
    expect(text(mesh.toBytes(format))).toContain('SPACE=LPS');
    expect(text(mesh.toBytes(format, { as: 'RAS' }))).toContain('SPACE=RAS');
    expect(text(mesh.toBytes(format, { space: null }))).not.toContain('SPACE');
  }
  const numbers = Mesh.marchingCubes(new Volume({ ...grid, data }), 1);
  expect([numbers.space, numbers.unit]).toEqual(['RAS', undefined]);
  expect(numbers.toBytes('glb')).toEqual(numbers.toBytes('glb', { space: null }));
  expect(text(numbers.toBytes('stl'))).toContain('SPACE=RAS');

  const { bounds } = mesh.info();
  const height = (bounds.max[2] as number) - (bounds.min[2] as number);
  const size = async (glb: Uint8Array) => (await seen(glb)).getSize(new Vector3()).y;
  expect(await size(mesh.toBytes('glb'))).toBeCloseTo(height / 1000, 5);
  expect(await size(animationGlb([mesh]))).toBeCloseTo(height / 1000, 5);
  expect(await size(mesh.toBytes('glb', { space: null, unit: null }))).toBeCloseTo(height, 2);
  expect(text(Mesh.parse(mesh.toBytes('glb')).toBytes('ply'))).toContain('SPACE=LPS');

  const copy = mesh.clone();
  copy.transform([0.001, 0, 0, 0, 0, 0.001, 0, 0, 0, 0, 0.001, 0, 0, 0, 0, 1]);
  expect([copy.space, copy.unit]).toEqual([undefined, undefined]);
  expect(text(copy.toBytes('ply'))).not.toContain('SPACE');
});

test('options that say nothing are refused', () => {
  const refused = (options: unknown) => failure(() => head().toBytes('ply', wrong(options)));
  expect(refused({ as: 'LPS' })).toMatchObject({ code: 'invalid-argument', message: expect.stringMatching(/^as: /) });
  expect(refused({ space: 'LAS' }).message).toMatch(/^space: /);
  expect(refused({ space: 'RAS', as: 'left' }).message).toMatch(/^as: /);
  expect(refused({ unit: 'cm' }).message).toMatch(/^unit: /);
  expect(failure(() => animationGlb([head()], wrong({ unit: 'inch' }))).message).toMatch(/^unit: /);
  expect(failure(() => Mesh.fromArrays(new Float32Array(), new Uint32Array(), wrong({ space: 'x' }))).message).toMatch(
    /^space: /,
  );
});
