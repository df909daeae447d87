// Cuts by planes, and the selection of components.
import { expect, test } from 'vitest';
import { DeformableModel, Mesh, type MeshArrays } from '../../pkg/index.js';
import { ball, failure, HEALTHY, wrong } from './helpers.js';

const UP = { origin: [0, 0, 0.1] as [number, number, number], normal: [0, 0, 2] as [number, number, number] };

/** Returns a ball of radius 3 with a cavity of radius 1, and beside it one of radius 1: three components. */
function hollow(): Mesh {
  const parts = [
    Mesh.icosphere({ center: [0, 0, 0], radius: 3, maxEdge: 0.5 }),
    Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.5 }),
    Mesh.icosphere({ center: [6, 0, 0], radius: 1, maxEdge: 0.5 }),
  ];
  const arrays = parts.map((part) => part.arrays());
  // Reversed, the triangles of the cavity face inwards.
  arrays[1]?.indices.reverse();
  return joined(arrays);
}

function joined(parts: MeshArrays[]): Mesh {
  const firsts = parts.map((_, k) => parts.slice(0, k).reduce((sum, part) => sum + part.positions.length / 3, 0));
  const indices = parts.flatMap((part, k) => [...part.indices].map((index) => index + (firsts[k] ?? 0)));
  return Mesh.fromArrays(Float32Array.from(parts.flatMap((part) => [...part.positions])), Uint32Array.from(indices));
}

test('a cut keeps the side away from the normal, closed', () => {
  const mesh = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.2 });
  const whole = mesh.info();
  const other = mesh.clone();
  const { geometryVersion } = mesh;
  mesh.cut(UP);
  expect(mesh.check()).toEqual(HEALTHY);
  const { euler, volume, bounds } = mesh.info();
  expect(euler).toBe(2);
  expect(bounds.max[2]).toBeCloseTo(0.1, 4);
  expect(mesh.geometryVersion).not.toBe(geometryVersion);
  other.cut({ ...UP, normal: [0, 0, -1] });
  expect(other.info().volume + volume).toBeCloseTo(whole.volume, 3);
  const { indices } = other.arrays();
  other.cut({ origin: [0, 0, -9], normal: [0, 0, -1] });
  expect(other.arrays().indices).toEqual(indices);
});

test('a cut that is refused changes nothing', () => {
  const mesh = Mesh.icosphere({ center: [0, 0, 0], radius: 1, maxEdge: 0.2 });
  const { positions } = mesh.arrays();
  expect(failure(() => mesh.cut({ origin: [0, 0, -2], normal: [0, 0, 1] })).code).toBe('invalid-argument');
  expect(failure(() => mesh.cut({ origin: [0, 0, 0], normal: [0, 0, 0] })).message).toContain('normal');
  expect(failure(() => mesh.cut(wrong({ origin: [0, 0, 0] }))).code).toBe('invalid-argument');
  expect(failure(() => mesh.cut(wrong({ ...UP, side: 1 }))).message).toContain('side');
  expect(mesh.arrays().positions).toEqual(positions);
  const open = Mesh.fromArrays(Float32Array.of(0, 0, 0, 1, 0, 0, 0, 1, 0), Uint32Array.of(0, 1, 2));
  expect(failure(() => open.cut(UP)).code).toBe('not-closed');
  const crossing = joined([0, 0.7].map((x) => Mesh.icosphere({ center: [x, 0, 0], radius: 1, maxEdge: 0.5 }).arrays()));
  expect(failure(() => crossing.cut(UP)).code).toBe('self-intersecting');
});

test('components are kept by their indices, and cavities filled', () => {
  const mesh = hollow();
  const sizes = mesh.components().map((part) => part.info().volume);
  expect(sizes.map(Math.sign)).toEqual([1, -1, 1]);
  const { topologyVersion } = mesh;
  mesh.removeCavities();
  expect(mesh.components().map((part) => part.info().volume)).toEqual([sizes[0], sizes[2]]);
  expect(mesh.topologyVersion).not.toBe(topologyVersion);
  mesh.keepComponents([1]);
  expect(mesh.info().volume).toBeCloseTo(sizes[2] as number, 9);
  expect(failure(() => mesh.keepComponents([])).code).toBe('invalid-argument');
  expect(failure(() => mesh.keepComponents([1])).message).toContain('there is no component 1; there are 1');
  expect(mesh.check()).toEqual(HEALTHY);
});

test('the mesh of a model is not edited', () => {
  const model = new DeformableModel({ volume: ball(12, 4) });
  for (const edit of [
    () => model.mesh.cut(UP),
    () => model.mesh.keepComponents([0]),
    () => model.mesh.removeCavities(),
  ])
    expect(failure(edit).message).toContain('clone()');
  model.free();
});
