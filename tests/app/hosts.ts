/** The live pages of www/embed, and how each host is asked where its surface is and what its volume has there. */
import type { Page } from 'playwright-core';

/** What a page leaves on `window`, of any host's. */
// biome-ignore lint/suspicious/noExplicitAny: five hosts, each with objects of its own
export type Hosted = Window & Record<string, any>;

/** A surface in its host's world, and the host's image around it. */
export interface Asked {
  positions: ArrayLike<number>;
  indices: ArrayLike<number>;
  /** Voxels along the host's axes. */
  size: ArrayLike<number>;
  /** World to the host's index, by its own functions. */
  toIndex: (point: number[]) => ArrayLike<number>;
  /** What the host has at a whole index. */
  at: (i: number, j: number, k: number) => number;
  iso: number;
}

/** Run in the page, as everything below. */
const ask: Record<string, (page: Hosted) => Asked> = {
  three: ({ tooth, object, model }) => {
    const { matrix } = tooth;
    const [x, y, z] = [tooth.xLength, tooth.yLength, tooth.zLength];
    // Slices are drawn around the middle of the volume.
    const inverse = matrix.clone().invert().elements;
    const turn = (p: number[], row: number) =>
      [0, 1, 2].reduce((sum, k) => sum + inverse[4 * k + row] * (p[k] ?? 0), 0);
    const { index, drawRange, attributes } = object.geometry;
    return {
      positions: attributes.position.array,
      indices: index.array.subarray(0, drawRange.count),
      size: [x, y, z],
      toIndex: (p) => [turn(p, 0) + (x - 1) / 2, turn(p, 1) + (y - 1) / 2, turn(p, 2) + (z - 1) / 2],
      at: (i, j, k) => tooth.getData(i, j, k),
      iso: model.params.iso,
    };
  },
  niivue: ({ nv, model }) => ({
    positions: nv.meshes[0].pts,
    indices: nv.meshes[0].tris,
    size: nv.volumes[0].dimsRAS.slice(1),
    toIndex: (p) => nv.volumes[0].mm2vox(p, true),
    at: (i, j, k) => nv.volumes[0].getValue(i, j, k),
    iso: model.params.iso,
  }),
  'niivue-next': ({ nv, model }) => {
    const [{ matRAS: m, img, hdr, dimsRAS, img2RASstart: start, img2RASstep: step }] = nv.volumes;
    // Rows; this head has its axes along the world's.
    const along = [0, 1, 2].map((row) => ({ scale: m[4 * row + row], shift: m[4 * row + 3] }));
    return {
      positions: nv.meshes[0].positions,
      indices: nv.meshes[0].indices,
      size: dimsRAS.slice(1),
      toIndex: (p) => along.map(({ scale, shift }, k) => ((p[k] ?? 0) - shift) / scale),
      at: (i, j, k) =>
        hdr.scl_slope * img[start[0] + start[1] + start[2] + i * step[0] + j * step[1] + k * step[2]] + hdr.scl_inter,
      iso: model.params.iso,
    };
  },
  vtk: ({ image, surface, model }) => ({
    positions: surface.polyData.getPoints().getData(),
    indices: surface.polyData
      .getPolys()
      .getData()
      .filter((_: number, i: number) => i % 4 > 0),
    size: image.getDimensions(),
    toIndex: (p) => image.worldToIndex(p),
    at: (i, j, k) =>
      image
        .getPointData()
        .getScalars()
        .getComponent(image.computeOffsetIndex([i, j, k]), 0),
    iso: model.params.iso,
  }),
  itk: ({ image, surface, model }) => {
    const { size, spacing, origin, direction, data } = image;
    // Directions are unit vectors at right angles: their transpose is their inverse.
    const along = (p: number[], column: number) =>
      [0, 1, 2].reduce((sum, row) => sum + direction[3 * row + column] * ((p[row] ?? 0) - origin[row]), 0);
    return {
      positions: surface.polyData.getPoints().getData(),
      indices: surface.polyData
        .getPolys()
        .getData()
        .filter((_: number, i: number) => i % 4 > 0),
      size,
      toIndex: (p) => [0, 1, 2].map((k) => along(p, k) / spacing[k]),
      at: (i, j, k) => data[i + size[0] * (j + size[1] * k)],
      iso: model.params.iso,
    };
  },
};

/** What the host's surface is in its world. */
export interface Found {
  vertices: number;
  /** Within the triangles; above 0 where their outside is outside. */
  volume: number;
  /** Share of triangles, but for those at the image's border, where the host's image passes the iso value on the way from inside to outside. */
  bracketed: number;
}

const find = ({ positions, indices, size, toIndex, at, iso }: Asked): Found => {
  const vertex = (i: number) => [0, 1, 2].map((k) => positions[3 * (indices[i] ?? 0) + k] ?? 0);
  const minus = (a: number[], b: number[]) => a.map((value, k) => value - (b[k] ?? 0));
  const cross = ([a = 0, b = 0, c = 0]: number[], [x = 0, y = 0, z = 0]: number[]) => [
    b * z - c * y,
    c * x - a * z,
    a * y - b * x,
  ];
  const sample = (point: number[]) => {
    const place = Array.from(toIndex(point));
    const low = place.map(Math.floor);
    let sum = 0;
    for (let corner = 0; corner < 8; corner++) {
      const one = low.map((value, k) => value + ((corner >> k) & 1));
      const weight = one.reduce((product, value, k) => product * (1 - Math.abs(value - (place[k] ?? 0))), 1);
      if (weight > 0) sum += weight * at(one[0] ?? 0, one[1] ?? 0, one[2] ?? 0);
    }
    return sum;
  };
  let volume = 0;
  let asked = 0;
  let passed = 0;
  for (let i = 0; i < indices.length; i += 3) {
    const [a, b, c] = [vertex(i), vertex(i + 1), vertex(i + 2)];
    const normal = cross(minus(b, a), minus(c, a));
    volume += a.reduce((sum, value, k) => sum + value * (normal[k] ?? 0), 0) / 6;
    const middle = a.map((value, k) => (value + (b[k] ?? 0) + (c[k] ?? 0)) / 3);
    // There it lies where the image ends.
    if (Array.from(toIndex(middle)).some((value, k) => value < 2 || value > (size[k] ?? 0) - 3)) continue;
    asked++;
    // Half an edge to both sides of the triangle's middle.
    const step = Math.sqrt(Math.hypot(...normal)) / 2 / Math.hypot(...normal);
    const side = (way: number) => sample(middle.map((value, k) => value + way * step * (normal[k] ?? 0)));
    if (side(-1) >= iso && side(1) <= iso) passed++;
  }
  return { vertices: new Set(Array.from(indices)).size, volume, bracketed: passed / asked };
};

/** Asks the host of a page. */
export function found(page: Page, name: string): Promise<Found> {
  return page.evaluate(`(${find})((${ask[name]})(window))`);
}

/** How many corners of triangles the host is to draw. */
const DRAWN: Record<string, string> = {
  three: 'window.object.geometry.drawRange.count',
  niivue: 'window.nv.meshes[0].indexCount',
  'niivue-next': 'window.nv.view.meshResources.get(window.nv.meshes[0]).indexCount',
  vtk: '3 * window.surface.polyData.getNumberOfCells()',
  itk: '3 * window.surface.polyData.getNumberOfCells()',
};

/** What a page's surface was given, from its start on. */
export interface Watched {
  /** Milliseconds of each update. */
  times: number[];
  topologies: number;
  /** Updates after which the host had another number of triangles than the mesh. */
  missed: number;
}

/** Times and counts what a page's surface is given. To be called before the page is opened. */
export async function watch(page: Page): Promise<void> {
  const drawn = Object.entries(DRAWN).map(([name, code]) => `'${name}': () => ${code}`);
  await page.addInitScript(`(${watchUpdates})({ ${drawn.join(', ')} })`);
}

function watchUpdates(drawn: Record<string, () => number>): void {
  const name = location.pathname.replace(/.*\/|\.html$/g, '');
  const topologies = new Set<number>();
  const watched = { times: [] as number[], topologies: 0, missed: 0 };
  let surface: unknown;
  const wrap = (made: Hosted) => {
    const update = made.update.bind(made);
    made.update = (mesh: { topologyVersion: number; triangleCount: number }) => {
      const started = performance.now();
      const result = update(mesh);
      watched.times.push(performance.now() - started);
      const look = (changed: boolean) => {
        if (changed) watched.topologies = topologies.add(mesh.topologyVersion).size;
        if (drawn[name]?.() !== 3 * mesh.triangleCount) watched.missed++;
        return changed;
      };
      return result instanceof Promise ? result.then(look) : look(result);
    };
    surface = made;
  };
  Object.defineProperty(window, 'surface', { get: () => surface, set: wrap });
  Object.assign(window, { watched });
}

/** What was seen. */
export const watched = (page: Page): Promise<Watched> => page.evaluate('window.watched');

/** Takes the surface out of the host's view, by the host's own means. */
export function hide(page: Page, name: string): Promise<void> {
  const ways: Record<string, string> = {
    three: 'window.object.visible = false; window.render();',
    niivue: 'await window.surface.dispose(); window.nv.drawScene();',
    'niivue-next': 'await window.surface.dispose(); window.nv.drawScene();',
    vtk: 'window.actor.setVisibility(false); window.render();',
    itk: 'window.actor.setVisibility(false); window.render();',
  };
  const drawn = 'await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));';
  return page.evaluate(`(async () => { ${ways[name]} ${drawn} })()`);
}
