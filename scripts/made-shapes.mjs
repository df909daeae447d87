// Twenty closed shapes for `npm run real -- --clouds`, on which no setting of the package was chosen. Each is a function that is negative inside,
// in a box of side 2 around the origin; its fine iso-surface is the reference.

/** Half of the side of the box in which a shape is extracted: some more than the shape. */
const REACH = 1.1;
/** Cells along a side; where the radius of curvature is .1, a chord of a cell is at most .12 per mille of the side off. */
const CELLS = 160;

const { abs, atan2, cos, hypot, max, min, PI, sin } = Math;

const clamp = (x, low, high) => min(max(x, low), high);
const ball = (cx, cy, cz, radius) => (x, y, z) => hypot(x - cx, y - cy, z - cz) - radius;
const box = (a, b, c) => (x, y, z) => max(abs(x) - a, abs(y) - b, abs(z) - c);
const union =
  (...shapes) =>
  (x, y, z) => {
    let least = Infinity;
    for (const shape of shapes) least = min(least, shape(x, y, z));
    return least;
  };
const cut =
  (shape, ...others) =>
  (x, y, z) => {
    let most = shape(x, y, z);
    for (const other of others) most = max(most, -other(x, y, z));
    return most;
  };
const moved = (shape, dx, dy, dz) => (x, y, z) => shape(x - dx, y - dy, z - dz);

/** A union whose seam is rounded over a width. */
const blended =
  (width, ...shapes) =>
  (x, y, z) => {
    let value = Infinity;
    for (const shape of shapes) {
      const next = shape(x, y, z);
      const overlap = max(width - abs(value - next), 0) / width;
      value = min(value, next) - overlap * overlap * width * 0.25;
    }
    return value;
  };

/** A capsule between two points, with a radius at each. */
function capsule([ax, ay, az], [bx, by, bz], first, last = first) {
  const [ux, uy, uz] = [bx - ax, by - ay, bz - az];
  const square = ux * ux + uy * uy + uz * uz;
  return (x, y, z) => {
    const t = clamp(((x - ax) * ux + (y - ay) * uy + (z - az) * uz) / square, 0, 1);
    return hypot(x - ax - t * ux, y - ay - t * uy, z - az - t * uz) - first - t * (last - first);
  };
}

const torus = (ring, thick) => (x, y, z) => hypot(hypot(x, y) - ring, z) - thick;
const cylinder = (radius, half) => (x, y, z) => max(hypot(x, y) - radius, abs(z) - half);

function gear() {
  const teeth = (x, y) => 0.78 + 0.12 * clamp(3 * sin(12 * atan2(y, x)), -1, 1);
  return cut((x, y, z) => max((hypot(x, y) - teeth(x, y)) * 0.7, abs(z) - 0.2), cylinder(0.25, 1));
}

function spring() {
  const turns = [-1, 0, 1, 2, 3];
  return (x, y, z) => {
    const around = atan2(y, x) / (2 * PI);
    let least = Infinity;
    for (const k of turns) {
      const turn = clamp(around + k, 0, 3);
      const angle = 2 * PI * turn;
      least = min(least, hypot(x - 0.65 * cos(angle), y - 0.65 * sin(angle), z + 0.75 - 0.5 * turn));
    }
    // The distance to the curve at the same angle, which is hardly more than that to the nearest point, since the turns are flat.
    return least - 0.11;
  };
}

function linkedRings() {
  const ring = torus(0.55, 0.14);
  return union(moved(ring, -0.28, 0, 0), (x, y, z) => ring(x - 0.28, z, y));
}

function figure() {
  return blended(
    0.06,
    ball(0, 0, 0.75, 0.2),
    capsule([0, 0, -0.05], [0, 0, 0.42], 0.2, 0.24),
    capsule([0.2, 0, 0.4], [0.72, 0.1, 0.2], 0.1, 0.07),
    capsule([-0.2, 0, 0.4], [-0.6, 0.1, 0.8], 0.1, 0.07),
    capsule([0.13, 0, -0.1], [0.3, 0, -0.85], 0.13, 0.09),
    capsule([-0.13, 0, -0.1], [-0.2, -0.3, -0.8], 0.13, 0.09),
  );
}

function mug() {
  const handle = (x, y, z) => hypot(hypot(x - 0.55, z) - 0.35, y) - 0.08;
  const solid = blended(0.05, cylinder(0.55, 0.75), handle);
  return cut(solid, moved(cylinder(0.43, 0.75), 0, 0, 0.13));
}

function star() {
  return (x, y, z) => {
    const angle = abs(((((atan2(y, x) + 2 * PI) * 5) / (2 * PI)) % 1) - 0.5) * 2;
    return (hypot(x, y) + abs(z) * 1.6 - 0.38 - 0.57 * angle * angle) * 0.5;
  };
}

function plateWithHoles() {
  const holes = [-0.6, 0, 0.6].flatMap((x) => [
    moved(cylinder(0.17, 1), x, -0.3, 0),
    moved(cylinder(0.17, 1), x, 0.3, 0),
  ]);
  return cut(box(0.98, 0.65, 0.08), ...holes);
}

const nearBalls = () => union(ball(-0.5, 0, 0, 0.45), ball(0.52, 0.1, 0, 0.46));
const shell = () => cut(ball(0, 0, 0, 0.95), (x, y, z) => hypot(x / 0.83, y / 0.8, z / 0.8) * 0.8 - 0.8);
const dumbbell = () =>
  blended(0.05, ball(-0.65, 0, 0, 0.33), ball(0.65, 0, 0, 0.33), capsule([-0.6, 0, 0], [0.6, 0, 0], 0.09));

function bowl() {
  return (x, y, z) => max(abs(hypot(x, y, z - 0.5) - 0.88) - 0.07, z - 0.35);
}

function screw() {
  const thread = (x, y, z) => 0.24 + 0.07 * cos(atan2(y, x) - (2 * PI * z) / 0.28);
  const shaft = (x, y, z) => max((hypot(x, y) - thread(x, y, z)) * 0.6, abs(z + 0.2) - 0.78);
  const hexagon = (x, y) => max(abs(x), abs(x * 0.5 + y * 0.866), abs(x * 0.5 - y * 0.866));
  return union(shaft, (x, y, z) => max(hexagon(x, y) - 0.5, abs(z - 0.72) - 0.2));
}

function pipes() {
  const ends = [90, 210, 330].map((degrees) => (degrees * PI) / 180).map((a) => [cos(a), sin(a), 0]);
  const arms = (radius, long) => union(...ends.map((end) => arm(end, radius, long)));
  return cut(arms(0.3, 0.9), arms(0.18, 2));
}

/** A cylinder from the origin along a unit vector in the plane z = 0. */
function arm([ux, uy], radius, long) {
  return (x, y, z) => {
    const t = x * ux + y * uy;
    const across = hypot(x - max(t, 0) * ux, y - max(t, 0) * uy, z);
    return max(across - radius, t - long);
  };
}

function chain() {
  const link = (x, y, z) => hypot(hypot(max(abs(x) - 0.17, 0), y) - 0.18, z) - 0.07;
  const turned = (x, y, z) => link(x, z, y);
  return union(moved(link, -0.58, 0, 0), turned, moved(link, 0.58, 0, 0));
}

function flower() {
  const petals = (x, y, z) => {
    const radius = 0.62 + 0.3 * cos(6 * atan2(y, x));
    const height = 0.35 * (x * x + y * y);
    return max((hypot(x, y) - radius) * 0.4, abs(z - 0.3 - height) - 0.08);
  };
  return blended(0.05, petals, ball(0, 0, 0.35, 0.22), capsule([0, 0, 0.3], [0.15, 0, -0.9], 0.07));
}

function gyroid() {
  const k = (2 * PI) / 1.5;
  // Shifted, so that the ball cuts nothing off.
  const wave = (shifted, y, z, x = shifted + 0.4) =>
    sin(k * x) * cos(k * y) + sin(k * y) * cos(k * z) + sin(k * z) * cos(k * x);
  return (x, y, z) => max(wave(x, y, z) / (1.5 * k), hypot(x, y, z) - 0.97);
}

function dentedCube() {
  const dents = [0, 1, 2].flatMap((axis) =>
    [-1, 1].map((side) => [0, 1, 2].map((k) => (k === axis ? side * 0.95 : 0))),
  );
  return cut(box(0.8, 0.8, 0.8), ...dents.map(([x, y, z]) => ball(x, y, z, 0.42)));
}

function bottle() {
  const profile = (z) =>
    z < 0.2 ? 0.42 : 0.42 - 0.27 * clamp((z - 0.2) / 0.35, 0, 1) ** 2 * (3 - 2 * clamp((z - 0.2) / 0.35, 0, 1));
  const wall = (grow) => (x, y, z) => (hypot(x, y) - profile(z) + grow) * 0.6;
  const outer = (x, y, z) => max(wall(0)(x, y, z), abs(z) - 0.95);
  return cut(outer, (x, y, z) => max(wall(0.08)(x, y, z), -0.85 - z));
}

function wrench() {
  const head = (x, y, z) => max(hypot(x - 0.7, y) - 0.28, abs(z) - 0.1);
  const eye = (x, y, z) => max(hypot(x + 0.72, y) - 0.25, abs(z) - 0.1);
  const handle = (x, y, z) => max(abs(x) - 0.7, abs(y) - 0.11, abs(z) - 0.07);
  const jaw = (x, y, z) => max(abs(y) - 0.12, 0.66 - x, abs(z) - 1);
  return cut(union(head, eye, handle), jaw, moved(cylinder(0.13, 1), -0.72, 0, 0));
}

function beads() {
  const angles = Array.from({ length: 11 }, (_, k) => (2 * PI * k) / 11);
  return blended(0.04, torus(0.75, 0.06), ...angles.map((a) => ball(0.75 * cos(a), 0.75 * sin(a), 0, 0.17)));
}

/** The shapes by name. */
export const SHAPES = {
  ...{ gear, spring, 'linked rings': linkedRings, figure, mug, star, 'plate with holes': plateWithHoles },
  ...{ 'near balls': nearBalls, shell, dumbbell, bowl, screw, pipes, chain, flower, gyroid },
  ...{ 'dented cube': dentedCube, bottle, wrench, beads },
};

/** Returns the surface of a function that is negative inside, in a box of side 2. */
export function surfaceOf({ Mesh, Volume }, inside, cells = CELLS) {
  const n = cells + 1;
  const step = (2 * REACH) / cells;
  const data = new Float32Array(n ** 3);
  for (let i = 0; i < data.length; i++) {
    const [x, y, z] = [i % n, Math.floor(i / n) % n, Math.floor(i / (n * n))].map((k) => k * step - REACH);
    data[i] = -inside(x, y, z);
  }
  const volume = new Volume({ data, dims: [n, n, n], spacing: [step, step, step], origin: [-REACH, -REACH, -REACH] });
  const mesh = Mesh.marchingCubes(volume, 0);
  volume.free();
  return mesh;
}
