// Textures of meshes, and animations of several meshes.
import { readFile } from 'node:fs/promises';
import { AnimationMixer, type Mesh as Drawn, type Object3D } from 'three';
import { type GLTF, GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { expect, test } from 'vitest';
import { animationGlb, Mesh, type MeshTexture } from '../../pkg/index.js';
import { failure, HEALTHY, wrong } from './helpers.js';

const file = async (name: string) => new Uint8Array(await readFile(new URL(`../data/meshes/${name}`, import.meta.url)));

const CORNERS = Float32Array.from([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]);
const FACES = Uint32Array.from([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]);
const UVS = Float32Array.from([0, 0, 1, 0, 0, 1, 1, 1]);
/** Begins like an image; the rest is not read. */
const PICTURE: MeshTexture = { type: 'image/jpeg', bytes: Uint8Array.of(0xff, 0xd8, 0xff, 0xe0, 1, 2, 3) };

const textured = (shift = 0) =>
  Mesh.fromArrays(
    CORNERS.map((value, at) => (at % 3 === 0 ? value + shift : value)),
    FACES,
    { uvs: UVS, texture: PICTURE },
  );

test('the texture of a file is kept through seams, copies and components, and written again', async () => {
  const cow = Mesh.parse(await file('spot.glb'));
  expect(cow.check()).toEqual(HEALTHY);
  const texture = cow.texture as MeshTexture;
  expect(texture.type).toBe('image/png');
  expect(texture.bytes).toHaveLength(80212);
  texture.bytes.fill(0);
  expect(cow.texture?.bytes[1]).toBe(0x50);
  // Of one side of each seam only.
  expect(cow.arrays().uvs).toHaveLength(2 * cow.vertexCount);
  const drawn = cow.splitAtSeams();
  expect(drawn.vertexCount).toBeGreaterThan(cow.vertexCount);
  expect(drawn.triangleCount).toBe(cow.triangleCount);
  expect(drawn.arrays().uvs).toHaveLength(2 * drawn.vertexCount);
  const again = Mesh.parse(cow.toBytes('glb'));
  expect(again.check()).toEqual(HEALTHY);
  for (const mesh of [drawn, again, cow.clone(), ...cow.components()]) expect(mesh.texture).toEqual(cow.texture);
  cow.decimate(1000);
  expect(cow.texture).toBeUndefined();
});

test('a texture can be given by the caller', async () => {
  expect(textured().texture).toEqual(PICTURE);
  expect(textured().arrays().uvs).toEqual(UVS);
  expect(Mesh.fromArrays(CORNERS, FACES, { uvs: UVS }).texture).toBeUndefined();
  const bottle = await file('fuze.obj');
  const uvs = (mesh: Mesh) => mesh.splitAtSeams().arrays().uvs as Float32Array;
  const lowest = (mesh: Mesh) => uvs(mesh).reduce((low, value, at) => (at % 2 ? Math.min(low, value) : low), 1);
  const highest = (mesh: Mesh) => uvs(mesh).reduce((high, value, at) => (at % 2 ? Math.max(high, value) : high), 0);
  const [bare, dressed] = [Mesh.parse(bottle), Mesh.parse(bottle, { texture: PICTURE })];
  expect(bare.texture).toBeUndefined();
  expect(dressed.texture).toEqual(PICTURE);
  expect(lowest(dressed)).toBeCloseTo(1 - highest(bare), 6);
  expect(highest(dressed)).toBeCloseTo(1 - lowest(bare), 6);
  expect(Mesh.parse(dressed.toBytes('glb')).texture).toEqual(PICTURE);
});

test.each([
  ['no coordinates for it', 'texture', () => Mesh.fromArrays(CORNERS, FACES, { texture: PICTURE })],
  ['another type', 'texture.type', () => withTexture({ ...PICTURE, type: 'image/gif' })],
  ['the wrong type', 'image/jpeg', () => withTexture({ ...PICTURE, type: 'image/png' })],
  ['no picture', 'texture', () => withTexture({ ...PICTURE, bytes: new Uint8Array(9) })],
  ['plain numbers', 'texture.bytes', () => withTexture({ ...PICTURE, bytes: [1, 2] })],
  ['a misspelled property', 'mime', () => withTexture({ mime: 'image/png' })],
  ['no object', 'texture', () => withTexture(null)],
  ['a misspelled option', 'textures', () => Mesh.parse(textured().toBytes('obj'), wrong({ textures: PICTURE }))],
])('%s is refused, naming %s', (_, named, work) => {
  const error = failure(work);
  expect(error.code).toBe('invalid-argument');
  expect(error.message).toContain(named);
});

const withTexture = (texture: unknown) => Mesh.fromArrays(CORNERS, FACES, { uvs: UVS, texture: wrong(texture) });

test('a texture for a file without coordinates, and compressed files', async () => {
  const bare = failure(() => Mesh.parse(textured().toBytes('stl'), { texture: PICTURE }));
  expect(bare.code).toBe('bad-file');
  expect(bare.message).toContain('texture coordinates');
  const packed = await file('suzi_draco.glb');
  const error = failure(() => Mesh.parse(packed));
  expect(error.code).toBe('bad-file');
  expect(error.message).toMatch(/KHR_draco_mesh_compression .*save the mesh again without Draco/);
  expect(error.message).toContain('decompressGltf of vesicle/gltf');
});

/** Loads a GLB with three.js. Images cannot be decoded outside a browser, so meshes have none here. */
const loaded = (glb: Uint8Array): Promise<GLTF> => new GLTFLoader().parseAsync(glb.buffer as ArrayBuffer, '');

test('three.js shows exactly one frame of an animation at a time', async () => {
  const frames = [1, 0.7, 0.5, 0.4].map((edge) => Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: edge }));
  const { scene, animations } = await loaded(animationGlb(frames, { frameSeconds: 0.25 }));
  const visible = () => {
    const seen: Object3D[] = scene.children.filter(({ scale }) => scale.x !== 0 || scale.y !== 0 || scale.z !== 0);
    return seen.map((node) => (node as Drawn).geometry.getAttribute('position').count);
  };
  const counts = frames.map((frame) => frame.vertexCount);
  expect(visible()).toEqual([counts[0]]);
  const [clip] = animations;
  if (!clip) throw new Error('no animation');
  expect(clip.duration).toBeCloseTo(1, 6);
  const mixer = new AnimationMixer(scene);
  mixer.clipAction(clip).play();
  for (const time of [0, 0.01, 0.24, 0.26, 0.4, 0.51, 0.74, 0.76, 0.99, 1.01, 2.6]) {
    mixer.setTime(time);
    expect(visible()).toEqual([counts[Math.floor(time / 0.25) % 4]]);
  }
});

test('equal frames and textures of an animation are stored once', () => {
  const [one, other] = [textured(), textured(3)];
  const size = (frames: Mesh[]) => animationGlb(frames).length;
  const text = new TextDecoder().decode(animationGlb([one, textured(), other, one]));
  expect(text.match(/"POSITION"/g)).toHaveLength(3);
  expect(text.match(/"mimeType":"image\/jpeg"/g)).toHaveLength(1);
  // A repeated frame only adds digits to the time of the last.
  expect(size([one, one, one]) - size([one])).toBeLessThan(16);
  expect(Mesh.parse(animationGlb([one, other])).texture).toEqual(PICTURE);
});

test('the first frame of an animation is its static pose', () => {
  const frames = [0.9, 0.6].map((edge) => Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: edge }));
  const first = Mesh.parse(animationGlb(frames));
  expect(first.check()).toEqual(HEALTHY);
  expect(first.triangleCount).toBe(frames[0]?.triangleCount);
});

const NOTHING = () => Mesh.fromArrays(new Float32Array(), new Uint32Array());

test.each([
  ['no frames', 'frames', () => animationGlb([])],
  ['no list', 'frames', () => animationGlb(wrong(textured()))],
  ['no mesh', 'frames[1]', () => animationGlb([textured(), wrong({})])],
  ['no frame with triangles', 'frames', () => animationGlb([NOTHING(), NOTHING()])],
  ['no time', 'frameSeconds', () => animationGlb([textured()], { frameSeconds: 0 })],
  ['NaN', 'frameSeconds', () => animationGlb([textured()], { frameSeconds: Number.NaN })],
  ['a misspelled option', 'fps', () => animationGlb([textured()], wrong({ fps: 10 }))],
])('an animation of %s is refused, naming %s', (_, named, work) => {
  const error = failure(work);
  expect(error.code).toBe('invalid-argument');
  expect(error.message).toContain(named);
});

test('a freed mesh in an animation is refused', () => {
  const mesh = textured();
  mesh.free();
  expect(failure(() => animationGlb([textured(), mesh])).code).toBe('freed');
});
