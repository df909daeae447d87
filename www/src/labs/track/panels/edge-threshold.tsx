import { signal } from '@preact/signals';
import type { ParamSpec } from '../../../engine/protocol';
import { figure } from '../../../kit/format';
import { Field, NumberInput } from '../../../kit/ui/field';
import { Button, Help } from '../../../kit/ui/parts';
import { text } from '../../../texts';

/**
 * Multiple of the noise's standard deviation; a warning is shown for an edge threshold τ below it, at which noise alone
 * is detected as boundary.
 */
const NOISE_FACTOR = 2.5;

/** Intensities that the control of the threshold shows. */
interface Levels {
  threshold: number;
  /** Standard deviation of the noise. */
  noise: number;
  suggested: number;
  /**
   * The largest possible difference of intensities; the slider ends at half of it, or at the threshold if that is
   * larger.
   */
  largest: number;
}

/** The edge threshold τ, in intensity units. */
export class ThresholdState {
  readonly spec = signal<ParamSpec | undefined>(undefined);
  readonly levels = signal<Levels | undefined>(undefined);
  /** The threshold at which the slider is, until another one is in force. */
  readonly tried = signal<number | undefined>(undefined);
  /** Why a value was refused. */
  readonly error = signal('');

  show(levels: Levels): void {
    this.levels.value = levels;
    this.tried.value = undefined;
    this.error.value = '';
  }

  showError(message: string): void {
    this.error.value = message;
    this.tried.value = undefined;
  }
}

interface ThresholdProps {
  state: ThresholdState;
  /** Called with each threshold that is to take effect: released, entered or suggested. */
  onChange: (threshold: number) => void;
  /** Called with the threshold while the slider is dragged, and with undefined when it is released. */
  onTry: (threshold: number | undefined) => void;
}

/**
 * Control of the Track lab for the edge threshold τ, with the estimated noise level, a suggested value, and a warning
 * if the threshold is below {@link NOISE_FACTOR} times the noise.
 */
export function EdgeThreshold(props: ThresholdProps) {
  const spec = props.state.spec.value;
  return spec ? <Control {...props} spec={spec} /> : null;
}

function Control({ state, spec, onChange, onTry }: ThresholdProps & { spec: ParamSpec }) {
  const { label, symbol, help } = spec;
  const levels = state.levels.value;
  const tried = state.tried.value;
  const enter = (threshold: number) => {
    state.error.value = '';
    onChange(threshold);
  };
  const shown = tried ?? (levels && Number(levels.threshold.toPrecision(6)));
  return (
    <Field
      {...{ label, symbol, help, error: state.error.value, 'data-param': 'threshold' }}
      below={<Slider {...{ state, label, onTry, onChange: enter }} />}
      after={levels && <Advice {...levels} onUse={() => enter(levels.suggested)} />}
    >
      {(tied) => <NumberInput {...tied} min={0} shown={shown === undefined ? '' : String(shown)} onEnter={enter} />}
    </Field>
  );
}

function Slider({ state, label, onChange, onTry }: ThresholdProps & { label: string }) {
  const { threshold = 0, largest = 2 } = state.levels.value ?? {};
  const top = rounded(Math.max(largest / 2, threshold));
  return (
    <input
      {...{ type: 'range', min: 0, max: top, step: top / 500, value: state.tried.value ?? threshold }}
      {...{ 'aria-label': text('controls.sliderOf', { label }), 'aria-valuetext': figure(threshold) }}
      onInput={({ currentTarget }) => {
        state.tried.value = rounded(currentTarget.valueAsNumber);
        onTry(state.tried.value);
      }}
      // A change restarts the tracker, so it is applied only when the slider is released.
      onChange={({ currentTarget }) => {
        onTry(undefined);
        onChange(rounded(currentTarget.valueAsNumber));
      }}
    />
  );
}

/** The suggested threshold, and a warning if the one in force is below the noise. */
function Advice({ threshold, noise, suggested, onUse }: Levels & { onUse: () => void }) {
  const limit = NOISE_FACTOR * noise;
  const values = { noise: figure(rounded(noise)), suggested: figure(rounded(suggested)) };
  return (
    <>
      <Help>{text('trackPanels.noiseEstimate', values)}</Help>
      <div class="buttons">
        <Button data-threshold="suggest" disabled={Object.is(threshold, suggested)} onClick={onUse}>
          {text('trackPanels.useSuggested', { suggested: values.suggested })}
        </Button>
      </div>
      <p class="warning" role="status">
        {threshold < limit && text('trackPanels.noiseWarning', { limit: figure(rounded(limit)) })}
      </p>
    </>
  );
}

const rounded = (value: number) => Number(value.toPrecision(3));
