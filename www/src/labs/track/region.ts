/**
 * The region of interest as a box of voxels: drawn over the slices, where its sides can be dragged, and in the 3D view.
 */
import type { Vec3 } from '../../engine/protocol';
import { token } from '../../kit/dom';
import { type Axis, type SliceOrientation, toWorld } from '../../scene/anatomy';
import type { Grip } from '../../scene/panel';
import type { VoxelBox } from './box';

/**
 * Smallest size of the region of interest along an axis, voxels; a smaller region contains no window with a boundary.
 */
const MIN_VOXELS = 4;

export class RegionGrips {
  region: VoxelBox | undefined;
  readonly #onMove: () => void;
  readonly #onDrop: (region: VoxelBox) => void;

  constructor(onMove: () => void, onDrop: (region: VoxelBox) => void) {
    this.#onMove = onMove;
    this.#onDrop = onDrop;
  }

  /**
   * Returns a grip by which those sides of the region can be dragged that are within `slack` of the position `place`
   * (both in voxels), on a slice across the axis `across`; undefined if there are none. `dims` are the volume's
   * dimensions.
   */
  grab(place: Vec3, slack: Vec3, across: Axis, dims: Vec3): Grip | undefined {
    const start = this.region;
    if (!start) return undefined;
    const within = ([0, 1, 2] as const).every(
      (axis) =>
        axis === across ||
        (place[axis] > start.low[axis] - 0.5 - slack[axis] && place[axis] < start.high[axis] + 0.5 + slack[axis]),
    );
    const near = ([0, 1, 2] as const).flatMap((axis) => {
      if (axis === across || !within) return [];
      const [toLow, toHigh] = [
        Math.abs(place[axis] - start.low[axis] + 0.5),
        Math.abs(place[axis] - start.high[axis] - 0.5),
      ];
      if (Math.min(toLow, toHigh) > slack[axis]) return [];
      return [{ axis, side: toLow < toHigh ? ('low' as const) : ('high' as const) }];
    });
    if (near.length === 0) return undefined;
    return {
      move: (to) => {
        this.region = near.reduce((box, { axis, side }) => moved(box, axis, side, to[axis], dims), start);
        this.#onMove();
      },
      drop: () => {
        if (this.region) this.#onDrop(this.region);
      },
    };
  }

  /**
   * Returns a grip that draws the region anew, as the rectangle from the position `from` to the pointer, both in voxels, on
   * a slice across the axis `across`, along which the region stays. If the pointer moves by less than `slack`, that is a
   * click, and nothing is drawn.
   */
  draw(from: Vec3, slack: Vec3, across: Axis, dims: Vec3, onClick: () => void): Grip {
    const before = this.region ?? { low: [0, 0, 0], high: lastOf(dims) };
    let isDrag = false;
    return {
      move: (to) => {
        isDrag ||= from.some(
          (start, axis) => axis !== across && Math.abs((to[axis] ?? start) - start) > (slack[axis] ?? 0),
        );
        if (!isDrag) return;
        this.region = spanned(before, from, to, across, dims);
        this.#onMove();
      },
      drop: () => {
        if (isDrag && this.region) this.#onDrop(this.region);
        else onClick();
      },
    };
  }

  /** Draws the region's outline on a slice image; the scales are the voxel size on the canvas. */
  drawOn(
    context: CanvasRenderingContext2D,
    orientation: SliceOrientation,
    dims: Vec3,
    scaleX: number,
    scaleY: number,
  ): void {
    const { region } = this;
    if (!region) return;
    const span = ({ axis, flip }: SliceOrientation['horizontal']) => {
      const [from, to] = [region.low[axis], region.high[axis] + 1];
      return flip ? [dims[axis] - to, dims[axis] - from] : [from, to];
    };
    const [[x0 = 0, x1 = 0], [y0 = 0, y1 = 0]] = [span(orientation.horizontal), span(orientation.vertical)];
    context.save();
    context.setLineDash([5, 4]);
    context.lineWidth = 1.5;
    context.strokeStyle = token('--region');
    context.strokeRect(x0 * scaleX, y0 * scaleY, (x1 - x0) * scaleX, (y1 - y0) * scaleY);
    context.restore();
  }
}

const lastOf = (dims: Vec3) => dims.map((n) => n - 1) as Vec3;

/** Returns a region with the extent of a rectangle between two positions, but along the axis `across`. */
function spanned(box: VoxelBox, from: Vec3, to: Vec3, across: Axis, dims: Vec3): VoxelBox {
  const ends: VoxelBox = { low: [...box.low], high: [...box.high] };
  for (const axis of ([0, 1, 2] as const).filter((axis) => axis !== across)) {
    const [start, end] = [from[axis], to[axis]].map(Math.round).sort((a, b) => a - b) as [number, number];
    const last = dims[axis] - 1;
    ends.low[axis] = Math.max(0, Math.min(start, last - MIN_VOXELS + 1));
    ends.high[axis] = Math.min(last, Math.max(end, ends.low[axis] + MIN_VOXELS - 1));
  }
  return ends;
}

function moved(box: VoxelBox, axis: Axis, side: 'low' | 'high', to: number, dims: Vec3): VoxelBox {
  const ends: VoxelBox = { low: [...box.low], high: [...box.high] };
  if (side === 'low') ends.low[axis] = Math.max(0, Math.min(Math.round(to + 0.5), box.high[axis] - MIN_VOXELS + 1));
  else ends.high[axis] = Math.min(dims[axis] - 1, Math.max(Math.round(to - 0.5), box.low[axis] + MIN_VOXELS - 1));
  return ends;
}

/**
 * Returns the twelve edges of a box of voxels, `low` to `high`, as pairs of world points, packed xyz; `affine` maps
 * voxel indices to world space.
 */
export function regionEdges({ low, high }: VoxelBox, affine: ArrayLike<number>): number[] {
  const corner = (i: number) =>
    toWorld(affine, low.map((from, k) => ((i >> k) & 1 ? (high[k] ?? 0) + 0.5 : from - 0.5)) as Vec3);
  const edges: number[] = [];
  for (let i = 0; i < 8; i++)
    for (let k = 0; k < 3; k++) if (!((i >> k) & 1)) edges.push(...corner(i), ...corner(i | (1 << k)));
  return edges;
}
