// Times remeshing of a torus with elongated triangles and of a marching-cubes surface. Runs in Node and in a page.
import init, { Mesh, Volume, version } from '../pkg/index.js';

const [RING, TUBE] = [3, 1];

/** Returns a torus whose triangles are four times as long as wide. */
function torus(n, m) {
  const positions = new Float32Array(3 * n * m);
  const indices = [];
  for (let i = 0; i < n; i++) {
    for (let j = 0; j < m; j++) {
      const [a, b] = [(2 * Math.PI * i) / n, (2 * Math.PI * j) / m];
      const across = RING + TUBE * Math.cos(b);
      positions.set([across * Math.cos(a), across * Math.sin(a), TUBE * Math.sin(b)], 3 * (i * m + j));
      const at = (u, v) => (u % n) * m + (v % m);
      indices.push(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  return Mesh.fromArrays(positions, Uint32Array.from(indices));
}

/** Returns the marching-cubes surface of a gyroid in a ball. */
function gyroid(size) {
  const data = new Float32Array(size ** 3);
  const middle = (size - 1) / 2;
  for (let z = 0, at = 0; z < size; z++) {
    for (let y = 0; y < size; y++) {
      for (let x = 0; x < size; x++, at++) {
        const [a, b, c] = [x, y, z].map((k) => ((k - middle) / size) * 4 * Math.PI);
        const wave = Math.sin(a) * Math.cos(b) + Math.sin(b) * Math.cos(c) + Math.sin(c) * Math.cos(a);
        const ball = 0.45 * size - Math.hypot(x - middle, y - middle, z - middle);
        data[at] = Math.min(wave, 0.2 * ball);
      }
    }
  }
  return Mesh.marchingCubes(new Volume({ data, dims: [size, size, size] }), 0);
}

/**
 * Returns the shortest time of several runs with a target edge length relative to the mean edge, and figures of the
 * result.
 */
function timed(mesh, factor, repeats) {
  const aim = factor * mesh.info().edge.mean;
  let milliseconds = Infinity;
  let result;
  for (let run = 0; run < repeats; run++) {
    result?.free();
    result = mesh.clone();
    const start = performance.now();
    result.remesh({ min: aim / 1.5, max: aim * 1.5 });
    milliseconds = Math.min(milliseconds, performance.now() - start);
  }
  const { triangles, minAngleDegrees } = result.info();
  const { selfIntersections } = result.check();
  const distance = result.distanceTo(mesh).hausdorff / aim;
  result.free();
  const before = mesh.triangleCount;
  return { factor, milliseconds, before, triangles, minAngleDegrees, selfIntersections, distance };
}

/** Target edge lengths, relative to the mean edge. */
export const FACTORS = [0.5, 1, 3];

/** Returns the input meshes by name. */
export async function meshes() {
  await init();
  return { torus: torus(400, 50), gyroid: gyroid(64) };
}

/** Returns milliseconds, counts, the smallest angle and the distance in edge lengths, for each mesh and factor. */
export async function measure(repeats) {
  const rows = Object.entries(await meshes()).flatMap(([name, mesh]) =>
    FACTORS.map((factor) => ({ name, ...timed(mesh, factor, repeats) })),
  );
  return { version: version(), rows };
}
