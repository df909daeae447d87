import { signal } from '@preact/signals';
import { Field, NumberInput } from '../../../kit/ui/field';
import { Select } from '../../../kit/ui/parts';
import { text } from '../../../texts';
import type { Enrichment, Preparation } from '../protocol';

const BINNINGS = { 1: '×1', 2: '×2' };
const KINDS: Record<Enrichment, string> = {
  none: text('trackPanels.enrichNone'),
  linear: text('trackPanels.enrichLinear'),
  flow: text('trackPanels.enrichFlow'),
};
/** Largest factor, supported by the library, by which in-between slices may divide the distance between slices. */
const MAX_FACTOR = 16;

/** The preprocessing of the image before tracking: binning and in-between slices. */
export class PreparationState {
  readonly inForce = signal<Preparation>({ binning: 1, enrichment: 'none', factor: 0 });
  /** Whether the last factor that was entered was refused. */
  readonly isRefused = signal(false);

  show(preparation: Preparation): void {
    this.inForce.value = { ...preparation };
    this.isRefused.value = false;
  }
}

interface PreparationProps {
  state: PreparationState;
  /** Called after a change; `what` names it, for undo. */
  onChange: (preparation: Preparation, what: string) => void;
}

/** Controls of the Track lab for the preprocessing of the image before tracking. */
export function PreparationControls({ state, onChange }: PreparationProps) {
  const { binning, enrichment } = state.inForce.value;
  const change = (changed: Partial<Preparation>, what: string) =>
    onChange({ ...state.inForce.peek(), ...changed }, what);
  return (
    <div class="preparation">
      <Field label={text('trackPanels.binning')} help={text('trackPanels.binningHelp')}>
        {(tied) => (
          <Select
            {...{ ...tied, 'data-prepare': 'binning', choices: BINNINGS, value: String(binning) as '1' | '2' }}
            onChoose={(chosen) => change({ binning: chosen === '2' ? 2 : 1 }, text('trackPanels.binningChange'))}
          />
        )}
      </Field>
      <Field label={text('trackPanels.inBetweenSlices')} help={text('trackPanels.inBetweenSlicesHelp')}>
        {(tied) => (
          <Select
            {...{ ...tied, 'data-prepare': 'enrichment', choices: KINDS, value: enrichment }}
            onChoose={(chosen) => change({ enrichment: chosen }, text('trackPanels.inBetweenSlicesChange'))}
          />
        )}
      </Field>
      <Factor state={state} onEnter={(factor) => change({ factor }, text('trackPanels.inBetweenFactorChange'))} />
    </div>
  );
}

/** The field for the number of in-between slices; empty for as many as make cubes. */
function Factor({ state, onEnter }: { state: PreparationState; onEnter: (factor: number) => void }) {
  const { factor, enrichment } = state.inForce.value;
  const enter = (input: HTMLInputElement) => {
    state.isRefused.value = !input.checkValidity();
    if (input.checkValidity()) onEnter(input.value === '' ? 0 : input.valueAsNumber);
  };
  return (
    <Field
      label={text('trackPanels.inBetweenFactor')}
      help={text('trackPanels.inBetweenFactorHelp')}
      error={state.isRefused.value ? text('trackPanels.inBetweenFactorError', { most: MAX_FACTOR }) : ''}
    >
      {(tied) => (
        <NumberInput
          {...{ ...tied, 'data-prepare': 'factor', min: 0, max: MAX_FACTOR, step: 1, inputMode: 'numeric' }}
          {...{ placeholder: text('controls.auto'), disabled: enrichment === 'none' }}
          shown={factor > 0 ? String(factor) : ''}
          onEnter={(_, input) => enter(input)}
        />
      )}
    </Field>
  );
}
