// Times strokes of a brush on a label map whose surfaces follow, and full extractions of the same label map. Runs in
// Node and in a page.
import init, { LabelSurfaces, Mesh, Volume, version } from '../pkg/index.js';
import { randomNumbers } from './random.mjs';

/** Voxels along each side of the volume. */
const SIDE = 256;
/** Number of balls, each with a label of its own, that touch, and their radius in voxels: 100,000 vertices in all. */
const LABELS = 9;
const BALL = 27;
/** Radius of the brush in voxels. */
const BRUSH = 6;
const STROKES = 200;

/** The voxels of balls around random points: each voxel belongs to the nearest point. */
function balls(random, labels) {
  const data = new Uint8Array(SIDE ** 3);
  const coordinate = () => SIDE * (0.3 + 0.4 * random());
  const centres = Array.from({ length: labels }, () => [coordinate(), coordinate(), coordinate()]);
  for (const [index, [cx, cy, cz]] of centres.entries()) {
    for (let z = Math.floor(cz - BALL); z <= cz + BALL; z += 1) {
      for (let y = Math.floor(cy - BALL); y <= cy + BALL; y += 1) {
        for (let x = Math.floor(cx - BALL); x <= cx + BALL; x += 1) {
          const distances = centres.map(([a, b, c]) => Math.hypot(x - a, y - b, z - c));
          const own = distances[index];
          if (own < BALL && own <= Math.min(...distances)) data[x + SIDE * (y + SIDE * z)] = index + 1;
        }
      }
    }
  }
  return data;
}

/** Paints a ball of `label` at `centre`, and returns its region with the new voxels. */
function paint(data, centre, label) {
  const min = centre.map((c) => Math.max(Math.round(c) - BRUSH, 0));
  const max = centre.map((c) => Math.min(Math.round(c) + BRUSH, SIDE - 1));
  const dims = min.map((low, axis) => max[axis] - low + 1);
  const voxels = new Uint8Array(dims[0] * dims[1] * dims[2]);
  let at = 0;
  for (let z = min[2]; z <= max[2]; z += 1) {
    for (let y = min[1]; y <= max[1]; y += 1) {
      for (let x = min[0]; x <= max[0]; x += 1, at += 1) {
        const index = x + SIDE * (y + SIDE * z);
        if (Math.hypot(x - centre[0], y - centre[1], z - centre[2]) <= BRUSH) data[index] = label;
        voxels[at] = data[index];
      }
    }
  }
  return { min, dims, data: voxels };
}

/**
 * The kinds of strokes: from a vertex of a surface and its normal, to the centres of the brush and the label that it
 * paints, 0 to erase.
 */
const along = (point, normal, distance) => point.map((c, axis) => c + distance * normal[axis]);
const KINDS = {
  add: (point, normal, label) => [[along(point, normal, 3)], label],
  erase: (point, normal) => [[along(point, normal, -2)], 0],
  bridge: (point, normal, label) => [[0, 6, 12].map((distance) => along(point, normal, distance)), label],
  drill: (point, normal) => [[0, -8, -16, -24, -32, -40, -48, -56].map((d) => along(point, normal, d)), 0],
  island: (point, normal, label) => [[along(point, normal, 16)], label],
  relabel: (point, _, label) => [[point], (label % LABELS) + 1],
};

function median(numbers) {
  return numbers.toSorted((a, b) => a - b)[Math.floor(numbers.length / 2)];
}

/** Returns the time of a call in milliseconds. */
function timed(work) {
  const began = performance.now();
  work();
  return performance.now() - began;
}

/** Full extraction of all labels by marching cubes: a mask and a surface for each. */
function extractAll(volume) {
  for (const { value } of volume.labels()) {
    const mask = volume.label(value);
    const mesh = Mesh.marchingCubes(mask, 0.5);
    mesh.arrays();
    mesh.free();
    mask.free();
  }
}

/** Strokes of all kinds on a label map of `labels` balls; returns the times of each kind, and of full extractions. */
function measureStrokes(labels) {
  const random = randomNumbers(5);
  const data = balls(random, labels);
  const volume = new Volume({ data, dims: [SIDE, SIDE, SIDE] });
  const surfaces = new LabelSurfaces({ volume });
  const start = timed(() => surfaces.step(100));
  const times = Object.fromEntries(Object.keys(KINDS).map((kind) => [kind, []]));
  let report = surfaces.step();
  const { vertices } = report;
  for (let stroke = 0; stroke < STROKES; stroke += 1) {
    const kind = Object.keys(KINDS)[stroke % 6];
    const label = surfaces.labels[Math.floor(random() * surfaces.labels.length)];
    const { positions, normals } = surfaces.mesh(label).arrays();
    const vertex = 3 * Math.floor((random() * positions.length) / 3);
    const [centres, painted] = KINDS[kind](
      [...positions.slice(vertex, vertex + 3)],
      [...normals.slice(vertex, vertex + 3)],
      label,
    );
    // A stroke of several dabs is settled after each.
    for (const centre of centres) {
      if (centre.some((c) => c < 0 || c > SIDE - 1)) continue;
      const region = paint(data, centre, painted);
      volume.write(region);
      const { min, dims } = region;
      times[kind].push(
        timed(() => {
          surfaces.refresh({ min, dims });
          report = surfaces.step(100);
        }),
      );
    }
  }
  const full = Math.min(...[1, 2, 3].map(() => timed(() => extractAll(volume))));
  const check = checkAll(surfaces);
  const all = Object.values(times).flat();
  const kinds = Object.fromEntries(Object.entries(times).map(([kind, list]) => [kind, median(list)]));
  surfaces.free();
  volume.free();
  return { labels, vertices, start, median: median(all), longest: Math.max(...all), kinds, full, ...check };
}

/** Number of self-intersections of all surfaces together. */
function checkAll(surfaces) {
  const meshes = surfaces.labels.map((label) => surfaces.mesh(label).arrays());
  const positions = new Float32Array(meshes.reduce((sum, mesh) => sum + mesh.positions.length, 0));
  const indices = new Uint32Array(meshes.reduce((sum, mesh) => sum + mesh.indices.length, 0));
  let [vertex, corner] = [0, 0];
  for (const mesh of meshes) {
    positions.set(mesh.positions, vertex);
    indices.set(
      mesh.indices.map((index) => index + vertex / 3),
      corner,
    );
    vertex += mesh.positions.length;
    corner += mesh.indices.length;
  }
  const joined = Mesh.fromArrays(positions, indices);
  const { closed, selfIntersections } = joined.check();
  joined.free();
  return { closed, selfIntersections };
}

/** Returns a row for label maps of one label and of several. */
export async function measure() {
  await init();
  return { version: version(), rows: [1, LABELS].map(measureStrokes) };
}
