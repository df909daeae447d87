import type { ReadonlySignal } from '@preact/signals';
import { Button, Help } from '../../../kit/ui/parts';
import { count, text } from '../../../texts';

interface OfferProps {
  /** Number of labels; 0 hides the message. */
  labels: ReadonlySignal<number>;
  onSegment: () => void;
}

/** Message that a volume looks like a label map, with a button that opens it where each label gets a surface. */
export function LabelsOffer({ labels, onSegment }: OfferProps) {
  const isShown = labels.value > 0;
  return (
    <div role="status" hidden={!isShown}>
      <Help>{isShown && text('extract.looksLikeLabels', { labels: count(labels.value) })}</Help>
      <Button data-action="segment" onClick={onSegment}>
        {text('extract.openInSegment')}
      </Button>
    </div>
  );
}
