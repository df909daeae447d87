// Times voxelisation of a lumpy ball, beside marching cubes of the volume. Runs in Node and in a page.
import init, { Mesh, Volume, version } from '../pkg/index.js';

/** Voxels along each side, and the longest edge of the ball of radius 1 before it becomes lumpy. */
const SIZES = [
  { size: 128, edge: 0.0197 },
  { size: 256, edge: 0.0099 },
];

/** Returns a ball with lumps and holes of up to a quarter of its radius, and some noise. */
function lumpy(edge) {
  const { positions, indices } = Mesh.icosphere([0, 0, 0], 1, edge).arrays();
  for (let at = 0; at < positions.length; at += 3) {
    const [x, y, z] = positions.subarray(at, at + 3);
    const noise = 0.2 * edge * Math.sin(7919 * at);
    const radius = 1 + 0.25 * Math.sin(5 * x) * Math.sin(6 * y) * Math.sin(7 * z + 1) + noise;
    for (let axis = 0; axis < 3; axis++) positions[at + axis] *= radius;
  }
  return Mesh.fromArrays(positions, indices);
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

function measured({ size, edge }, repeats) {
  const mesh = lumpy(edge);
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
