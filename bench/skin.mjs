// Times frames of the multiresolution model while its ellipsoids move: a lava lamp, and a bust whose head is moved.
// Runs in Node and in a page.
import init, { Mesh, MultiresolutionModel, version } from '../pkg/index.js';

const upright = (center, [a, b, c]) => ({
  center,
  axes: [
    [a, 0, 0],
    [0, b, 0],
    [0, 0, c],
  ],
});
const ball = (center, radius) => upright(center, [radius, radius, radius]);

/** Returns the three moving blobs of the lamp at a frame. */
function lamp(frame) {
  const wave = (size, period) => size * Math.sin(frame / period);
  return [
    ball([-0.8, wave(0.1, 5), 0], 1),
    ball([0.8 + wave(0.2, 7), 0, wave(0.2, 6)], 0.8),
    ball([0, 0.9 + wave(0.2, 4), 0], 0.6),
  ];
}

/** Returns crown, head, neck and chest of the bust at a frame; the first two move up and forward, and back again. */
function bust(frame) {
  const way = 15 * (1 - Math.cos(frame / 5));
  const crown = [
    [95, 0, 0],
    [0, 60.75, -44.25],
    [0, 64.9, 89.1],
  ];
  return [
    { center: [0, 125 + way, 0.67 * way], axes: crown },
    upright([0, way, 60 + 0.67 * way], [58, 75, 72]),
    upright([0, -110, 40], [42, 70, 42]),
    upright([0, -205, 5], [92, 42, 60]),
  ];
}

const middle = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];

/** Returns the median, mean and longest time of a frame, and the median time of each of its parts. */
function timed(model, pose, frames) {
  const milliseconds = [];
  const parts = {};
  let report;
  for (let frame = 0; frame < frames; frame++) {
    model.setEllipsoids(pose(frame));
    const start = performance.now();
    report = model.step();
    milliseconds.push(performance.now() - start);
    for (const [part, took] of Object.entries(report.times)) parts[part] = [...(parts[part] ?? []), took];
  }
  return {
    milliseconds: middle(milliseconds),
    longest: Math.max(...milliseconds),
    mean: milliseconds.reduce((sum, took) => sum + took, 0) / frames,
    triangles: report.triangles,
    parts: Object.fromEntries(Object.entries(parts).map(([part, took]) => [part, middle(took)])),
  };
}

/** Returns edge bounds that give about the wanted number of triangles on a surface of the given area. */
function bounds(area, triangles) {
  const edge = Math.sqrt(((area / triangles) * 4) / Math.sqrt(3));
  return { edgeMin: 0.65 * edge, edgeMax: 1.45 * edge };
}

/**
 * Times frames of both scenes at several triangle counts; `bytes` is the bust's file, and 20 × `repeats` frames are
 * timed.
 */
export async function measure(bytes, repeats) {
  await init();
  const rows = [];
  const run = (name, options, pose) => {
    const model = new MultiresolutionModel({ ...options, ellipsoids: pose(0) });
    rows.push({ name, ...timed(model, pose, 20 * repeats) });
    model.free();
  };
  for (const triangles of [5000, 10_000, 22_000]) {
    const params = { ...bounds(25, triangles), topology: 'split-and-join' };
    run('lava lamp', { params }, lamp);
  }
  const detail = Mesh.parse(bytes);
  for (const [name, triangles, supersample] of [
    ['bust', 20_000, 0],
    ['bust', 43_000, 0],
    ['bust, base halved once', 23_000, 1],
  ]) {
    run(name, { detail, params: { ...bounds(573_000, triangles), supersample } }, bust);
  }
  detail.free();
  return { version: version(), rows };
}
