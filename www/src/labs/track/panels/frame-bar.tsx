import { signal } from '@preact/signals';
import { count } from '../../../kit/format';
import { useId } from '../../../kit/ui/id';
import { Button, Icon } from '../../../kit/ui/parts';
import { text } from '../../../texts';

const PLAY = 'M7 4.5v15l12-7.5z';
const PAUSE = 'M6 5h4.5v14H6zM13.5 5H18v14h-4.5z';
const BACK = 'M6 5h2.5v14H6zM18 5v14l-9-7z';
const ON = 'M6 5v14l9-7zM16 5h2.5v14H16z';
/** Milliseconds for which a frame is shown during playback: slower than a heartbeat, so that the eye can follow. */
const FRAME_MS = 110;

/** The frames of the image: one is shown, and those that have a surface can be played in a loop. */
export class Frames {
  /** The current frame, an index from 0, the number of frames, and that of the first frames with a surface. */
  readonly shown = signal({ frame: 0, frames: 1, done: 0 });
  readonly isPlaying = signal(false);
  readonly #onFrame: (frame: number) => void;
  #pending = 0;
  #since = 0;

  /** `onFrame` is called with the frame to show, when the user or playback selects another one. */
  constructor(onFrame: (frame: number) => void) {
    this.#onFrame = onFrame;
  }

  get frame(): number {
    return this.shown.peek().frame;
  }

  /**
   * Shows the current `frame`, an index from 0, of `frames`; the first `done` frames have a surface and can be played.
   */
  show(frame: number, frames: number, done: number): void {
    this.shown.value = { frame: Math.min(frame, frames - 1), frames, done };
    if (done < 2) this.stop();
  }

  /** Stops playback and moves by `by` frames, cyclically through all frames. */
  go(by: number): void {
    const { frame, frames } = this.shown.peek();
    this.goTo((frame + by + frames) % frames);
  }

  /** Stops playback and shows a frame. */
  goTo(frame: number): void {
    this.stop();
    this.#onFrame(frame);
  }

  toggle(): void {
    if (this.isPlaying.peek()) this.stop();
    else this.start();
  }

  start(): void {
    if (this.shown.peek().done < 2 || this.isPlaying.peek()) return;
    this.#since = performance.now();
    this.#pending = requestAnimationFrame((now) => this.#turn(now));
    this.isPlaying.value = true;
  }

  stop(): void {
    cancelAnimationFrame(this.#pending);
    this.isPlaying.value = false;
  }

  #turn(now: number): void {
    this.#pending = requestAnimationFrame((next) => this.#turn(next));
    if (now - this.#since < FRAME_MS) return;
    this.#since = now;
    const { frame, done } = this.shown.peek();
    this.#onFrame((frame + 1) % Math.max(1, done));
  }
}

/** Controls of the Track lab to step through the frames of the image, or play those that have a surface in a loop. */
export function FrameBar({ of }: { of: Frames }) {
  const id = useId();
  const { frame, frames, done } = of.shown.value;
  const isPlaying = of.isPlaying.value;
  const title = text(isPlaying ? 'trackPanels.stopLoopLabel' : 'trackPanels.loopLabel');
  const isStill = frames < 2;
  return (
    <fieldset class="frames" aria-label={text('trackPanels.frames')} data-frame={frame + 1}>
      <div class="buttons">
        <Step {...{ of, by: -1, name: 'previous', path: BACK, label: text('trackPanels.previousFrame'), isStill }} />
        <Button
          {...{ 'data-frame': 'beat', title, 'aria-label': title, disabled: done < 2 }}
          onClick={() => of.toggle()}
        >
          <span class="icon-holder">
            <Icon path={isPlaying ? PAUSE : PLAY} />
          </span>
          <span>{text(isPlaying ? 'trackPanels.stopLoop' : 'trackPanels.loop')}</span>
        </Button>
        <Step {...{ of, by: 1, name: 'next', path: ON, label: text('trackPanels.nextFrame'), isStill }} />
      </div>
      <label for={id}>{text('controls.frame')}</label>
      <input
        {...{ type: 'range', id, min: 0, max: Math.max(1, frames - 1), step: 1, value: frame, disabled: isStill }}
        {...{ 'aria-valuetext': text('trackPanels.frameOfSpoken', { frame: frame + 1, frames }) }}
        onInput={({ currentTarget }) => of.goTo(currentTarget.valueAsNumber)}
      />
      {/* Not announced: the slider announces its value already. */}
      <output aria-live="off" data-frames="">
        {text('controls.frameOf', { frame: count(frame + 1), last: count(frames) })}
      </output>
    </fieldset>
  );
}

interface StepProps {
  of: Frames;
  by: 1 | -1;
  name: string;
  path: string;
  label: string;
  isStill: boolean;
}

function Step({ of, by, name, path, label, isStill }: StepProps) {
  return (
    <Button {...{ 'data-frame': name, 'aria-label': label, title: label, disabled: isStill }} onClick={() => of.go(by)}>
      <Icon path={path} />
    </Button>
  );
}
