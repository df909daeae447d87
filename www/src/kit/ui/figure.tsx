import type { ReadonlySignal } from '@preact/signals';
import { text } from '../../texts';
import { Button, Help } from './parts';

/** One of the images of a paper's figure, with its own settings. */
interface FigureVariant {
  name: string;
  /** Describes the lab's result, for comparison with the paper's. */
  ourResult: string;
}

/** The part of a lab's preset that the panel shows: a figure of the paper whose method the lab runs. */
interface PaperFigure<One extends FigureVariant> {
  /** Describes the paper's result. */
  paperResult: string;
  variants: [One, ...One[]];
  /** Hint at further details to observe. */
  hint?: string;
}

interface FigureProps<Variant extends FigureVariant, Preset extends PaperFigure<Variant>> {
  /** The figure that is open; undefined if none is. */
  preset: Preset | undefined;
  /** The image that the present settings match; undefined if they were changed. */
  variant: Variant | undefined;
  onVariant: (preset: Preset, variant: Variant) => void;
}

/**
 * Describes the figure of a paper that is open as a preset: the paper's result, the lab's result, and a button for each
 * image of the figure.
 */
export function Figure<Variant extends FigureVariant, Preset extends PaperFigure<Variant>>({
  preset,
  variant,
  onVariant,
}: FigureProps<Variant, Preset>) {
  if (!preset) return <div class="figure" hidden />;
  const buttons = preset.variants.map((one) => (
    <Button key={one.name} aria-pressed={one === variant} onClick={() => onVariant(preset, one)}>
      {one.name}
    </Button>
  ));
  return (
    <div class="figure">
      <p>
        <strong>{text('controls.figurePaper')}</strong>
        {preset.paperResult}
      </p>
      <p data-figure="came">{variant?.ourResult ?? text('controls.figureChanged')}</p>
      {buttons.length > 1 && (
        <fieldset class="buttons" aria-label={text('controls.figureImages')}>
          {buttons}
        </fieldset>
      )}
      {preset.hint && <Help>{preset.hint}</Help>}
    </div>
  );
}

/** The figure of a paper that a lab has open, if it has one. */
export function FigureOf<Variant extends FigureVariant, Preset extends PaperFigure<Variant>>({
  shown,
  onVariant,
}: {
  shown: ReadonlySignal<Pick<FigureProps<Variant, Preset>, 'preset' | 'variant'>>;
  onVariant: (preset: Preset, variant: Variant) => void;
}) {
  return <Figure {...shown.value} onVariant={onVariant} />;
}
