import { type ReadonlySignal, useSignal } from '@preact/signals';
import { useLayoutEffect } from 'preact/hooks';
import { count } from '../../../kit/format';
import { useId } from '../../../kit/ui/id';
import { text } from '../../../texts';

interface FrameProps {
  /** Index of the open frame, and the number of frames. */
  open: ReadonlySignal<{ frame: number; frames: number }>;
  /** Called with the index of the frame that the user chooses. */
  onFrame: (frame: number) => void;
}

/** Slider of the Extract lab that chooses the frame of a 4D volume to which the surface is fitted; hidden for others. */
export function FrameChoice({ open, onFrame }: FrameProps) {
  const id = useId();
  const { frame, frames } = open.value;
  const dragged = useSignal<number | undefined>(undefined);
  useLayoutEffect(() => {
    dragged.value = undefined;
  }, [open.value]);
  const at = dragged.value ?? frame;
  const shown = text('controls.frameOf', { frame: count(at + 1), last: count(frames) });
  return (
    <div class="param" data-param="frame" hidden={frames < 2}>
      <label for={id}>{text('controls.frame')}</label>
      <output aria-live="off">{shown}</output>
      <input
        {...{ type: 'range', id, min: 0, max: frames - 1, step: 1, value: at }}
        {...{ 'aria-describedby': `${id}-help`, 'aria-valuetext': shown }}
        onInput={({ currentTarget }) => {
          dragged.value = currentTarget.valueAsNumber;
        }}
        // Each choice opens the frame, so it is applied only when the slider is released.
        onChange={({ currentTarget }) => onFrame(currentTarget.valueAsNumber)}
      />
      <p class="help" id={`${id}-help`}>
        {text('slices.frameHelp')}
      </p>
    </div>
  );
}
