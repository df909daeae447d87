import type { ReadonlySignal } from '@preact/signals';
import { Field } from '../../../kit/ui/field';
import { Select } from '../../../kit/ui/parts';
import { text } from '../../../texts';
import type { Support } from '../protocol';

const SUPPORTS: Record<Support, string> = {
  surface: text('sculptPanels.supportSurface'),
  membrane: text('sculptPanels.supportMembrane'),
};
const HELP: Record<Support, string> = {
  surface: text('sculptPanels.supportSurfaceHelp'),
  membrane: text('sculptPanels.supportMembraneHelp'),
};

interface SupportProps {
  support: ReadonlySignal<Support>;
  /** Whether there is a choice; without one, the control is hidden. */
  hasChoice: ReadonlySignal<boolean>;
  onSupport: (support: Support) => void;
}

/** Control of the Sculpt lab for what supports a surface. */
export function SupportControl({ support, hasChoice, onSupport }: SupportProps) {
  return (
    <Field isRow label={text('sculptPanels.support')} help={HELP[support.value]} hidden={!hasChoice.value}>
      {(tied) => (
        <Select {...{ ...tied, choices: SUPPORTS, value: support.value, 'data-support': '', onChoose: onSupport }} />
      )}
    </Field>
  );
}
