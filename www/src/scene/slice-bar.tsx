import { type Signal, signal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import { useRef } from 'preact/hooks';
import { Check, NumberInput } from '../kit/ui/field';
import { useId } from '../kit/ui/id';
import { elementOf } from '../kit/ui/mount';
import { Button, Help, Refusal, Select } from '../kit/ui/parts';
import { type TextKey, text } from '../texts';
import type { DisplayWindow } from './slicing';

/** The part of the surface that is cut away in the 3D view: the patient's right, left, front, back, top or bottom. */
export type CutSide = 'none' | 'R' | 'L' | 'A' | 'P' | 'S' | 'I';

const SIDES: Record<CutSide, string> = {
  none: text('slices.cutNone'),
  R: text('slices.cutRight'),
  L: text('slices.cutLeft'),
  A: text('slices.cutFront'),
  P: text('slices.cutBack'),
  S: text('slices.cutTop'),
  I: text('slices.cutBottom'),
};

/** Windows for computed tomography, in Hounsfield units: width and level. */
const CT_WINDOWS: { key: TextKey; width: number; level: number }[] = [
  { key: 'slices.bone', width: 1800, level: 400 },
  { key: 'slices.softTissue', width: 400, level: 50 },
  { key: 'slices.lung', width: 1500, level: -600 },
  { key: 'slices.brain', width: 80, level: 40 },
];

/**
 * Returns whether intensities may be Hounsfield units: they reach from those of air, or the padding around a scan, to
 * those of soft tissue at least.
 */
export function mayBeHounsfield([low, high]: readonly [number, number]): boolean {
  return low <= -200 && low >= -8192 && high >= 50 && high <= 2 ** 15;
}

interface Preset {
  name: string;
  label: string;
  window: DisplayWindow;
}

export interface SliceBarEvents {
  onWindow: (window: DisplayWindow) => void;
  onCut: (side: CutSide) => void;
  onResetZoom: () => void;
}

/** What all slices of a volume share: the intensities displayed as black and as white, and the cut along a slice. */
export class SliceBar {
  readonly element: HTMLElement;
  readonly presets: readonly Preset[];
  readonly window: Signal<DisplayWindow>;
  readonly cut = signal<CutSide>('none');
  /** Whether drags on the slices change the window. */
  readonly adjusts = signal(false);
  readonly isZoomed = signal(false);
  /** Describes the voxel under the pointer. */
  readonly readout = signal('');
  /** Why a window was refused. */
  readonly error = signal('');

  /** `range` are the intensities of the volume, `suggested` the window that the slices have at first. */
  constructor(range: DisplayWindow, suggested: DisplayWindow, events: SliceBarEvents) {
    this.presets = presetsFor(range, suggested);
    this.window = signal(suggested);
    this.element = elementOf(<Bar of={this} events={events} />);
  }

  /** Shows the window in force. */
  show(window: DisplayWindow): void {
    this.window.value = [...window];
    this.error.value = '';
  }
}

interface BarProps {
  of: SliceBar;
  events: SliceBarEvents;
}

/** Controls of what all slices share, with a readout of the voxel under the pointer. */
function Bar({ of, events }: BarProps) {
  return (
    <div class="slice-bar">
      <p class="readout" data-readout="">
        {of.readout}
      </p>
      <details>
        <summary>{text('slices.options')}</summary>
        <div class="slice-options">
          <WindowControls {...{ of, events }} />
          <Check
            {...{ 'data-slices': 'adjust', label: text('slices.adjust'), on: of.adjusts.value }}
            set={(adjusts) => {
              of.adjusts.value = adjusts;
            }}
          />
          <Placed label={text('slices.cut')}>
            {(id) => (
              <Select
                {...{ id, 'data-view': 'cut', choices: SIDES, value: of.cut.value }}
                onChoose={(side) => {
                  of.cut.value = side;
                  events.onCut(side);
                }}
              />
            )}
          </Placed>
          <Button disabled={!of.isZoomed.value} onClick={events.onResetZoom}>
            {text('slices.resetZoom')}
          </Button>
        </div>
        <Refusal>{of.error}</Refusal>
        <Help>{text('slices.help')}</Help>
      </details>
    </div>
  );
}

const CUSTOM = 'custom';

/** The window as one of the usual ones, or by its width and level. */
function WindowControls({ of, events }: BarProps) {
  const [low, high] = of.window.value;
  const [width, level] = [high - low, (low + high) / 2];
  const widthField = useRef<HTMLSpanElement>(null);
  const preset = of.presets.find(({ window }) => window[0] === low && window[1] === high);
  const choices = {
    ...Object.fromEntries(of.presets.map(({ name, label }) => [name, label])),
    [CUSTOM]: text('slices.custom'),
  };
  const choose = (name: string) => {
    const chosen = of.presets.find((one) => one.name === name);
    if (chosen) events.onWindow(chosen.window);
    else widthField.current?.querySelector('input')?.focus();
  };
  const enter = (given: { width?: number; level?: number }) => {
    const entered = { width, level, ...given };
    const isValid = entered.width > 0 && Number.isFinite(entered.level);
    if (isValid) events.onWindow(windowOf(entered.width, entered.level));
    else of.show(of.window.peek());
    of.error.value = isValid ? '' : text('slices.windowError');
  };
  const field = (name: string, value: number, onEnter: (value: number) => void) => (id: string) => (
    <NumberInput {...{ id, 'data-slices': name, shown: typed(value), onEnter }} />
  );
  return (
    <>
      <Placed label={text('slices.contrast')}>
        {(id) => (
          <Select {...{ id, 'data-view': 'window', choices, value: preset?.name ?? CUSTOM, onChoose: choose }} />
        )}
      </Placed>
      <span class="made" ref={widthField}>
        <Placed label={text('slices.width')}>{field('width', width, (entered) => enter({ width: entered }))}</Placed>
      </span>
      <Placed label={text('slices.level')}>{field('level', level, (entered) => enter({ level: entered }))}</Placed>
    </>
  );
}

/** A control with its label before it, in a row of options. */
function Placed({ label, children }: { label: string; children: (id: string) => ComponentChildren }) {
  const id = useId();
  return (
    <span class="placement">
      <label for={id}>{label}</label>
      {children(id)}
    </span>
  );
}

function presetsFor(range: DisplayWindow, suggested: DisplayWindow): Preset[] {
  const tissues = mayBeHounsfield(range) ? CT_WINDOWS : [];
  return [
    { name: 'suggested', label: text('slices.suggested'), window: suggested },
    { name: 'whole', label: text('slices.whole'), window: range },
    ...tissues.map(({ key, width, level }) => ({ name: key, label: text(key), window: windowOf(width, level) })),
  ];
}

const windowOf = (width: number, level: number): DisplayWindow => [level - width / 2, level + width / 2];

const typed = (value: number) => String(Number(value.toPrecision(4)));
