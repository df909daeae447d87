import { signal } from '@preact/signals';
import { useRef } from 'preact/hooks';
import { shortenedPoint } from '../../../engine/placing';
import type { Attractor, Vec3 } from '../../../engine/protocol';
import { place } from '../../../kit/format';
import { NumberInput } from '../../../kit/ui/field';
import { useId } from '../../../kit/ui/id';
import { Button, Help, Refusal } from '../../../kit/ui/parts';
import { MOST_ATTRACTORS } from '../../../lab/attractors';
import { text } from '../../../texts';

const STRENGTH = 0.1;
const STRONGEST = 1000;

/**
 * Keys, in the catalogue of texts, for the fields of an attractor: visible label, label for screen readers, and name of
 * a change for undo.
 */
const FIELDS = {
  strength: {
    shown: 'extractPanels.attractorStrength',
    label: 'extractPanels.attractorStrengthOf',
    change: 'extractPanels.attractorStrengthChange',
    range: { min: -STRONGEST, max: STRONGEST },
  },
  radius: {
    shown: 'extractPanels.attractorRadius',
    label: 'extractPanels.attractorRadiusOf',
    change: 'extractPanels.attractorRadiusChange',
    range: { min: 0 },
  },
} as const;

type Quantity = keyof typeof FIELDS;

export interface AttractorEvents {
  /**
   * Called with all attractors after a change; `what` names the change, for undo. With `tuning`, repeated changes in
   * quick succession are merged into one undo step.
   */
  onChange: (attractors: Attractor[], what: string, tuning: boolean) => void;
  /** Called when placing attractors by clicks in the views is switched on or off. */
  onPlacing: (placing: boolean) => void;
  /** Called to move the slices to a position in world coordinates. */
  onGoTo: (point: Vec3) => void;
  /** Returns the point in world coordinates where the slices intersect, at which a new attractor may be placed. */
  crosshair: () => Vec3;
}

/** The attractors, points that pull the surface: placed by clicking or at the crosshair. */
export class Attractors {
  readonly all = signal<readonly Attractor[]>([]);
  /** Why a change was refused. */
  readonly error = signal('');
  /** Whether clicks in the views place attractors. */
  readonly isPlacing = signal(false);
  readonly events: AttractorEvents;
  #radius = 10;

  constructor(events: AttractorEvents) {
    this.events = events;
  }

  /** Radius of the next attractor that is added, world units. */
  set radius(radius: number) {
    this.#radius = Number(radius.toPrecision(2));
  }

  /** Size of what attractors are placed in, about ten times the radius of one. */
  get size(): number {
    return 10 * this.#radius;
  }

  show(attractors: readonly Attractor[]): void {
    this.all.value = attractors;
    this.error.value = '';
  }

  showError(message: string): void {
    this.error.value = message;
  }

  add(point: Vec3): void {
    if (this.all.peek().length >= MOST_ATTRACTORS) {
      this.showError(text('extractPanels.attractorsFull', { most: MOST_ATTRACTORS }));
      return;
    }
    const rounded = shortenedPoint(point, 6, this.size);
    const added = { point: rounded, strength: STRENGTH, radius: this.#radius };
    this.#change([...this.all.peek(), added], text('extractPanels.newAttractor'));
  }

  remove(index: number): void {
    const left = this.all.peek().filter((_, i) => i !== index);
    this.#change(left, text('extractPanels.attractorRemoval', { number: index + 1 }));
  }

  set(index: number, quantity: Quantity, value: number): void {
    const problem = problemOf(quantity, value);
    if (problem) {
      // Its field shows the previous value again.
      this.show([...this.all.peek()]);
      this.showError(problem);
      return;
    }
    const next = this.all.peek().map((one, i) => (i === index ? { ...one, [quantity]: value } : one));
    this.#change(next, text(FIELDS[quantity].change, { number: index + 1 }), true);
  }

  place(isPlacing: boolean): void {
    this.isPlacing.value = isPlacing;
    this.events.onPlacing(isPlacing);
  }

  #change(attractors: Attractor[], what: string, tuning = false): void {
    this.show(attractors);
    this.events.onChange(attractors, what, tuning);
  }
}

/** Returns why an attractor cannot have a value, or undefined if it can. */
function problemOf(quantity: Quantity, value: number): string | undefined {
  if (!Number.isFinite(value)) return text('controls.numberError');
  return quantity === 'radius' && value <= 0 ? text('extractPanels.attractorRadiusError') : undefined;
}

/** Controls for attractors, each with strength and radius. */
export function AttractorControls({ of }: { of: Attractors }) {
  const isPlacing = of.isPlacing.value;
  const placer = useRef<HTMLButtonElement>(null);
  const label = text('extractPanels.attractorAtCrosshairLabel');
  const remove = (index: number) => {
    of.remove(index);
    // The focused button is removed.
    placer.current?.focus();
  };
  return (
    <div>
      <div class="buttons">
        <Button
          {...{ 'data-attractor': 'place', 'aria-pressed': isPlacing, ref: placer }}
          onClick={() => of.place(!isPlacing)}
        >
          {text(isPlacing ? 'extractPanels.attractorStopPlacing' : 'extractPanels.attractorPlace')}
        </Button>
        <Button
          {...{ 'data-attractor': 'add', title: label, 'aria-label': label }}
          onClick={() => of.add(of.events.crosshair())}
        >
          {text('extractPanels.attractorAtCrosshair')}
        </Button>
      </div>
      <Help>{text('extractPanels.attractorsHelp')}</Help>
      <ol class="attractors">
        {of.all.value.map((attractor, index) => (
          <Item key={index} {...{ of, attractor, index }} onRemove={() => remove(index)} />
        ))}
      </ol>
      <Refusal>{of.error}</Refusal>
    </div>
  );
}

interface ItemProps {
  of: Attractors;
  attractor: Attractor;
  /** Index of the attractor, from 0. */
  index: number;
}

function Item({ onRemove, ...item }: ItemProps & { onRemove: () => void }) {
  const { of, attractor, index } = item;
  const where = place(attractor.point, of.size);
  const number = index + 1;
  return (
    <li>
      <div class="row">
        <Button
          {...{ class: 'quiet place', title: text('extractPanels.showInSlices') }}
          aria-label={text('extractPanels.attractorShow', {
            name: text('extractPanels.attractorName', { number }),
            where,
          })}
          onClick={() => of.events.onGoTo(attractor.point)}
        >
          {`${number}: ${where}`}
        </Button>
        <Button class="quiet" aria-label={text('extractPanels.attractorRemove', { number })} onClick={onRemove}>
          {text('controls.remove')}
        </Button>
      </div>
      <div class="row">
        <Value {...item} quantity="strength" />
        <Value {...item} quantity="radius" />
      </div>
    </li>
  );
}

function Value({ of, attractor, index, quantity }: ItemProps & { quantity: Quantity }) {
  const id = useId();
  const { shown, label, range } = FIELDS[quantity];
  return (
    <span class="value">
      <label for={id}>{text(shown)}</label>
      <NumberInput
        {...{ ...range, id, 'aria-label': text(label, { number: index + 1 }), shown: String(attractor[quantity]) }}
        onEnter={(value) => of.set(index, quantity, value)}
      />
    </span>
  );
}
