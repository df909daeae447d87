// Finds a surface in a computed OME-Zarr image, by default of a terabyte, through the built package, and prints memory
// and time: `node scripts/large-volume.mjs [SIDE LEVELS FINEST BOX WHOLE]`, the numbers of voxels of the cube's side and of
// levels, the level to end at, the side of the box in which levels finer than WHOLE are followed (0 for none).

import { parseArgs } from 'node:util';
import init, { DeformableModel } from '../pkg/index.js';
import { openZarr } from '../pkg/zarr/index.js';
import { say, script } from './shell.mjs';

const CHUNK = 64;

/** Number of voxels along the side of blocks of a chunk; those far from the boundary are filled at once. */
const BLOCK = 8;

/** Half of the diagonal of a cube, rounded up, in its sides. */
const DIAGONAL = 0.87;

/** Half of the width of the boundary, in voxels. */
const SOFT = 2;

/** Intensity of the object; its boundary is at half of it. */
const OBJECT = 1000;

/** Branches of the object: both ends, and the radius, in units of the image's side. */
const BRANCHES = [
  [0.35, 0.4, 0.4, 0.7, 0.5, 0.45, 0.03],
  [0.7, 0.5, 0.45, 0.85, 0.7, 0.6, 0.02],
  [0.7, 0.5, 0.45, 0.86, 0.4, 0.3, 0.02],
  [0.85, 0.7, 0.6, 0.8, 0.88, 0.75, 0.014],
  [0.85, 0.7, 0.6, 0.93, 0.8, 0.5, 0.014],
  [0.35, 0.4, 0.4, 0.3, 0.75, 0.7, 0.025],
  [0.3, 0.75, 0.7, 0.15, 0.9, 0.85, 0.016],
  [0.3, 0.75, 0.7, 0.5, 0.85, 0.9, 0.016],
];

/** Returns the distance of a point outside a ball with a cavity and branches, in units of the image's side. */
function distance(x, y, z, branches) {
  const ball = Math.hypot(x - 0.35, y - 0.4, z - 0.4);
  let least = ball - 0.14;
  for (const [ax, ay, az, bx, by, bz, radius] of branches) {
    const [dx, dy, dz, px, py, pz] = [bx - ax, by - ay, bz - az, x - ax, y - ay, z - az];
    const along = Math.min(1, Math.max(0, (px * dx + py * dy + pz * dz) / (dx * dx + dy * dy + dz * dz)));
    least = Math.min(least, Math.hypot(px - along * dx, py - along * dy, pz - along * dz) - radius);
  }
  return Math.max(least, 0.06 - ball);
}

/** A store of zarrita whose chunks are computed; it adds up the time that this takes. */
class ComputedStore {
  milliseconds = 0;
  #side;
  #levels;

  constructor(side, levels) {
    [this.#side, this.#levels] = [side, levels];
  }

  async get(key) {
    const began = performance.now();
    const bytes = this.#compute(key);
    this.milliseconds += performance.now() - began;
    return bytes;
  }

  #compute(key) {
    const json = (value) => new TextEncoder().encode(JSON.stringify(value));
    if (key === '/zarr.json') {
      return json({
        zarr_format: 3,
        node_type: 'group',
        attributes: { ome: { version: '0.5', multiscales: [this.#image()] } },
      });
    }
    const [, level, rest] = /^\/(\d+)\/(.+)$/.exec(key) ?? [];
    if (rest === 'zarr.json') return json(this.#array(Number(level)));
    const chunk = /^c\/(\d+)\/(\d+)\/(\d+)$/.exec(rest ?? '');
    return chunk ? this.#chunk(Number(level), chunk.slice(1).map(Number).reverse()) : undefined;
  }

  #image() {
    const transforms = (level) => [
      { type: 'scale', scale: [0, 0, 0].fill(2 ** level) },
      { type: 'translation', translation: [0, 0, 0].fill((2 ** level - 1) / 2) },
    ];
    const levels = Array.from({ length: this.#levels }, (_, level) => level);
    return {
      axes: ['z', 'y', 'x'].map((name) => ({ name, type: 'space' })),
      datasets: levels.map((level) => ({ path: `${level}`, coordinateTransformations: transforms(level) })),
    };
  }

  #array(level) {
    return {
      ...{ zarr_format: 3, node_type: 'array', data_type: 'uint16', fill_value: 0, attributes: {} },
      shape: [0, 0, 0].fill(this.#side >> level),
      chunk_grid: { name: 'regular', configuration: { chunk_shape: [CHUNK, CHUNK, CHUNK] } },
      chunk_key_encoding: { name: 'default', configuration: { separator: '/' } },
      codecs: [{ name: 'bytes', configuration: { endian: 'little' } }],
    };
  }

  #chunk(level, position) {
    const at = (index) => index.map((k, axis) => ((position[axis] * CHUNK + k + 0.5) * 2 ** level - 0.5) / this.#side);
    // Distance in voxels of the level.
    const from = (index, branches) => (distance(...at(index), branches) * this.#side) / 2 ** level;
    const near = BRANCHES.filter((branch) => from([31.5, 31.5, 31.5], [branch]) < DIAGONAL * CHUNK + SOFT);
    const voxels = new Uint16Array(CHUNK ** 3);
    for (const block of cube(CHUNK / BLOCK)) {
      const first = block.map((k) => k * BLOCK);
      const middle = from(
        first.map((k) => k + (BLOCK - 1) / 2),
        near,
      );
      const isMixed = Math.abs(middle) < DIAGONAL * BLOCK + SOFT;
      if (!isMixed && middle > 0) continue;
      for (const [x, y, z] of cube(BLOCK)) {
        const index = [first[0] + x, first[1] + y, first[2] + z];
        const share = isMixed ? Math.min(1, Math.max(0, 0.5 - from(index, near) / (2 * SOFT))) : 1;
        voxels[index[0] + CHUNK * (index[1] + CHUNK * index[2])] = OBJECT * share;
      }
    }
    return new Uint8Array(voxels.buffer);
  }
}

/** Returns all indices within a cube. */
function cube(side) {
  return Array.from({ length: side ** 3 }, (_, k) => [
    k % side,
    Math.floor(k / side) % side,
    Math.floor(k / side ** 2),
  ]);
}

await script(async () => {
  const { positionals } = parseArgs({ allowPositionals: true });
  const given = positionals.map(Number);
  const [side, levels, finest, box, whole] = [8192, 7, 0, 2048, 2].map((value, k) => given[k] ?? value);
  const { memory } = await init();
  const store = new ComputedStore(side, levels);
  const image = await openZarr(store);
  const min = [0.6, 0.4, 0.35].map((x) => x * side);
  const within = box > 0 && { box: { min, max: min.map((x) => x + box), outside: whole } };
  const model = new DeformableModel({ volume: image, finest, ...within, params: { iso: OBJECT / 2, isoForce: -1 } });
  const began = performance.now();
  const report = await model.run({
    onStep: ({ iteration, phase, vertices }) => say(`${iteration} ${phase}: ${vertices} vertices, ${mb(memory)}`),
  });
  const seconds = (performance.now() - began) / 1e3;
  const chunks = image.loaded().map(({ chunks }) => chunks);
  say(`${report.vertices} vertices, ${report.components} parts, χ ${report.euler}; chunks by level ${chunks}`);
  say(
    `${(seconds - store.milliseconds / 1e3).toFixed(1)} s without the store, which took ${(store.milliseconds / 1e3).toFixed(1)} s`,
  );
  say(`memory of the module: ${mb(memory)}`);
});

function mb(memory) {
  return `${Math.round(memory.buffer.byteLength / 2 ** 20)} MB`;
}
