// Times voxelisation of a lumpy torus, beside marching cubes of the volume. Runs in Node and in a page.
import init, { Mesh, Volume, version } from '../pkg/index.js';

/** Voxels along each side, and vertices along the ring of the torus, of which it has four times as many as across. */
const SIZES = [
  { size: 128, ring: 316 },
  { size: 256, ring: 632 },
];

/** Returns a torus of radius 0.8 with lumps on its tube, and a little noise. */
function lumpy(ring) {
  const tube = ring / 4;
  const positions = new Float32Array(3 * ring * tube);
  const indices = [];
  for (let i = 0; i < ring; i++) {
    for (let j = 0; j < tube; j++) {
      const [a, b] = [(2 * Math.PI * i) / ring, (2 * Math.PI * j) / tube];
      const noise = (0.3 / ring) * Math.sin(7919 * (i * tube + j));
      const radius = 0.3 * (1 + 0.25 * Math.sin(9 * a) * Math.sin(3 * b)) + noise;
      const across = 0.8 + radius * Math.cos(b);
      positions.set([across * Math.cos(a), across * Math.sin(a), radius * Math.sin(b)], 3 * (i * tube + j));
      const at = (u, v) => (u % ring) * tube + (v % tube);
      indices.push(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  return Mesh.fromArrays(positions, Uint32Array.from(indices));
}

/** Returns the shortest time of several runs in milliseconds, and the last result. */
function timed(repeats, work) {
  let milliseconds = Infinity;
  let result;
  for (let run = 0; run < repeats; run++) {
    result?.free();
    const start = performance.now();
    result = work();
    milliseconds = Math.min(milliseconds, performance.now() - start);
  }
  return { milliseconds, result };
}

function measured({ size, ring }, repeats) {
  const mesh = lumpy(ring);
  const spacing = 2.6 / size;
  const [sides, origin] = [spacing, -1.3 + spacing / 2].map((value) => [value, value, value]);
  const grid = new Volume({ data: new Uint8Array(size ** 3), dims: [size, size, size], spacing: sides, origin });
  const kinds = ['mask', 'coverage', 'distance'].map((kind) => {
    const { milliseconds, result } = timed(repeats, () => mesh.toVolume(grid, { kind }));
    return { kind, milliseconds, result };
  });
  const cubes = timed(repeats, () => Mesh.marchingCubes(kinds[2].result, 0)).milliseconds;
  const rows = kinds.map(({ kind, milliseconds }) => ({ kind, milliseconds, ratio: milliseconds / cubes }));
  return { size, triangles: mesh.triangleCount, cubes, rows };
}

/** Returns milliseconds of each kind of volume, also relative to marching cubes of the distances. */
export async function measure(repeats) {
  await init();
  return { version: version(), sizes: SIZES.map((one) => measured(one, repeats)) };
}
