import { signal } from '@preact/signals';
import { useLayoutEffect, useRef } from 'preact/hooks';
import { Button, Help } from '../../../kit/ui/parts';
import { text } from '../../../texts';

export interface ObjectEvents {
  /** Called when the object at the crosshair is to be found. */
  onHere: () => void;
  /** Called when what moves most is to be found: in the box that was drawn, or in the whole image. */
  onMoving: (where: 'box' | 'image') => void;
  /** Called when the whole image is to be tracked as it is. */
  onWhole: () => void;
  /** Called when the object that was tracked is to stay. */
  onKeep: () => void;
}

/** The question for the object to track. */
export class ObjectQuestion {
  readonly isOpen = signal(false);
  /** Whether a box was drawn, in which an object can be found. */
  readonly hasBox = signal(false);
  /** Whether an object is tracked already, which can stay. */
  readonly hasOther = signal(true);
  readonly isEnabled = signal(true);
  /** Why there is no proposal, and what to do; empty if there is nothing to say. */
  readonly refusal = signal('');

  open(): void {
    this.isOpen.value = true;
  }

  close(): void {
    this.isOpen.value = false;
    this.refusal.value = '';
  }
}

/** Asks for the object to track, in words, with buttons that are alternatives to a click in a slice. */
export function ObjectChoice({ of, events }: { of: ObjectQuestion; events: ObjectEvents }) {
  const isDisabled = !of.isEnabled.value;
  const isOpen = of.isOpen.value;
  const group = useRef<HTMLFieldSetElement>(null);
  useLayoutEffect(() => {
    // On a narrow page it is below the view.
    if (isOpen) group.current?.scrollIntoView({ block: 'nearest' });
  }, [isOpen]);
  const choice = (name: string, label: string, act: () => void, disabled = isDisabled) => (
    <Button data-object={name} disabled={disabled} onClick={act}>
      {label}
    </Button>
  );
  const { onHere, onMoving, onWhole, onKeep } = events;
  return (
    <fieldset class="object-choice" aria-label={text('trackPanels.objectGroup')} hidden={!isOpen} ref={group}>
      <p>
        <strong>{text('trackPanels.objectClick')}</strong>
      </p>
      <Help>{text('trackPanels.objectHelp')}</Help>
      <p class="field-error" role="alert" data-refusal="">
        {of.refusal}
      </p>
      <div class="buttons">
        {choice('here', text('trackPanels.objectHere'), onHere)}
        {choice('box', text('trackPanels.objectInBox'), () => onMoving('box'), isDisabled || !of.hasBox.value)}
        {choice('moving', text('trackPanels.objectMoving'), () => onMoving('image'))}
        {choice('whole', text('trackPanels.trackWhole'), onWhole)}
        <Button class="quiet" data-object="keep" hidden={!of.hasOther.value} onClick={onKeep}>
          {text('controls.dismiss')}
        </Button>
      </div>
    </fieldset>
  );
}
