import { computed, signal } from '@preact/signals';
import { useLayoutEffect, useRef } from 'preact/hooks';
import { shortenedPoint } from '../../../engine/placing';
import { NumberInput } from '../../../kit/ui/field';
import { Button, Help, Refusal } from '../../../kit/ui/parts';
import { text } from '../../../texts';
import { boxOf, lengthsOf, turned, withLengths } from '../ellipsoids';
import type { HandleMode } from '../handles';
import type { ControlEllipsoid, Pose, Vec3 } from '../protocol';

const MODES: { mode: HandleMode; label: string; key: string; help: string }[] = [
  {
    mode: 'move',
    label: text('sculptPanels.modeMove'),
    key: 'm',
    help: text('sculptPanels.modeMoveHelp'),
  },
  {
    mode: 'turn',
    label: text('sculptPanels.modeRotate'),
    key: 't',
    help: text('sculptPanels.modeRotateHelp'),
  },
  {
    mode: 'size',
    label: text('sculptPanels.modeScale'),
    key: 'e',
    help: text('sculptPanels.modeScaleHelp'),
  },
];
/** Significant digits of coordinates and lengths; dragging is no more precise. */
const DIGITS = 4;
/** Number of characters for which there is room in each of three fields side by side. */
const WIDTH = 8;
const AXES = ['x', 'y', 'z'] as const;
const DIRECTIONS: Vec3[] = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];

export interface EllipsoidEvents {
  onChoose: (index: number | undefined) => void;
  onMode: (mode: HandleMode) => void;
  /** Called with the selected ellipsoid after a change; `what` names the change, for undo. */
  onChange: (ellipsoid: ControlEllipsoid, what: string) => void;
  onAdd: () => void;
  onRemove: () => void;
}

/** The control ellipsoids, as their controls show them. */
export class Ellipsoids {
  readonly pose = signal<Pose>([]);
  readonly names = signal<readonly string[]>([]);
  /** Index of the selected ellipsoid. */
  readonly chosen = signal<number | undefined>(undefined);
  /** What handles and arrow keys do. */
  readonly mode = signal<HandleMode>('move');
  /** Angle of a turn by the buttons. */
  readonly degrees = signal(15);
  /** Why a change was refused. */
  readonly error = signal('');
  /** Number of times that the focus was asked for. */
  readonly focused = signal(0);
  /** The selected ellipsoid. */
  readonly selected = computed(() => {
    const index = this.chosen.value;
    return index === undefined ? undefined : this.pose.value[index];
  });

  show(pose: Pose, names: readonly string[], chosen: number | undefined): void {
    this.pose.value = pose;
    this.names.value = names;
    this.chosen.value = chosen;
    this.error.value = '';
  }

  /**
   * Focuses the button of the selected ellipsoid, or of the first if none is selected; called when the focused button
   * may have been removed.
   */
  focus(): void {
    this.focused.value += 1;
  }
}

interface EllipsoidProps {
  state: Ellipsoids;
  events: EllipsoidEvents;
}

/** Controls of the Sculpt lab: a list of the control ellipsoids, and fields for the selected one. */
export function EllipsoidControls({ state, events }: EllipsoidProps) {
  const mode = state.mode.value;
  const selected = state.selected.value;
  return (
    <div class="ellipsoids">
      <Help>{text('sculptPanels.ellipsoidsHelp')}</Help>
      <List {...{ state, events }} />
      <div class="buttons">
        <Button data-ellipsoid="add" onClick={events.onAdd}>
          {text('sculptPanels.add')}
        </Button>
        <Button data-ellipsoid="remove" disabled={!selected || state.pose.value.length < 2} onClick={events.onRemove}>
          {text('controls.remove')}
        </Button>
      </div>
      <fieldset class="buttons" aria-label={text('sculptPanels.handleMode')}>
        {MODES.map(({ mode: one, label, key }) => (
          <Button
            key={one}
            {...{ 'data-mode': one, 'aria-pressed': one === mode, title: text('sculptPanels.modeKey', { key }) }}
            onClick={() => events.onMode(one)}
          >
            {label}
          </Button>
        ))}
      </fieldset>
      <Help>{text('sculptPanels.modeHelp', { help: MODES.find((one) => one.mode === mode)?.help ?? '' })}</Help>
      {selected && <Numbers {...{ state, events, selected }} />}
      <Refusal>{state.error}</Refusal>
    </div>
  );
}

/** A button for each ellipsoid. */
function List({ state, events }: EllipsoidProps) {
  const chosen = state.chosen.value;
  const buttons = useRef<(HTMLButtonElement | null)[]>([]);
  const focused = state.focused.value;
  useLayoutEffect(() => {
    if (focused > 0) buttons.current[state.chosen.peek() ?? 0]?.focus();
  }, [focused, state]);
  return (
    <fieldset class="buttons chips" aria-label={text('sculptPanels.ellipsoids')}>
      {state.names.value.map((name, index) => (
        <Button
          key={index}
          {...{ 'data-ellipsoid': index + 1, 'aria-pressed': index === chosen }}
          ref={(button) => {
            buttons.current[index] = button;
          }}
          onClick={() => events.onChoose(index === chosen ? undefined : index)}
        >
          {`${index + 1} ${name}`.trim()}
        </Button>
      ))}
    </fieldset>
  );
}

/** Fields for centre and semi-axes of the selected ellipsoid, and buttons that turn it. */
function Numbers({ state, events, selected }: EllipsoidProps & { selected: ControlEllipsoid }) {
  const place = placeOf(selected, state.pose.value);
  const lengths = lengthsOf(selected);
  const refuse = (message: string) => {
    state.error.value = message;
  };
  const setCenter = (k: number, value: number) => {
    if (!Number.isFinite(value)) return refuse(text('controls.numberError'));
    const center: Vec3 = [...selected.center];
    center[k] = value;
    events.onChange({ ...selected, center }, text('sculpt.moved'));
  };
  const setLength = (k: number, value: number) => {
    if (!(value > 0)) return refuse(text('sculptPanels.lengthError'));
    events.onChange(
      withLengths(selected, lengths.map((length, one) => (one === k ? value : length)) as Vec3),
      text('sculpt.scaled'),
    );
  };
  const turn = (about: Vec3) => {
    const angle = (state.degrees.value * Math.PI) / 180;
    if (!Number.isFinite(angle)) return refuse(text('sculptPanels.angleError'));
    events.onChange(turned(selected, about, angle), text('sculpt.rotated'));
  };
  const isLong = place.some((coordinate) => coordinate.length > WIDTH);
  return (
    <div class="numbers">
      <div class={isLong ? 'triple long' : 'triple'}>
        <span>{text('sculptPanels.centre')}</span>
        {AXES.map((axis, k) => (
          <NumberInput
            key={axis}
            {...{ 'aria-label': text('sculptPanels.centreAxis', { axis }), shown: place[k] ?? '' }}
            onEnter={(value) => setCenter(k, value)}
          />
        ))}
      </div>
      <div class="triple">
        <span>{text('sculptPanels.semiAxes')}</span>
        {AXES.map((axis, k) => (
          <NumberInput
            key={axis}
            {...{ 'aria-label': text('sculptPanels.semiAxis', { number: k + 1 }), shown: short(lengths[k] ?? 0) }}
            onEnter={(value) => setLength(k, value)}
          />
        ))}
      </div>
      <div class="triple">
        <span>
          {text('sculptPanels.rotateBy')}
          <NumberInput
            {...{ min: -180, max: 180, 'aria-label': text('sculptPanels.rotationAngle') }}
            shown={Number.isNaN(state.degrees.value) ? '' : String(state.degrees.value)}
            onEnter={(angle) => {
              state.degrees.value = angle;
            }}
          />
          {text('sculptPanels.degreesAbout')}
        </span>
        {AXES.map((axis, k) => (
          <Button
            key={axis}
            {...{ 'aria-label': text('sculptPanels.rotateAbout', { axis }), 'data-turn': axis }}
            onClick={() => turn(DIRECTIONS[k] ?? [1, 0, 0])}
          >
            {axis}
          </Button>
        ))}
      </div>
    </div>
  );
}

/** Returns the centre of an ellipsoid as texts, to four digits of the box around all ellipsoids. */
function placeOf({ center }: ControlEllipsoid, pose: Pose): string[] {
  const { min, max } = boxOf(pose);
  const size = Math.max(...max.map((high, k) => high - (min[k] ?? 0)));
  return shortenedPoint(center, DIGITS, size).map(String);
}

/** Formats a length with as many digits as it is worth. */
function short(value: number): string {
  return String(Number(value.toPrecision(DIGITS)));
}
