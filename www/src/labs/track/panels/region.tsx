import { signal } from '@preact/signals';
import type { Vec3 } from '../../../engine/protocol';
import { Field, NumberInput } from '../../../kit/ui/field';
import { Button, Help, Refusal } from '../../../kit/ui/parts';
import { SLICE_NAMES, type SliceOrientation } from '../../../scene/anatomy';
import { text } from '../../../texts';
import type { VoxelBox } from '../box';
import type { Cavity } from '../protocol';

export interface RegionEvents {
  onRegion: (region: VoxelBox | undefined) => void;
  /** Called when the component to track is chosen: the one nearest to the crosshair, or the largest. */
  onComponent: (which: 'here' | 'largest') => void;
  /** Called when the lab is to ask for the object to track, or no longer. */
  onAsk: () => void;
  onCavity: (cavity: Cavity) => void;
}

/** Values that the controls of the region show. */
export interface ShownRegion {
  region: VoxelBox;
  /** Whether the region is the whole image. */
  whole: boolean;
  dims: Vec3;
  /** Names of the slices across each voxel axis. */
  names: SliceOrientation['name'][];
  /** Point in world coordinates to which the tracked component is the nearest; the largest if undefined. */
  nearest: Vec3 | undefined;
  cavity: Cavity | undefined;
}

const AXES = [0, 1, 2] as const;
const SIDES = ['low', 'high'] as const;

/** The region of interest, the component to track, and what counts as inside it. */
export class RegionState {
  readonly shown = signal<ShownRegion>({
    ...{ region: { low: [0, 0, 0], high: [0, 0, 0] }, whole: true, dims: [1, 1, 1], names: [] },
    ...{ nearest: undefined, cavity: undefined },
  });
  /** A box that was entered in part: first its one end, and then the other, may not fit to the rest. */
  readonly entered = signal<VoxelBox | undefined>(undefined);
  /** Why what was entered is refused. */
  readonly error = signal('');
  /** Whether the lab asks for the object to track. */
  readonly asks = signal(false);
  readonly isEnabled = signal(true);

  show(shown: ShownRegion): void {
    this.shown.value = shown;
    this.entered.value = undefined;
    this.error.value = '';
  }

  showError(message: string): void {
    this.error.value = message;
  }

  /** Takes over the first or last slice along an axis; returns the box if it is another, and can be one. */
  enter(side: (typeof SIDES)[number], axis: number, slice: number): VoxelBox | undefined {
    const { region, dims } = this.shown.peek();
    const box = this.entered.peek() ?? region;
    const end = box[side].map((before, k) => (k === axis ? slice : before)) as Vec3;
    const next = { ...box, [side]: end };
    this.entered.value = next;
    const isBox = AXES.every((k) => isRange(next.low[k], next.high[k], dims[k]));
    this.error.value = isBox ? '' : text('trackPanels.regionError');
    return isBox && SIDES.some((one) => next[one].some((at, k) => at !== region[one][k])) ? next : undefined;
  }
}

function isRange(from: number, to: number, size: number): boolean {
  return Number.isInteger(from) && Number.isInteger(to) && from >= 0 && to < size && from < to;
}

interface RegionProps {
  state: RegionState;
  events: RegionEvents;
}

/**
 * Controls of the Track lab for the region of interest, by its first and last slice along each axis, for the component to
 * track, and for what counts as inside it.
 */
export function RegionControls({ state, events }: RegionProps) {
  const { whole, nearest } = state.shown.value;
  const { onRegion, onComponent, onAsk } = events;
  return (
    <div class="region">
      <Button
        {...{ class: 'wide', 'data-action': 'ask', 'aria-pressed': state.asks.value, disabled: !state.isEnabled.value }}
        onClick={onAsk}
      >
        {text('trackPanels.ask')}
      </Button>
      <Help>{text('trackPanels.regionHelp')}</Help>
      {AXES.map((axis) => (
        <AxisRow key={axis} {...{ state, events, axis }} />
      ))}
      <Refusal>{state.error}</Refusal>
      <div class="buttons">
        <Button data-box="whole" disabled={whole} onClick={() => onRegion(undefined)}>
          {text('trackPanels.wholeImage')}
        </Button>
      </div>
      <p>{text('trackPanels.trackedSurface')}</p>
      <div class="buttons">
        <Button data-component="largest" aria-pressed={nearest === undefined} onClick={() => onComponent('largest')}>
          {text('trackPanels.largestComponent')}
        </Button>
        <Button data-component="here" aria-pressed={nearest !== undefined} onClick={() => onComponent('here')}>
          {text('trackPanels.nearestComponent')}
        </Button>
      </div>
      <p class="help" data-component="">
        {nearest
          ? text('trackPanels.trackedNearest', { point: nearest.map((x) => x.toFixed(1)).join(', ') })
          : text('trackPanels.trackedLargest')}
      </p>
      <CavitySwitch {...{ state, events }} />
    </div>
  );
}

/** The first and the last slice along an axis. */
function AxisRow({ state, events, axis }: RegionProps & { axis: (typeof AXES)[number] }) {
  const { region, dims, names } = state.shown.value;
  const box = state.entered.value ?? region;
  const orientation = names[axis];
  const name = orientation ? SLICE_NAMES[orientation] : '';
  const enter = (side: (typeof SIDES)[number], slice: number) => {
    const changed = state.enter(side, axis, slice);
    if (changed) events.onRegion(changed);
  };
  return (
    <div class="row">
      <span class="value">
        <span class={`swatch axis-${axis}`} aria-hidden="true" />
        <span>{name}</span>
      </span>
      <span class="value">
        {SIDES.map((side) => (
          <NumberInput
            key={side}
            {...{ min: 0, max: dims[axis] - 1, step: 1, inputMode: 'numeric' }}
            {...{ 'data-box': `${axis}-${side === 'low' ? 'first' : 'last'}` }}
            aria-label={text(side === 'low' ? 'trackPanels.firstSlice' : 'trackPanels.lastSlice', { name })}
            shown={Number.isNaN(box[side][axis]) ? '' : String(box[side][axis])}
            onEnter={(slice) => enter(side, slice)}
          />
        ))}
      </span>
    </div>
  );
}

function CavitySwitch({ state, events }: RegionProps) {
  return (
    <Field label={text('trackPanels.cavity')} help={text('trackPanels.cavityHelp')}>
      {(tied) => (
        <input
          {...{ ...tied, type: 'checkbox', role: 'switch', 'data-cavity': 'closed' }}
          checked={state.shown.value.cavity === 'closed'}
          onChange={({ currentTarget }) => events.onCavity(currentTarget.checked ? 'closed' : 'open')}
        />
      )}
    </Field>
  );
}
