/** The live pages of www/embed: access to the surface and the volume of each host. */
import type { Page } from 'playwright-core';

/** The objects that a page leaves on `window`, for any host. */
// biome-ignore lint/suspicious/noExplicitAny: five hosts, each with objects of its own
export type Hosted = Window & Record<string, any>;

/** A surface in its host's world space, and the host's image around it. */
export interface Asked {
  positions: ArrayLike<number>;
  indices: ArrayLike<number>;
  /** Number of voxels along the host's axes. */
  size: ArrayLike<number>;
  /** Returns the host's voxel index of a world point, by the host's own functions. */
  toIndex: (point: number[]) => ArrayLike<number>;
  /** Returns the host's intensity at an integer index. */
  at: (i: number, j: number, k: number) => number;
  iso: number;
}

/** Reads surface and image of each host. Runs in the page, like all functions below. */
const ask: Record<string, (page: Hosted) => Asked> = {
  three: ({ tooth, object, model }) => {
    const { matrix } = tooth;
    const [x, y, z] = [tooth.xLength, tooth.yLength, tooth.zLength];
    // Slices are drawn around the centre of the volume.
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
    // Rows of the matrix; the axes of this head are parallel to those of the world.
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
    // Directions are orthogonal unit vectors, so their transpose is their inverse.
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

/** Measures of the host's surface in its world space. */
export interface Found {
  vertices: number;
  /** Volume enclosed by the triangles; positive if they face outwards. */
  volume: number;
  /**
   * Fraction of triangles across which the host's image passes the iso value from inside to outside; triangles at the
   * image's border are not counted.
   */
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
    // At the border the surface follows the end of the image.
    if (Array.from(toIndex(middle)).some((value, k) => value < 2 || value > (size[k] ?? 0) - 3)) continue;
    asked++;
    // Half an edge length to both sides of the triangle's centre.
    const step = Math.sqrt(Math.hypot(...normal)) / 2 / Math.hypot(...normal);
    const side = (way: number) => sample(middle.map((value, k) => value + way * step * (normal[k] ?? 0)));
    if (side(-1) >= iso && side(1) <= iso) passed++;
  }
  return { vertices: new Set(Array.from(indices)).size, volume, bracketed: passed / asked };
};

/** Measures the surface of a page in its host. */
export function found(page: Page, name: string): Promise<Found> {
  return page.evaluate(`(${find})((${ask[name]})(window))`);
}

/** Expressions for the number of vertex indices that each host draws. */
const DRAWN: Record<string, string> = {
  three: 'window.object.geometry.drawRange.count',
  niivue: 'window.nv.meshes[0].indexCount',
  'niivue-next': 'window.nv.view.meshResources.get(window.nv.meshes[0]).indexCount',
  vtk: '3 * window.surface.polyData.getNumberOfCells()',
  itk: '3 * window.surface.polyData.getNumberOfCells()',
};

/** Updates of a page's surface, since its start. */
export interface Watched {
  /** Milliseconds of each update. */
  times: number[];
  topologies: number;
  /** Number of updates after which the host did not have the same number of triangles as the mesh. */
  missed: number;
}

/** Times and counts the updates of a page's surface. Must be called before the page is opened. */
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

/** Returns the recorded updates. */
export const watched = (page: Page): Promise<Watched> => page.evaluate('window.watched');

/** Removes the surface from the host's view, by the host's own means. */
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
