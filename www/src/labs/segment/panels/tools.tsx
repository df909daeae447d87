import { type ReadonlySignal, useSignal } from '@preact/signals';
import { Check, Field, NumberInput } from '../../../kit/ui/field';
import { useId } from '../../../kit/ui/id';
import { Button, Help, Refusal, Select, Travel, type Undoable } from '../../../kit/ui/parts';
import { text } from '../../../texts';
import { hasBrush, MOST_RADIUS, MOST_REACH, type Tool, type Tools, usesRange } from '../tools';

const TOOLS: { tool: Tool; key: string; label: string; help: string }[] = [
  { tool: 'navigate', key: 'v', label: text('segment.navigate'), help: text('segment.navigateHelp') },
  { tool: 'brush', key: 'b', label: text('segment.brush'), help: text('segment.brushHelp') },
  { tool: 'threshold', key: 't', label: text('segment.threshold'), help: text('segment.thresholdHelp') },
  { tool: 'eraser', key: 'e', label: text('segment.eraser'), help: text('segment.eraserHelp') },
  { tool: 'fill', key: 'f', label: text('segment.fill'), help: text('segment.fillHelp') },
];
const SHAPES = { ball: text('segment.ball'), disc: text('segment.disc') };
const EXTENTS = { slice: text('segment.extentSlice'), box: text('segment.extentBox') };

interface BarProps {
  tools: Tools;
  undo: ReadonlySignal<Undoable>;
  onTravel: (direction: 'undo' | 'redo') => void;
}

/** The tools, the radius of the brush, undo and redo. */
export function ToolBar({ tools, undo, onTravel }: BarProps) {
  const { tool, radius } = tools.value;
  const id = useId();
  return (
    <fieldset class="tool-bar" aria-label={text('segment.sectionTool')}>
      <div class="tool-choice" role="radiogroup" aria-label={text('segment.toolGroup')}>
        {TOOLS.map((one) => (
          <label key={one.tool} title={text('segment.toolTitle', { help: one.help, key: one.key.toUpperCase() })}>
            <input
              type="radio"
              name={`tool-${id}`}
              value={one.tool}
              data-tool={one.tool}
              checked={one.tool === tool}
              onChange={() => tools.set({ tool: one.tool })}
            />
            {one.label}
          </label>
        ))}
      </div>
      <div class="radius" title={text('segment.radiusHelp')}>
        <label for={id}>{text('segment.radius')}</label>
        <input
          type="range"
          id={id}
          min={0}
          max={MOST_RADIUS}
          step={1}
          value={radius}
          disabled={!hasBrush(tool)}
          data-tool-setting="radius"
          onInput={({ currentTarget }) => tools.set({ radius: currentTarget.valueAsNumber })}
        />
        <output for={id} aria-live="off">
          {radius}
        </output>
      </div>
      <div class="buttons">
        <Travel direction="undo" undo={undo.value} onClick={() => onTravel('undo')} />
        <Travel direction="redo" undo={undo.value} onClick={() => onTravel('redo')} />
      </div>
    </fieldset>
  );
}

interface SettingsProps {
  tools: Tools;
  /** Whether the tool can be applied at the crosshair. */
  isReady: ReadonlySignal<boolean>;
  onApply: () => void;
}

/** Description of the tool in use, and its other settings. */
export function ToolSettings({ tools, isReady, onApply }: SettingsProps) {
  const { tool, shape, extent, reach, inRange, protect } = tools.value;
  const isBoxFill = tool === 'fill' && extent === 'box';
  return (
    <div class="tool-settings">
      <p class="help" data-tool-help="">
        {TOOLS.find((one) => one.tool === tool)?.help}
      </p>
      {hasBrush(tool) && (
        <Field isRow label={text('segment.shape')}>
          {(tied) => (
            <Select
              {...{ ...tied, choices: SHAPES, value: shape, 'data-tool-setting': 'shape' }}
              onChoose={(chosen) => tools.set({ shape: chosen })}
            />
          )}
        </Field>
      )}
      {tool === 'fill' && (
        <Field isRow label={text('segment.extent')}>
          {(tied) => (
            <Select
              {...{ ...tied, choices: EXTENTS, value: extent, 'data-tool-setting': 'extent' }}
              onChoose={(chosen) => tools.set({ extent: chosen })}
            />
          )}
        </Field>
      )}
      {isBoxFill && (
        <Field isRow label={text('segment.reach')} title={text('segment.reachHelp')}>
          {(tied) => (
            <NumberInput
              {...{ ...tied, min: 1, max: MOST_REACH, step: 1, shown: String(reach), 'data-tool-setting': 'reach' }}
              onEnter={(value, input) => {
                tools.set({ reach: value });
                input.valueAsNumber = tools.value.reach;
              }}
            />
          )}
        </Field>
      )}
      {isBoxFill && (
        <Check
          data-tool-setting="in-range"
          label={text('segment.inRange')}
          on={inRange}
          set={(on) => tools.set({ inRange: on })}
        />
      )}
      {usesRange(tools.value) && <Range tools={tools} />}
      <Check
        data-tool-setting="protect"
        label={text('segment.protect')}
        on={protect}
        set={(on) => tools.set({ protect: on })}
      />
      <Help>{text('segment.protectHelp')}</Help>
      <Button class="wide" data-action="apply" disabled={!isReady.value} onClick={onApply}>
        {text('segment.apply')}
      </Button>
      <Help>{text('segment.applyHelp')}</Help>
    </div>
  );
}

/** The range of intensities that the tool is limited to. */
function Range({ tools }: { tools: Tools }) {
  const { range } = tools.value;
  // What was typed stays, so that the other end can be typed, too.
  const refused = useSignal<{ typed: [number, number]; inForce: [number, number] } | undefined>(undefined);
  const isRefused = refused.value?.inForce === range;
  const shown = isRefused && refused.value ? refused.value.typed : range;
  const change = (end: 0 | 1, value: number) => {
    const typed: [number, number] = end === 0 ? [value, shown[1]] : [shown[0], value];
    if (typed[0] <= typed[1]) tools.set({ range: typed });
    else refused.value = { typed, inForce: range };
  };
  const field = (end: 0 | 1) => (
    <input
      type="number"
      step="any"
      required
      value={shown[end]}
      data-tool-setting={end === 0 ? 'low' : 'high'}
      aria-label={text(end === 0 ? 'segment.rangeLow' : 'segment.rangeHigh')}
      onChange={({ currentTarget }) => change(end, currentTarget.valueAsNumber)}
    />
  );
  return (
    <>
      <div class="row stacked">
        <span>{text('segment.range')}</span>
        <span class="value">
          {field(0)}–{field(1)}
        </span>
      </div>
      <Refusal>{isRefused && text('segment.rangeError')}</Refusal>
    </>
  );
}
