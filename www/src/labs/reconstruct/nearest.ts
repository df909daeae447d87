/** Computes the distances of positions from the nearest point of a cloud, by a uniform grid, to colour the surface. */

/**
 * Target mean number of points per occupied cell of the grid: smaller ones leave many cells empty, larger ones make
 * searches slower.
 */
const PER_CELL = 4;
/**
 * Largest number of grid cells along the longest side of the points' bounding box; points on the far border take one
 * more.
 */
const MOST_CELLS = 96;

/** Points sorted into the cells of a uniform grid, for nearest-point queries. */
class PointGrid {
  readonly #points: Float32Array;
  readonly #low = [0, 0, 0];
  readonly #dims = [1, 1, 1];
  readonly #cell: number;
  /**
   * For each cell, the index of its first entry in `#list`, the indices of all points sorted by cell; a final entry
   * holds the number of points.
   */
  readonly #begin: Uint32Array;
  readonly #list: Uint32Array;

  constructor(points: Float32Array) {
    this.#points = points;
    const high = [0, 0, 0];
    for (let axis = 0; axis < 3; axis++) [this.#low[axis], high[axis]] = span(points, axis);
    const sides = high.map((value, axis) => value - (this.#low[axis] ?? 0));
    const longest = Math.max(...sides, 1e-30);
    // Points lie on a surface: their number grows with the square of the cells along a side.
    const across = Math.min(MOST_CELLS, Math.max(1, Math.sqrt(points.length / 3 / PER_CELL)));
    this.#cell = longest / across;
    for (let axis = 0; axis < 3; axis++) this.#dims[axis] = Math.floor((sides[axis] ?? 0) / this.#cell) + 1;
    const count = points.length / 3;
    const cells = Uint32Array.from({ length: count }, (_, i) => this.#cellOf(points, 3 * i));
    this.#begin = new Uint32Array(this.#dims.reduce((a, b) => a * b) + 1);
    for (const cell of cells) this.#begin[cell + 1] = (this.#begin[cell + 1] ?? 0) + 1;
    for (let i = 1; i < this.#begin.length; i++) this.#begin[i] = (this.#begin[i] ?? 0) + (this.#begin[i - 1] ?? 0);
    const next = this.#begin.slice();
    this.#list = new Uint32Array(count);
    cells.forEach((cell, i) => {
      const at = next[cell] ?? 0;
      next[cell] = at + 1;
      this.#list[at] = i;
    });
  }

  /**
   * Returns the distance from the position that begins at element `offset` of packed `positions` to the nearest point
   * of the cloud: searches shell by shell around the position's cell, until no nearer point can follow.
   */
  distance(positions: Float32Array, offset: number): number {
    const centre = [0, 1, 2].map((axis) => this.#index(positions[offset + axis] ?? 0, axis));
    // Outside the grid, the distance is larger than the number of shells implies.
    const beyond = this.#distanceOutside(positions, offset);
    let best = Number.POSITIVE_INFINITY;
    const last = Math.max(...this.#dims);
    for (let shell = 0; shell <= last; shell++) {
      const near = Math.max(beyond, (shell - 1) * this.#cell);
      if (near * near >= best) break;
      best = this.#searchShell(centre, shell, positions, offset, best);
    }
    return Math.sqrt(best);
  }

  #searchShell(centre: number[], shell: number, positions: Float32Array, offset: number, found: number): number {
    let best = found;
    const [cx = 0, cy = 0, cz = 0] = centre;
    for (let z = cz - shell; z <= cz + shell; z++) {
      for (let y = cy - shell; y <= cy + shell; y++) {
        const full = Math.abs(z - cz) === shell || Math.abs(y - cy) === shell;
        const step = full || shell === 0 ? 1 : 2 * shell;
        for (let x = cx - shell; x <= cx + shell; x += step) {
          if (this.#has(x, y, z)) best = this.#searchCell(x, y, z, positions, offset, best);
        }
      }
    }
    return best;
  }

  #searchCell(x: number, y: number, z: number, positions: Float32Array, offset: number, found: number): number {
    let best = found;
    const [nx = 1, ny = 1] = this.#dims;
    const cell = x + nx * (y + ny * z);
    for (let i = this.#begin[cell] ?? 0; i < (this.#begin[cell + 1] ?? 0); i++) {
      best = Math.min(best, squared(this.#points, 3 * (this.#list[i] ?? 0), positions, offset));
    }
    return best;
  }

  #has(x: number, y: number, z: number): boolean {
    const [nx = 1, ny = 1, nz = 1] = this.#dims;
    return x >= 0 && y >= 0 && z >= 0 && x < nx && y < ny && z < nz;
  }

  #distanceOutside(positions: Float32Array, offset: number): number {
    let most = 0;
    for (let axis = 0; axis < 3; axis++) {
      const from = (positions[offset + axis] ?? 0) - (this.#low[axis] ?? 0);
      most = Math.max(most, -from, from - (this.#dims[axis] ?? 1) * this.#cell);
    }
    return most;
  }

  #index(value: number, axis: number): number {
    const at = Math.floor((value - (this.#low[axis] ?? 0)) / this.#cell);
    return Math.min((this.#dims[axis] ?? 1) - 1, Math.max(0, at));
  }

  #cellOf(points: Float32Array, offset: number): number {
    const [x = 0, y = 0, z = 0] = [0, 1, 2].map((axis) => this.#index(points[offset + axis] ?? 0, axis));
    const [nx = 1, ny = 1] = this.#dims;
    return x + nx * (y + ny * z);
  }
}

/** Returns the smallest and the largest coordinate of packed points along an axis, 0 to 2. */
export function span(points: ArrayLike<number>, axis: number): [number, number] {
  let [low, high] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY];
  for (let i = axis; i < points.length; i += 3) {
    low = Math.min(low, points[i] ?? 0);
    high = Math.max(high, points[i] ?? 0);
  }
  return [low, high];
}

function squared(a: Float32Array, i: number, b: Float32Array, j: number): number {
  const x = (a[i] ?? 0) - (b[j] ?? 0);
  const y = (a[i + 1] ?? 0) - (b[j + 1] ?? 0);
  const z = (a[i + 2] ?? 0) - (b[j + 2] ?? 0);
  return x * x + y * y + z * z;
}

/**
 * Returns, for each of the `positions`, the distance to the nearest of the `points`, both packed xyz; infinite if there
 * are no points.
 */
export function distances(positions: Float32Array, points: Float32Array): Float32Array {
  const out = new Float32Array(positions.length / 3).fill(Number.POSITIVE_INFINITY);
  if (points.length === 0) return out;
  const grid = new PointGrid(points);
  for (let i = 0; i < out.length; i++) out[i] = grid.distance(positions, 3 * i);
  return out;
}
