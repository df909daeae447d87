// Displays meshes that are in a worker with the adapters, in the classes of the real libraries.
import vtkDataArray from '@kitware/vtk.js/Common/Core/DataArray.js';
import vtkPolyData from '@kitware/vtk.js/Common/DataModel/PolyData.js';
import * as THREE from 'three';
import { afterAll, beforeEach, expect, test } from 'vitest';
import { type RemoteMeshSource, ThreeSurface } from '../../pkg/adapters/three.js';
import { VtkSurface } from '../../pkg/adapters/vtk.js';
import init, { DeformableModel, Mesh, terminate, Volume } from '../../pkg/worker.js';
import { rejection, wrong } from './helpers.js';

beforeEach(() => init());
afterAll(() => terminate());

const SIZE = 20;

/** Returns a model that shrinks around a ball, whose triangles change. */
function shrinking(): DeformableModel {
  const data = Uint8Array.from({ length: SIZE ** 3 }, (_, i) => {
    const place = [i % SIZE, Math.floor(i / SIZE) % SIZE, Math.floor(i / SIZE ** 2)];
    return 200 * Math.min(1, Math.max(0, 6.5 - Math.hypot(...place.map((x) => x - 9.5))));
  });
  const volume = new Volume({ data, dims: [SIZE, SIZE, SIZE] });
  return new DeformableModel({ volume, start: 'enclosing', params: { iso: 100 } });
}

const scene = () => {
  const object = new THREE.Mesh();
  const values = (name: string) => [...(object.geometry.getAttribute(name) as THREE.BufferAttribute).array];
  const shown = () => ({
    positions: values('position').slice(0, 3 * (Math.max(-1, ...indices()) + 1)),
    indices: indices(),
  });
  const indices = () => [...(object.geometry.index?.array ?? [])].slice(0, object.geometry.drawRange.count);
  return { surface: new ThreeSurface(THREE, object), shown };
};

const plain = async (mesh: Pick<RemoteMeshSource, 'arrays'>) => {
  const { positions, indices } = await mesh.arrays({ relative: true });
  return { positions: [...positions], indices: [...indices] };
};

test('three: a model in a worker is shown after each step, and nothing is sent if nothing has changed', async () => {
  const model = shrinking();
  const { surface, shown } = scene();
  for (let step = 0; step < 5; step++) {
    expect(await surface.update(model.mesh)).toBe(true);
    expect(shown()).toEqual(await plain(model.mesh));
    expect(await surface.update(model.mesh)).toBe(false);
    await model.step();
  }
  model.free();
});

test('three: the buffers of every second surface are used again, in the worker and on the page', async () => {
  const mesh = await Mesh.icosphere({ center: [0, 0, 0], radius: 2, maxEdge: 0.5 });
  const object = new THREE.Mesh();
  const surface = new ThreeSurface(THREE, object);
  await surface.update(mesh);
  const { geometry } = object;
  const position = geometry.getAttribute('position') as THREE.BufferAttribute;
  const arrays = [position.array];
  for (let move = 0; move < 4; move++) {
    await mesh.transform([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.5, 0, 0, 1]);
    expect(await surface.update(mesh)).toBe(true);
    expect(position.array.length).toBeGreaterThan(0);
    expect([...position.array.subarray(0, 3)]).toEqual([...(await mesh.arrays()).positions.subarray(0, 3)]);
    arrays.push(position.array);
  }
  expect(object.geometry).toBe(geometry);
  // Transferred arrays are empty here.
  expect(arrays.map(({ length }) => length > 0)).toEqual([false, false, false, true, true]);
  mesh.free();
});

test('three: of several updates, the last one wins; one of a freed mesh rejects', async () => {
  const [first, last] = await Promise.all(
    [4, 0.5].map((maxEdge) => Mesh.icosphere({ center: [0, 0, 0], radius: 2, maxEdge })),
  );
  const { surface, shown } = scene();
  const both = await Promise.all([surface.update(first as Mesh), surface.update(last as Mesh)]);
  expect(both).toEqual([false, true]);
  expect(shown()).toEqual(await plain(last as Mesh));
  first?.free();
  expect((await rejection(surface.update(first as Mesh))).code).toBe('freed');
  expect(shown()).toEqual(await plain(last as Mesh));
});

test('three: triangles that change between two messages are read again', async () => {
  const spheres = await Promise.all(
    [4, 0.5].map(async (maxEdge) => (await Mesh.icosphere({ center: [0, 0, 0], radius: 2, maxEdge })).arrays()),
  );
  let [asked, at] = [0, 0];
  const restless: RemoteMeshSource = {
    // The second sphere takes the place of the first one as soon as that is sent.
    get topologyVersion() {
      asked += 1;
      return Promise.resolve(at);
    },
    get geometryVersion() {
      return Promise.resolve(at);
    },
    arrays: async () => {
      const sent = spheres[at];
      if (!sent) throw new Error('no such sphere');
      at = 1;
      return sent;
    },
  };
  const { surface, shown } = scene();
  await surface.update(restless);
  await surface.update(restless);
  expect(shown().indices).toEqual([...(spheres[1]?.indices ?? [])]);
  expect(asked).toBeGreaterThan(2);
});

test('vtk: a mesh in a worker', async () => {
  const mesh = await Mesh.icosphere({ center: [0, 0, 0], radius: 2, maxEdge: 1 });
  const surface = new VtkSurface({ vtkPolyData: wrong(vtkPolyData), vtkDataArray: wrong(vtkDataArray) });
  expect(await surface.update(mesh)).toBe(true);
  const { positions, indices } = await plain(mesh);
  const { polyData } = wrong(surface);
  expect([...polyData.getPoints().getData()]).toEqual(positions);
  expect(polyData.getPolys().getData()).toHaveLength((indices.length / 3) * 4);
  expect(await surface.update(mesh)).toBe(false);
});
