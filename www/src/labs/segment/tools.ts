/** The tools that change labels, and their settings. */
import { signal } from '@preact/signals';
import type { ToolSettings } from './schema';

export type { ToolSettings } from './schema';
/** Effect of pressing a slice: the crosshair moves, or labels change. */
export type Tool = ToolSettings['tool'];

/** Largest radius of the brush, in shortest sides of a voxel. */
export const MOST_RADIUS = 40;
/** Largest distance of a fill in the volume along each axis, in voxels. */
export const MOST_REACH = 128;

const INITIAL: ToolSettings = {
  ...{ tool: 'brush', radius: 3, shape: 'ball', range: [0, 0], protect: false },
  ...{ extent: 'slice', reach: 50, inRange: false },
};

/** The settings in force. */
export class Tools {
  readonly settings = signal(INITIAL);

  get value(): ToolSettings {
    return this.settings.value;
  }

  /** Changes settings; radius and reach are kept within their ranges. */
  set(changed: Partial<ToolSettings>): void {
    const before = this.settings.peek();
    const radius = Math.min(MOST_RADIUS, Math.max(0, changed.radius ?? before.radius));
    const wanted = Math.round(changed.reach ?? before.reach);
    const reach = Number.isNaN(wanted) ? before.reach : Math.min(MOST_REACH, Math.max(1, wanted));
    this.settings.value = { ...before, ...changed, radius, reach };
  }

  /** Makes the brush larger or smaller by a number of steps. */
  changeRadius(steps: number): void {
    this.set({ radius: this.settings.peek().radius + steps });
  }
}

/** Whether a tool has a brush. */
export const hasBrush = (tool: Tool): boolean => tool === 'brush' || tool === 'threshold' || tool === 'eraser';

/** Whether the tool in use changes only voxels in the range of intensities. */
export function usesRange({ tool, extent, inRange }: ToolSettings): boolean {
  return tool === 'threshold' || (tool === 'fill' && extent === 'box' && inRange);
}
