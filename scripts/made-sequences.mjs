// Three computed sequences with known surfaces for `npm run real -- --sequences`, on which no setting of the package was chosen: a heart in a tilted view,
// a breathing balloon and a growing cell. Each frame has a function for the object that is negative inside, and one for the intensity.
import { randomNumbers, ricianByte } from '../bench/random.mjs';

const { abs, atan2, cos, exp, hypot, max, min, PI, sin } = Math;

/** Number of layers over the thickness of a slice whose intensities are averaged. */
const LAYERS = 4;
/** Voxels of a true surface along the shortest side of one of the image. */
const FINER = 2;

const clamp = (x, low, high) => min(max(x, low), high);
const mix = (a, b, share) => a + (b - a) * share;

/** The approximate signed distance to an ellipsoid around the origin. */
function ellipsoid(x, y, z, a, b, c) {
  const unit = hypot(x / a, y / b, z / c);
  const gradient = hypot(x / (a * a), y / (b * b), z / (c * c));
  return gradient > 0 ? (unit * (unit - 1)) / gradient : -min(a, b, c);
}

function smoothMax(a, b, width) {
  const h = max(width - abs(a - b), 0) / width;
  return max(a, b) + h * h * width * 0.25;
}

/** The share of a distance that is inside, with an edge as wide as `soft`. */
const share = (distance, soft) => clamp(0.5 - distance / soft, 0, 1);

/**
 * A ventricle with three muscles, which count as blood, tilted by 35 degrees against the slices; beside it another ventricle. It
 * contracts unevenly, turns, and moves towards its base.
 */
const heart = {
  ...{ dims: [88, 96, 15], spacing: [1.5, 1.5, 6], frames: 14, noise: 7, point: [-2, 1, 3], seed: 5 },
  frame(number) {
    const phase = number / this.frames;
    const systole = phase < 0.42 ? sin((PI * phase) / 0.84) ** 2 : exp(-(((phase - 0.42) / 0.2) ** 2));
    const [wide, flat, long] = [27 - 8.5 * systole, 24 - 8 * systole, 40 - 5 * systole];
    const tilt = (35 * PI) / 180;
    const turn = 0.25 * systole;
    const own = (x, y, z) => {
      const [u, w] = [x * cos(tilt) + z * sin(tilt), z * cos(tilt) - x * sin(tilt) + 4 * systole];
      return [u * cos(turn) + y * sin(turn), y * cos(turn) - u * sin(turn), w];
    };
    const chamber = ([x, y, z], grow) =>
      smoothMax(ellipsoid(x, y, z, wide + grow, flat + grow, long + grow), z - 17 + 7 * systole - 0.4 * grow, 4);
    const muscles = ([x, y, z]) =>
      min(...[0.4, 2.3, 4.1].map((a) => ellipsoid(x - (wide - 8) * cos(a), y - (flat - 8) * sin(a), z + 10, 4, 4, 14)));
    const right = ([x, y, z]) => ellipsoid(x + wide + 24, y - 4, z + 2, 13 - 3 * systole, 24 - 4 * systole, 30);
    return {
      object: (x, y, z) => chamber(own(x, y, z), 0),
      shade(x, y, z, soft) {
        const at = own(x, y, z);
        const blood = share(max(chamber(at, 0), -muscles(at)), soft);
        const around = mix(28, 84, share(min(chamber(at, 9 + 4 * systole), right(at) - 4), soft));
        // Coils see the near side brighter.
        return mix(mix(around, 158, share(right(at), soft)), 166, blood) * (1 - 0.0016 * y);
      },
    };
  },
};

/** A pear of constant wall that fills and empties, in other shades around it. */
const balloon = {
  ...{ dims: [60, 56, 64], spacing: [1, 1, 1], frames: 12, noise: 9, point: [0, 0, -4], seed: 6 },
  frame(number) {
    const full = 0.5 - 0.5 * cos((2 * PI * (number + 2)) / this.frames);
    const radius = 12 + 7 * full;
    const object = (x, y, z) => {
      const narrow = 1 + 0.012 * (z + 3 * full);
      return ellipsoid(x * narrow, y * narrow, z, radius, radius, radius * 1.25) / max(narrow, 1);
    };
    return {
      object,
      shade: (x, y, z, soft) =>
        mix(60 + 0.4 * x, 130, share(object(x, y, z), soft)) - 25 * exp(-(((object(x, y, z) - 3) / 1.5) ** 2)),
    };
  },
};

/** A cell that grows, drifts and buds, with fragments around it. */
const cell = {
  ...{ dims: [72, 72, 28], spacing: [0.5, 0.5, 1], frames: 10, noise: 12, point: [-3, 0, 0], seed: 7 },
  frame(number) {
    const age = number / (this.frames - 1);
    const radius = 4.5 + 3 * age;
    const middle = -3 + 2.5 * age;
    const object = (x, y, z) => {
      const bumps = 0.3 * sin(3 * atan2(y, x - middle) + age);
      const body = ellipsoid(x - middle, y, z, radius + bumps, radius + bumps, radius * 0.85);
      const bud = hypot(x - middle - radius * 0.95, y - 1, z) - 1.2 - 2.4 * age;
      return -smoothMax(-body, -bud, 1.2);
    };
    const fragments = [
      [-13, -10, 3],
      [11, 12, -4],
      [12, -12, 5],
    ];
    return {
      object,
      shade(x, y, z, soft) {
        const nearest = min(...fragments.map(([a, b, c]) => hypot(x - a, y - b, z - c) - 1.5));
        return mix(mix(22, 70, share(nearest, soft)), 125 + 12 * sin(x) * sin(y), share(object(x, y, z), soft));
      },
    };
  },
};

/** The sequences by name. */
export const SEQUENCES = { heart, balloon, cell };

const positionsOf = ({ dims, spacing }) => dims.map((n, k) => -((n - 1) / 2) * spacing[k]);

/** Returns the image of a sequence, with Rician noise, as in MR magnitude images. */
export function imageOf({ Volume }, made) {
  const random = randomNumbers(made.seed);
  const { dims, spacing, frames, noise } = made;
  const origin = positionsOf(made);
  const size = dims[0] * dims[1] * dims[2];
  const data = new Uint8Array(size * frames);
  for (let i = 0, frame = -1, shade; i < data.length; i++) {
    if (i % size === 0) shade = made.frame(++frame).shade;
    const j = i % size;
    const place = [j % dims[0], Math.floor(j / dims[0]) % dims[1], Math.floor(j / (dims[0] * dims[1]))];
    const [x, y, z] = place.map((n, k) => origin[k] + n * spacing[k]);
    let sum = 0;
    for (let layer = 0; layer < LAYERS; layer++) {
      sum += shade(x, y, z + spacing[2] * ((layer + 0.5) / LAYERS - 0.5), spacing[0]);
    }
    data[i] = ricianByte(sum / LAYERS, noise, random);
  }
  return new Volume({ data, dims: [...dims, frames], spacing, origin, frameSeconds: 0.05, unit: 'mm' });
}

/** Returns the true surface of the object in a frame. */
export function trueSurface({ Mesh, Volume }, made, frame) {
  const step = min(...made.spacing) / FINER;
  const origin = positionsOf(made);
  const dims = origin.map((low) => Math.round((-2 * low) / step) + 1);
  const { object } = made.frame(frame);
  const data = new Float32Array(dims[0] * dims[1] * dims[2]);
  for (let i = 0; i < data.length; i++) {
    const place = [i % dims[0], Math.floor(i / dims[0]) % dims[1], Math.floor(i / (dims[0] * dims[1]))];
    data[i] = -object(...place.map((n, k) => origin[k] + n * step));
  }
  const volume = new Volume({ data, dims, spacing: [step, step, step], origin });
  const mesh = Mesh.marchingCubes(volume, 0);
  volume.free();
  return mesh;
}
